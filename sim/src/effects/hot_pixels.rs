//! Pixels that show a bright level in any light.

use super::{About, Effect};
use crate::air::Air;
use crate::camera::curve::Curve;
use crate::formation::{Formation, RowStage};
use crate::random::{Fixed, Purpose};
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct HotPixels;

impl Effect for HotPixels {
    fn about(&self) -> About {
        About {
            name: "hot_pixels",
            model: "pixels that read no less than a level, each by its chance and fixed by the camera's seed",
            keys: &["camera.hot_pixels_ppm", "camera.hot_pixel_grey", "camera.seed"],
            cost: "a hash a pixel",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let heated = |level: f64| range.change((level - range.floor).max(0.0));
        level(view).map_or(0.0, heated)
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        if let Some(level) = level(view) {
            range.widen(level, Air::NONE);
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        let camera = &view.scene.camera;
        if let Some(level) = level(view) {
            formation.row_stages.push(Box::new(Heat {
                level,
                below: (camera.hot_pixels_ppm / 1e6 * 2f64.powi(64)) as u64,
                fixed: Fixed::new(camera.seed.into(), Purpose::HotPixels),
            }));
        }
    }
}

/// The linear value of hot pixels, if there are any.
fn level(view: &View) -> Option<f64> {
    let camera = &view.scene.camera;
    (camera.hot_pixels_ppm > 0.0).then(|| Curve::of(camera).linear(camera.hot_pixel_grey))
}

struct Heat {
    level: f64,
    below: u64,
    fixed: Fixed,
}

impl Heat {
    fn is_hot(&self, x: usize, y: usize) -> bool {
        self.fixed.at(x, y) < self.below
    }
}

impl RowStage for Heat {
    fn apply(&self, x: usize, y: usize, row: &mut [f32]) {
        for (x, value) in (x..).zip(row) {
            if self.is_hot(x, y) {
                *value = value.max(self.level as f32);
            }
        }
    }

    fn apply_exact(&self, x: usize, y: usize, row: &mut [f64]) {
        for (x, value) in (x..).zip(row) {
            if self.is_hot(x, y) {
                *value = value.max(self.level);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn about_as_many_are_hot_as_the_scene_says() {
        let settings = ["camera.hot_pixels_ppm=500", "camera.hot_pixel_grey=200"].map(String::from);
        let view = View::new(&Scene::load("day", &settings).unwrap()).unwrap();
        let mut formation = Formation::plain(1, Curve::gamma(2.2));
        HotPixels.include(&view, &mut formation);
        let hot = (0..1000).flat_map(|y| {
            let mut row = vec![0f32; 1000];
            formation.row_stages[0].apply(0, y, &mut row);
            row
        });
        let hot: Vec<f32> = hot.filter(|&value| value > 0.0).collect();
        assert!((400..600).contains(&hot.len()), "{}", hot.len());
        let grey = Curve::gamma(2.2).unrounded(hot[0].into());
        assert!((grey - 200.0).abs() < 1e-3, "{grey}");
    }
}
