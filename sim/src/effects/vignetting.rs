//! Darkening towards the corners.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Vignetting;

impl Effect for Vignetting {
    fn about(&self) -> About {
        About {
            name: "vignetting",
            model: "natural vignetting, cos^4 of the angle from the axis",
            keys: &["camera.vignetting", "camera.focal_length_mm"],
            cost: "one multiplication a pixel",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if view.scene.camera.vignetting {
            range.change_by_factor(corner_gain(&view.scene))
        } else {
            0.0
        }
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        if view.scene.camera.vignetting {
            range.floor *= corner_gain(&view.scene);
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        if view.scene.camera.vignetting {
            let camera = &view.scene.camera;
            formation.row_stages.push(Box::new(Cos4 {
                principal_px: camera.principal_px(),
                per_px: 1.0 / camera.focal_px(),
            }));
        }
    }
}

/// The gain at the sensor's corner.
fn corner_gain(scene: &crate::scene::Scene) -> f64 {
    let [x, y] = scene.camera.principal_px();
    let tangent = x.hypot(y) / scene.camera.focal_px();
    (1.0 + tangent * tangent).powi(-2)
}

struct Cos4 {
    principal_px: [f64; 2],
    per_px: f64,
}

impl Cos4 {
    fn gain(&self, x: usize, y: usize) -> f64 {
        let [u, v] = [x as f64 - self.principal_px[0], y as f64 - self.principal_px[1]].map(|p| p * self.per_px);
        (1.0 + u * u + v * v).powi(-2)
    }
}

impl crate::formation::RowStage for Cos4 {
    fn apply(&self, x: usize, y: usize, row: &mut [f32]) {
        for (i, value) in row.iter_mut().enumerate() {
            *value *= self.gain(x + i, y) as f32;
        }
    }

    fn apply_exact(&self, x: usize, y: usize, row: &mut [f64]) {
        for (i, value) in row.iter_mut().enumerate() {
            *value *= self.gain(x + i, y);
        }
    }
}
