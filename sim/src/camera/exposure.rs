//! The camera's exposure and its linear values, by ISO 2720 and ISO 12232.
//!
//! Linear values are in units of the luminous exposure of grey 118: x = H·S/10, so that grey = 118·x^(1/γ) (Do & Yoo 2020, Eq. 11). At the
//! metered exposure, the background is at 1.

use std::f64::consts::PI;

use link::exposure::AutoExposure;

use crate::air::Air;
use crate::scene::{Panel, Scene};

/// The result of the automatic exposure: the longest exposure and the ISO that puts the background at grey 118, times the bias; the
/// exposure shortens only at the minimum ISO. If the scene fixes the exposure, the ISO alone follows the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure time in seconds.
    pub time_s: f64,
    /// ISO speed, not rounded to stops.
    pub iso: f64,
    /// Linear value of 1 cd/m².
    per_cd_m2: f64,
    /// Linear value of the plain background as it arrives through the air.
    pub background: f64,
}

/// Linear values of an Off and an On LED at the camera, without air or blur between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LedLight {
    /// Ambient light reflected by the LED.
    pub off: f64,
    /// Reflected ambient light plus the LED's own light.
    pub on: f64,
}

impl Exposure {
    /// The exposure of the scene's camera in the scene's light.
    ///
    /// ```
    /// use sim::{camera::exposure::Exposure, scene::Scene};
    /// let night = Scene::load("paper", &["ambient.illuminance_lx=50".into()])?;
    /// let exposure = Exposure::of(&night);
    /// assert!((exposure.background - 1.0).abs() < 1e-9);
    /// assert!((exposure.iso - 31_809.0).abs() < 1.0);
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn of(scene: &Scene) -> Self {
        let camera = &scene.camera;
        let luminance = Air::before_background(scene).through(background_cd_m2(scene));
        // H·S/10 of 1 cd/m², by H = 10·L·t/(K·N²), for t = 1 s and S = 1.
        let per_second_iso = 1.0 / (camera.meter_constant * camera.f_number.powi(2));
        let wanted = 2f64.powf(camera.exposure_bias_ev) / (luminance * per_second_iso);
        let automatic = AutoExposure {
            longest_s: camera.exposure_max_s,
            iso_min: camera.iso_min,
            iso_max: camera.iso_max,
        };
        let (time_s, iso) = match camera.exposure_s {
            Some(time_s) => (time_s, (wanted / time_s).clamp(camera.iso_min, camera.iso_max)),
            None => automatic.time_and_iso(wanted),
        };
        let per_cd_m2 = time_s * iso * per_second_iso;
        Self {
            time_s,
            iso,
            per_cd_m2,
            background: luminance * per_cd_m2,
        }
    }

    /// The same air with its veil converted from cd/m² to a linear value.
    pub(crate) fn linear_air(&self, air: Air) -> Air {
        Air {
            veil: self.linear(air.veil),
            ..air
        }
    }

    /// Linear value of a surface of `luminance_cd_m2`.
    pub fn linear(&self, luminance_cd_m2: f64) -> f64 {
        luminance_cd_m2 * self.per_cd_m2
    }

    /// Linear value of a diffuse surface of that `reflectance` in the scene's ambient light.
    pub fn reflected(&self, scene: &Scene, reflectance: f64) -> f64 {
        self.linear(scene.ambient.illuminance_lx * reflectance / PI)
    }

    /// The LEDs of `panel` with the surface `reflectance`, driven to the ratio `l2a` within the panel's luminance limits. LEDs without
    /// reflectance have no such ratio, and are dark.
    pub fn led_light(&self, scene: &Scene, panel: &Panel, reflectance: f64, l2a: f64) -> LedLight {
        let reflected = scene.ambient.illuminance_lx * reflectance;
        let wanted = l2a * reflected;
        let floor = panel.luminance_min_cd_m2.unwrap_or(0.0);
        let top = panel.luminance_max_cd_m2.unwrap_or(f64::INFINITY);
        let l2a = match reflected {
            0.0 => 0.0,
            reflected => wanted.min(top).max(floor) / reflected,
        };
        let off = self.linear(reflected / PI);
        LedLight {
            off,
            on: off * scene.link.contrast.on_over_off(l2a),
        }
    }
}

/// Luminance of the plain background, without the air before it.
pub(crate) fn background_cd_m2(scene: &Scene) -> f64 {
    scene.ambient.illuminance_lx * scene.ambient.background_reflectance / PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exposure(overrides: &[&str]) -> Exposure {
        let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        Exposure::of(&Scene::load("paper", &overrides).unwrap())
    }

    #[test]
    fn iso_gives_way_before_time_does() {
        let noon = exposure(&["ambient.illuminance_lx=100000"]);
        assert_eq!(noon.iso, 100.0);
        assert!((1.0 / noon.time_s - 6_287.3).abs() < 1.0, "{}", 1.0 / noon.time_s);
        assert!((noon.background - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_background_darkens_where_the_iso_ends() {
        let night = exposure(&["ambient.illuminance_lx=50", "camera.iso_max=3200"]);
        let grey = 118.0 * night.background.powf(1.0 / 2.2);
        assert!((grey - 41.6).abs() < 0.2, "{grey}");
    }

    #[test]
    fn bias_shifts_the_background_by_stops() {
        assert!((exposure(&["camera.exposure_bias_ev=-1"]).background - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_fixed_exposure_stays_and_the_iso_follows_the_light_as_far_as_it_goes() {
        let at = |lx: &str| exposure(&["camera.exposure_s=0.0005", &format!("ambient.illuminance_lx={lx}")]);
        let [dusk, noon] = ["10000", "100000"].map(at);
        assert_eq!([dusk.time_s, noon.time_s], [0.0005; 2]);
        assert!((dusk.background - 1.0).abs() < 1e-12 && dusk.iso > 100.0);
        // 1/6287 s would suffice.
        assert!((noon.background - 6_287.3 / 2000.0).abs() < 1e-3 && noon.iso == 100.0);
        let scene = Scene::load("paper", &["camera.exposure_s=0.02".into()]);
        assert!(scene.is_err_and(|fault| fault.to_string().contains("camera.exposure_s")));
    }

    #[test]
    fn luminance_limits_clip_the_ratio() {
        let scene = Scene::load("paper", &["panel.luminance_max_cd_m2=8000".into()]).unwrap();
        let light = Exposure::of(&scene).led_light(&scene, &scene.panels[0], 0.4, 4.0);
        assert!((light.on / light.off - (1.0 + PI * 2.0)).abs() < 1e-12);
    }
}
