//! A board behind the LEDs.

use super::Effect;
use super::airlight::veil;
use super::atmosphere::transmission;
use crate::exposure::Exposure;
use crate::recipe::Recipe;
use crate::scene::Scene;
use crate::view::{PanelView, View};

/// See the [module](self).
pub struct Board;

impl Effect for Board {
    fn name(&self) -> &'static str {
        "board"
    }

    fn model(&self) -> &'static str {
        "an opaque board of 8 x 8 pitches behind the LEDs, lit by the ambient light"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["panel.board_reflectance"]
    }

    fn cost(&self) -> &'static str {
        "some 100 chords, drawn once a frame"
    }

    /// Against the plain background, seen through the air or without it. A photograph can differ by the whole range.
    fn bound_grey(&self, view: &View) -> f64 {
        let difference = |panel: &PanelView| {
            let Some(reflectance) = panel.panel.board_reflectance else {
                return 0.0;
            };
            let (board, distance_m) = (
                linear(&view.scene, &view.exposure, reflectance),
                panel.pose.distance_m,
            );
            let dimmed = board * transmission(&view.scene, distance_m);
            let veiled = board + veil(&view.scene, &view.exposure, distance_m);
            if view.photograph.is_empty() {
                [dimmed, veiled]
                    .map(|seen| (seen - view.exposure.background).abs())
                    .into_iter()
                    .fold(0.0, f64::max)
            } else {
                view.peak - view.floor
            }
        };
        view.change(view.panels.iter().map(difference).fold(0.0, f64::max))
    }

    fn include(&self, _view: &View, recipe: &mut Recipe) {
        recipe.boards = true;
    }
}

/// The linear value of a board of that reflectance.
pub fn linear(scene: &Scene, exposure: &Exposure, reflectance: f64) -> f64 {
    exposure.linear(scene.ambient.illuminance_lx * reflectance / std::f64::consts::PI)
}
