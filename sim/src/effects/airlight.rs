//! Light scattered into the line of sight by the air before the panel.

use super::Effect;
use crate::exposure::Exposure;
use crate::recipe::Recipe;
use crate::scene::Scene;
use crate::view::View;

/// See the [module](self).
pub struct Airlight;

impl Effect for Airlight {
    fn name(&self) -> &'static str {
        "airlight"
    }

    fn model(&self) -> &'static str {
        "Koschmieder 1924: the air before the panel adds (1 - exp(-beta d)) of the horizon luminance"
    }

    fn keys(&self) -> &'static [&'static str] {
        &[
            "atmosphere.airlight",
            "atmosphere.airlight_cd_m2",
            "atmosphere.transmission_at_70m",
        ]
    }

    fn cost(&self) -> &'static str {
        "none"
    }

    fn bound_grey(&self, view: &View) -> f64 {
        view.change(
            view.panels
                .iter()
                .map(|panel| veil(&view.scene, &view.exposure, panel.pose.distance_m))
                .fold(0.0, f64::max),
        )
    }

    fn include(&self, view: &View, recipe: &mut Recipe) {
        for (air, panel) in recipe.air.iter_mut().zip(&view.panels) {
            air.veil = veil(&view.scene, &view.exposure, panel.pose.distance_m);
        }
    }
}

/// The linear value that `distance_m` of air adds.
pub fn veil(scene: &Scene, exposure: &Exposure, distance_m: f64) -> f64 {
    if !scene.atmosphere.airlight {
        return 0.0;
    }
    let horizon = scene
        .atmosphere
        .airlight_cd_m2
        .unwrap_or(scene.ambient.illuminance_lx / std::f64::consts::PI);
    (1.0 - super::atmosphere::transmission(scene, distance_m)) * exposure.linear(horizon)
}
