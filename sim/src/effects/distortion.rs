//! Radial distortion of the lens: each LED is drawn at its distorted position, as its local affine image.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Distortion;

impl Effect for Distortion {
    fn about(&self) -> About {
        About {
            name: "distortion",
            model: "radial distortion of first order, rho (1 + k1 rho^2) with rho in focal lengths (Brown 1966)",
            keys: &["camera.distortion_k1"],
            cost: "chords for each LED instead of one set",
        }
    }

    /// The shift of LEDs by k₁·ρ³, and of their rims against their centres: ρ·(1 + k₁·ρ²) has the slope 1 + 3·k₁·ρ².
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let camera = &view.scene.camera;
        let principal = glam::DVec2::from_array(camera.principal_px());
        let leds = view.panels.iter().flat_map(|panel| {
            let shaken_px = super::shake::reach(view, panel).shift_px;
            panel.ellipses.iter().map(move |ellipse| (ellipse, shaken_px))
        });
        let (mut shift, mut rim) = (0.0f64, 0.0f64);
        for (ellipse, shaken_px) in leds {
            let radius = (ellipse.centre - principal).length() + shaken_px;
            let extent = ellipse.half_extent().length();
            let stretch = camera.distortion_k1.abs() * ((radius + extent) / camera.focal_px()).powi(2);
            shift = shift.max(stretch * radius);
            rim = rim.max(3.0 * stretch * extent);
        }
        range.change_by_geometry(shift, rim)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.distortion_k1 = view.scene.camera.distortion_k1;
    }
}
