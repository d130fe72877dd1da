//! The air between camera and panel: its attenuation, and the light that it adds.
//!
//! Air of the extinction β transmits the part τ = exp(−β·d) of the light (Beer–Lambert). If the scene has airlight, the air adds the veil
//! (1 − τ)·L of the horizon's luminance L (Koschmieder 1924).
//!
//! The background is as far away as the farthest panel, so that no panel is seen through more air than the background behind it, and an LED
//! as bright as the background is invisible at any distance. The light meter sees the background as the camera does: attenuated and veiled.
//! Without airlight the meter ignores the air: then `ambient.background_reflectance` is the reflectance as seen at the camera, for which Do
//! & Yoo 2020 expose at all distances.

use crate::scene::Scene;

/// The effect of air on light: `transmission`·light + `veil`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// The transmitted part of the light.
    pub transmission: f64,
    /// The light that the air adds, in the unit of the light.
    pub veil: f64,
}

impl Air {
    /// No air.
    pub const NONE: Self = Self {
        transmission: 1.0,
        veil: 0.0,
    };

    /// The air over `distance_m` of the scene, its veil in cd/m².
    pub fn over(scene: &Scene, distance_m: f64) -> Self {
        let air = &scene.atmosphere;
        let transmission = air.transmission_at_70m.powf(distance_m / 70.0);
        let veil = if air.airlight {
            (1.0 - transmission) * horizon_cd_m2(scene)
        } else {
            0.0
        };
        Self { transmission, veil }
    }

    /// The air before the background, its veil in cd/m².
    pub(crate) fn before_background(scene: &Scene) -> Self {
        if !scene.atmosphere.airlight {
            return Self::NONE;
        }
        let distances = (0..scene.panels.len()).map(|index| scene.pose_of(index).distance_m);
        Self::over(scene, distances.fold(0.0, f64::max))
    }

    /// The light at the camera.
    ///
    /// ```
    /// use sim::{air::Air, scene::Scene};
    /// let fog = Scene::load("fog", &[])?;
    /// let air = Air::over(&fog, 160.0);
    /// // A twentieth of the contrast is left at the visibility.
    /// assert!((air.through(100.0) - air.through(0.0) - 5.0).abs() < 0.1);
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn through(self, light: f64) -> f64 {
        self.transmission * light + self.veil
    }
}

/// The luminance of the horizon: the scene's, or that of a white diffuser in the ambient light.
fn horizon_cd_m2(scene: &Scene) -> f64 {
    scene
        .atmosphere
        .airlight_cd_m2
        .unwrap_or(scene.ambient.illuminance_lx / std::f64::consts::PI)
}
