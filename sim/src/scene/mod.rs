//! The user's description of a road: camera, panels, pose, light, air, link and the effects to simulate.
//!
//! A scene comes from a TOML text or a preset, with overrides of single keys, and is checked before any use: see [`Scene::load`]. `tables`
//! lists its keys, each in one line. Every key carries its unit in its name; angles are in degrees here only.

mod error;
mod key;
mod overrides;
mod presets;
mod range;
mod tables;
mod validate;
mod values;

use std::f64::consts::TAU;

use link::waveform::Waveform;
use serde::{Deserialize, Serialize};

pub use error::SceneError;
pub use key::Key;
pub(crate) use overrides::overrule;
pub use overrides::parse_value;
pub use presets::{PRESETS, Preset, preset_toml};
pub use range::RangeError;
use tables::EXPOSURE_BIAS_EV;
pub(crate) use tables::TABLES;
pub use tables::{Ambient, Atmosphere, Camera, EffectSettings, ILLUMINANCE_LX, Link, Panel, Pose};
pub use values::{Contrast, Encoding, L2a, Leds, Mode, Psf, TableWord};

/// A whole scene. See the fields for its tables.
///
/// ```
/// use sim::scene::Scene;
/// let scene = Scene::load("paper", &["pose.distance_m=70".into()])?;
/// assert_eq!(scene.pose.distance_m, 70.0);
/// assert!(Scene::load("paper", &["pose.distance_m=0".into()]).is_err());
/// # Ok::<(), sim::scene::SceneError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// The camera and its exposure control.
    pub camera: Camera,
    /// The panels in view, one or more; the first one transmits.
    #[serde(rename = "panel")]
    pub panels: Vec<Panel>,
    /// The pose of all panels without their own.
    pub pose: Pose,
    /// The light and the background.
    pub ambient: Ambient,
    /// The air between.
    pub atmosphere: Atmosphere,
    /// Brightness, symbols and clocks.
    pub link: Link,
    /// The simulated effects.
    pub effects: EffectSettings,
}

impl Scene {
    /// The pose of panel `index`: its own, or the scene's.
    pub fn pose_of(&self, index: usize) -> &Pose {
        self.panels.get(index).and_then(|panel| panel.pose.as_ref()).unwrap_or(&self.pose)
    }

    /// As [`Self::pose_of`], mutable.
    pub fn pose_of_mut(&mut self, index: usize) -> &mut Pose {
        let own = self.panels.get_mut(index);
        own.and_then(|panel| panel.pose.as_mut()).unwrap_or(&mut self.pose)
    }

    /// The scene at frame `frame` of a film, with panels moved by their velocities and the exposure's offset by its swing. `None` if all
    /// frames of the film have the same scene.
    ///
    /// ```
    /// use sim::scene::Scene;
    /// let hunting = Scene::load("day", &["camera.exposure_swing_ev=1".into(), "camera.exposure_swing_s=0.04".into()])?;
    /// let offset = |frame| hunting.at_frame(frame).map(|scene| scene.camera.exposure_bias_ev.round());
    /// assert_eq!([0, 1, 2, 3].map(offset), [0.0, 1.0, 0.0, -1.0].map(Some));
    /// assert_eq!(Scene::load("day", &[])?.at_frame(1), None);
    /// # Ok::<(), sim::scene::SceneError>(())
    /// ```
    pub fn at_frame(&self, frame: u64) -> Option<Self> {
        let mut panels = 0..self.panels.len();
        let is_still = panels.all(|index| self.pose_of(index).velocity_m_s == [0.0; 3]);
        if is_still && self.camera.exposure_swing_ev == 0.0 {
            return None;
        }
        let after_s = frame as f64 / self.camera.frame_rate_hz;
        let mut scene = self.clone();
        scene.camera.exposure_bias_ev = self.camera.exposure_bias_ev_after(after_s);
        scene.pose = scene.pose.after(after_s);
        for panel in &mut scene.panels {
            panel.pose = panel.pose.as_ref().map(|pose| pose.after(after_s));
        }
        Some(scene)
    }

    /// The lens's distortion k₁: 0 if the scene leaves that effect out.
    pub fn distortion_k1(&self) -> f64 {
        match self.effects.mode("distortion") {
            Mode::Off => 0.0,
            Mode::Auto | Mode::On => self.camera.distortion_k1,
        }
    }
}

impl Camera {
    /// The focal length in pixels.
    pub fn focal_px(&self) -> f64 {
        self.focal_length_mm * 1e3 / self.pixel_pitch_um
    }

    /// The exposure's offset after `after_s` seconds of its swing, in stops, within its range.
    fn exposure_bias_ev_after(&self, after_s: f64) -> f64 {
        let swing = self.exposure_swing_ev * (TAU * after_s / self.exposure_swing_s).sin();
        (self.exposure_bias_ev + swing).clamp(*EXPOSURE_BIAS_EV.start(), *EXPOSURE_BIAS_EV.end())
    }

    /// Standard deviations of the blur along x and along y, in pixels.
    pub(crate) fn blur_sigmas_px(&self) -> [f64; 2] {
        let root = self.blur_aspect.sqrt();
        [self.blur_sigma_px * root, self.blur_sigma_px / root]
    }

    /// The principal point: the centre of the sensor, in pixels.
    pub fn principal_px(&self) -> [f64; 2] {
        [(self.width_px as f64 - 1.0) / 2.0, (self.height_px as f64 - 1.0) / 2.0]
    }
}

impl Panel {
    /// Centre-to-centre distance of neighbouring LEDs: (1 + interval)·diameter, in metres.
    pub fn pitch_m(&self) -> f64 {
        (1.0 + self.interval) * self.led_diameter_m
    }
}

impl Pose {
    /// The pose after `after_s` seconds of its velocity.
    pub fn after(&self, after_s: f64) -> Self {
        let [x, y, z] = self.velocity_m_s.map(|v| v * after_s);
        Self {
            x_m: self.x_m + x,
            y_m: self.y_m + y,
            distance_m: self.distance_m + z,
            ..self.clone()
        }
    }
}

impl Link {
    /// The symbols of one exposure: the one at its start and those after it.
    pub const WINDOW: usize = 4;

    /// The waveform of symbols.
    ///
    /// # Errors
    /// If no transmitter can show that carrier at this symbol rate.
    pub fn waveform(&self) -> Result<Waveform, RangeError> {
        let cycles = self.carrier_cycles.unwrap_or(0);
        let waveform = Waveform::new(cycles.into()).and_then(|waveform| waveform.carrier_hz(self.symbol_rate_hz).map(|_| waveform));
        let [fewest, slowest_hz, fastest_hz] = [Waveform::MIN_CYCLES.into(), Waveform::MIN_HZ, Waveform::MAX_HZ];
        waveform.map_err(|_| RangeError {
            key: "link.carrier_cycles".into(),
            value: cycles.to_string(),
            allowed: format!("0, or at least {fewest} and a carrier of {slowest_hz} to {fastest_hz} Hz"),
            way_out: format!(
                "at {} symbols a second it is one of {} Hz",
                self.symbol_rate_hz,
                f64::from(cycles) * self.symbol_rate_hz
            ),
        })
    }
}

impl EffectSettings {
    /// The scene's setting of the effect `name`.
    pub fn mode(&self, name: &str) -> Mode {
        self.modes.get(name).copied().unwrap_or_default()
    }
}
