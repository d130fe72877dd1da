//! Attenuation by the air between panel and camera. The background is metered as it arrives, so the panel alone is dimmed.

use super::Effect;
use crate::recipe::Recipe;
use crate::view::View;

/// See the [module](self).
pub struct Attenuation;

impl Effect for Attenuation {
    fn name(&self) -> &'static str {
        "atmosphere"
    }

    fn model(&self) -> &'static str {
        "Beer-Lambert attenuation exp(-beta d) of the light from the panel, with exp(-beta 70 m) given"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["atmosphere.transmission_at_70m", "pose.distance_m"]
    }

    fn cost(&self) -> &'static str {
        "none"
    }

    fn bound_grey(&self, view: &View) -> f64 {
        let thickest = view
            .panels
            .iter()
            .map(|panel| transmission(&view.scene, panel.pose.distance_m))
            .fold(1.0, f64::min);
        view.change_by_factor(thickest)
    }

    fn include(&self, view: &View, recipe: &mut Recipe) {
        for (air, panel) in recipe.air.iter_mut().zip(&view.panels) {
            air.transmission = transmission(&view.scene, panel.pose.distance_m);
        }
    }
}

/// The part of the light that passes `distance_m` of the scene's air.
pub fn transmission(scene: &crate::scene::Scene, distance_m: f64) -> f64 {
    scene.atmosphere.transmission_at_70m.powf(distance_m / 70.0)
}
