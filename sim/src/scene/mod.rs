//! The road as a user describes it: camera, panels, pose, light, air, link and which effects to simulate.
//!
//! A scene comes from a TOML text or a preset, single keys can be overruled, and it is checked whole before anything
//! runs: see [`Scene::load`]. Every key carries its unit in its name; angles are in degrees here and nowhere inside.

mod error;
mod overrides;
mod presets;
mod validate;

use std::collections::BTreeMap;

use link::camera::{Camera as Told, Encoding as Standard};
use serde::{Deserialize, Serialize};

pub use error::SceneError;
pub(crate) use overrides::overrule;
pub use overrides::parse_value;
pub(crate) use presets::written_keys;
pub use presets::{PRESETS, Preset, preset_toml};
pub use validate::RangeError;

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
    /// The panels in view, one or more; the first is the one that sends.
    #[serde(rename = "panel")]
    pub panels: Vec<Panel>,
    /// Where the panels are, unless they say otherwise.
    pub pose: Pose,
    /// The light and what stands behind the panels.
    pub ambient: Ambient,
    /// The air between.
    pub atmosphere: Atmosphere,
    /// Brightness, symbols and clocks.
    pub link: Link,
    /// Which effects are simulated.
    pub effects: EffectSettings,
}

/// The camera: Table 1 of Do & Yoo 2020 unless said otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Focal length of the lens, 0.5 to 1000 mm.
    pub focal_length_mm: f64,
    /// Pixel pitch, 0.5 to 50 µm; pixels are square.
    pub pixel_pitch_um: f64,
    /// Columns of the sensor, 16 to 8192.
    pub width_px: usize,
    /// Rows of the sensor, 16 to 8192.
    pub height_px: usize,
    /// Frames a second, 1 to 10 000.
    pub frame_rate_hz: f64,
    /// The longest exposure, 1 µs to one frame period.
    pub exposure_max_s: f64,
    /// f-number of the lens, 0.7 to 64.
    pub f_number: f64,
    /// Lowest ISO speed the camera chooses.
    pub iso_min: f64,
    /// Highest ISO speed the camera chooses.
    pub iso_max: f64,
    /// Reflected-light meter constant K of ISO 2720, 5 to 30.
    pub meter_constant: f64,
    /// The curve that makes grey levels of light.
    pub encoding: Encoding,
    /// γ of the curves `gamma` and `shoulder`, 1 to 4.
    pub gamma: f64,
    /// The grey level of no light, 0 to 64.
    pub black_grey: f64,
    /// Standard deviation of the lens blur, 0 to 20 px: the geometric mean of that along x and that along y.
    pub blur_sigma_px: f64,
    /// The shape of the blur.
    pub psf: Psf,
    /// The blur along x over that along y, 0.25 to 4.
    pub blur_aspect: f64,
    /// How far the exposure is set from the meter's, −8 to 8 EV.
    pub exposure_bias_ev: f64,
    /// Whether the lens darkens towards the corners (cos⁴).
    pub vignetting: bool,
    /// Electrons of a pixel at grey 255 and ISO 100, 100 to 10⁷.
    pub full_well_e: f64,
    /// Read noise in electrons, 0 to 1000.
    pub read_noise_e: f64,
    /// Time from the first row's exposure to the last's; 0 is a global shutter. At most one frame period.
    pub readout_s: f64,
    /// Radial distortion: a point at radius ρ (in units of the focal length) is imaged at ρ·(1 + k₁·ρ²). −0.5 to 0.5.
    pub distortion_k1: f64,
    /// Whether frames are raw mosaics: red and green pixels by turns in even rows, green and blue ones in odd rows.
    pub mosaic: bool,
    /// How unlike pixels are in what they make of light (PRNU), the standard deviation in percent, 0 to 20.
    pub prnu_percent: f64,
    /// How unlike pixels are in what they read in the dark (DSNU), the standard deviation in electrons, 0 to 1000.
    pub dsnu_e: f64,
    /// Hot pixels among a million, 0 to 10 000.
    pub hot_pixels_ppm: f64,
    /// The grey level below which no hot pixel reads, 0 to 255.
    pub hot_pixel_grey: f64,
    /// Which camera of its kind it is: where its fixed pattern and its hot pixels are, 0 to 2³² − 1.
    pub seed: u32,
    /// Amount of the unsharp mask that the camera lays on its frames, 0 to 5.
    pub sharpening: f64,
    /// Standard deviation of that mask's mean, 0.3 to 10 px.
    pub sharpening_radius_px: f64,
    /// The quality at which each frame passes as JPEG, 1 to 100; none: no loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u8>,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            focal_length_mm: 25.0,
            pixel_pitch_um: 6.875,
            width_px: 1920,
            height_px: 1080,
            frame_rate_hz: 100.0,
            exposure_max_s: 0.001,
            f_number: 2.7,
            iso_min: 100.0,
            iso_max: 32_000.0,
            meter_constant: 12.5,
            encoding: Encoding::Gamma,
            gamma: Standard::USUAL_GAMMA,
            black_grey: 0.0,
            blur_sigma_px: Told::USUAL_BLUR_SIGMA_PX,
            psf: Psf::Gauss,
            blur_aspect: 1.0,
            exposure_bias_ev: 0.0,
            vignetting: false,
            full_well_e: 20_000.0,
            read_noise_e: Told::USUAL_READ_NOISE_E,
            readout_s: 0.0,
            distortion_k1: 0.0,
            mosaic: false,
            prnu_percent: 0.0,
            dsnu_e: 0.0,
            hot_pixels_ppm: 0.0,
            hot_pixel_grey: 255.0,
            seed: 0,
            sharpening: 0.0,
            sharpening_radius_px: 1.0,
            jpeg_quality: None,
        }
    }
}

impl Camera {
    /// The focal length in pixels.
    pub fn focal_px(&self) -> f64 {
        self.focal_length_mm * 1e3 / self.pixel_pitch_um
    }

    /// Standard deviations of the blur along x and along y, in pixels.
    pub fn blur_sigmas_px(&self) -> [f64; 2] {
        let root = self.blur_aspect.sqrt();
        [self.blur_sigma_px * root, self.blur_sigma_px / root]
    }

    /// The principal point: the centre of the sensor, in pixels.
    pub fn principal_px(&self) -> [f64; 2] {
        [(self.width_px as f64 - 1.0) / 2.0, (self.height_px as f64 - 1.0) / 2.0]
    }
}

/// The shape of a blur.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Psf {
    /// A Gaussian (Do & Yoo 2020, Eqs. 14 and 15).
    #[default]
    Gauss,
    /// A disc, as of a lens out of focus: its radius is twice the standard deviation.
    Disc,
}

/// The curve by which a camera makes grey levels of light: see [`crate::camera::curve`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Encoding {
    /// grey = 118·x^(1/γ) (Do & Yoo 2020, Eq. 11).
    #[default]
    Gamma,
    /// In proportion to light.
    Linear,
    /// IEC 61966-2-1.
    Srgb,
    /// ITU-R BT.709.
    Rec709,
    /// The gamma curve, bent from grey 150 on so that bright things clip later.
    Shoulder,
}

impl Encoding {
    /// The names by which scenes call them.
    pub const NAMES: [&'static str; 5] = ["gamma", "linear", "srgb", "rec709", "shoulder"];
}

/// One 8×8 LED panel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Panel {
    /// Diameter of a round LED, 1 mm to 1 m.
    pub led_diameter_m: f64,
    /// Gap between neighbouring LEDs over their diameter, 0.05 to 10.
    pub interval: f64,
    /// Reflectance of the LED's surface, 0.01 to 1.
    pub reflectance: f64,
    /// The least luminance an On LED can give; none: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub luminance_min_cd_m2: Option<f64>,
    /// The most luminance an On LED can give; none: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub luminance_max_cd_m2: Option<f64>,
    /// Relative standard deviation of the luminance from LED to LED, 0 to 0.5.
    pub led_spread: f64,
    /// The parts of the LEDs' own light that red, green and blue pixels of a mosaic see, each 0 to 1.
    pub colour: [f64; 3],
    /// LEDs that never light: how many, or which ones.
    pub dead_leds: Leds,
    /// LEDs that always light: how many, or which ones.
    pub stuck_leds: Leds,
    /// A row whose LEDs are dimmer, 0 (the upper) to 7; none: none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dim_row: Option<u8>,
    /// The part of their luminance that LEDs of the dim row give, 0 to 1.
    pub dim_row_light: f64,
    /// Which panel of its kind it is: how bright which LED is, and which are broken, 0 to 2³² − 1.
    pub seed: u32,
    /// Frequency of the dimming PWM, 0 (ideal dimming) to 10 MHz.
    pub pwm_hz: f64,
    /// Rows shown one after another; 0 is a static drive, else 1 to 8.
    pub scan_rows: u32,
    /// Reflectance of an opaque board of 8 × 8 pitches behind the LEDs; none: no board.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub board_reflectance: Option<f64>,
    /// This panel's own pose; none: the scene's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
}

impl Default for Panel {
    fn default() -> Self {
        Self {
            led_diameter_m: 0.03,
            interval: 1.0,
            reflectance: 0.4,
            luminance_min_cd_m2: None,
            luminance_max_cd_m2: None,
            led_spread: 0.0,
            colour: [1.0; 3],
            dead_leds: Leds::default(),
            stuck_leds: Leds::default(),
            dim_row: None,
            dim_row_light: 0.5,
            seed: 0,
            pwm_hz: 0.0,
            scan_rows: 0,
            board_reflectance: None,
            pose: None,
        }
    }
}

impl Panel {
    /// Centre-to-centre distance of neighbouring LEDs: (1 + interval)·diameter, in metres.
    pub fn pitch_m(&self) -> f64 {
        (1.0 + self.interval) * self.led_diameter_m
    }
}

/// Some of a panel's LEDs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Leds {
    /// So many that the panel's seed picks, 0 to 64.
    Count(u8),
    /// Those of these numbers, 8·row + column.
    List(Vec<u8>),
}

impl Default for Leds {
    fn default() -> Self {
        Self::Count(0)
    }
}

/// Where a panel is and how it is turned. Camera axes: x right, y down, z forward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pose {
    /// Depth of the panel's centre, 0.5 to 2000 m.
    pub distance_m: f64,
    /// The panel's centre to the right of the optical axis, in metres.
    pub x_m: f64,
    /// The panel's centre below the optical axis, in metres.
    pub y_m: f64,
    /// Turn about the optical axis, −180 to 180°.
    pub roll_deg: f64,
    /// Turn about the vertical, −80 to 80°.
    pub yaw_deg: f64,
    /// Turn about the horizontal, −80 to 80°.
    pub pitch_deg: f64,
    /// Velocity of the panel relative to the camera, each part −200 to 200 m/s.
    pub velocity_m_s: [f64; 3],
}

impl Default for Pose {
    fn default() -> Self {
        Self {
            distance_m: 50.0,
            x_m: 0.0,
            y_m: 0.0,
            roll_deg: 0.0,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            velocity_m_s: [0.0; 3],
        }
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

/// The ambient light and the background.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ambient {
    /// Illuminance on the panel and on what the light meter sees, 0.1 to 200 000 lx.
    pub illuminance_lx: f64,
    /// Mean reflectance of the background, 0.01 to 1.
    pub background_reflectance: f64,
    /// A grey photograph behind the panel (PNG, JPEG or PGM); none: a plain background.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background_image: Option<String>,
}

impl Default for Ambient {
    fn default() -> Self {
        Self {
            illuminance_lx: 10_000.0,
            background_reflectance: 0.18,
            background_image: None,
        }
    }
}

/// The air between panel and camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Atmosphere {
    /// The part of the light that passes 70 m of air, over 0, at most 1 (Table 1: 0.9932).
    pub transmission_at_70m: f64,
    /// Whether the air itself shines, lit by the ambient light (Koschmieder).
    pub airlight: bool,
    /// Luminance of the horizon; none: what the illuminance gives a white diffuser, E/π.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub airlight_cd_m2: Option<f64>,
}

impl Default for Atmosphere {
    fn default() -> Self {
        Self {
            transmission_at_70m: 0.9932,
            airlight: false,
            airlight_cd_m2: None,
        }
    }
}

/// The LED-to-ambient ratio: a number, or looked up in the transmitter's table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum L2a {
    /// The ratio L/(E·R) itself, 0.01 to 10 (the transmitter keeps to 0.2 to 4).
    Ratio(f64),
    /// `"table"`: what the table of `link.table` says, or the transmitter's own without one.
    Table(TableWord),
}

/// The word `table`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableWord {
    /// Look the ratio up.
    Table,
}

/// How much brighter an On LED is than an Off one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Contrast {
    /// 1 + π·r, as the exposures of Do & Yoo 2020, Eqs. (12) and (13), give it.
    Exposure,
    /// 1 + r, as their Eq. (10) prints it.
    Eq10,
}

impl Contrast {
    /// On luminous exposure over Off luminous exposure at the ratio `l2a`.
    ///
    /// ```
    /// use sim::scene::Contrast;
    /// assert_eq!(Contrast::Eq10.on_over_off(2.0), 3.0);
    /// assert!((Contrast::Exposure.on_over_off(2.0) - 7.2832).abs() < 1e-4);
    /// ```
    pub fn on_over_off(self, l2a: f64) -> f64 {
        match self {
            Self::Exposure => 1.0 + std::f64::consts::PI * l2a,
            Self::Eq10 => 1.0 + l2a,
        }
    }
}

/// Brightness, symbols and clocks of the link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Link {
    /// The LED-to-ambient ratio.
    pub l2a: L2a,
    /// The table's file, for `l2a = "table"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<String>,
    /// The reading of the paper's contrast.
    pub contrast: Contrast,
    /// Panels a second, 0.1 to 10 000.
    pub symbol_rate_hz: f64,
    /// Where in a symbol the first exposure begins, from 0 up to 1.
    pub phase: f64,
    /// How much faster the transmitter's clock runs than the camera's, −10 000 to 10 000 ppm.
    pub clock_ppm: f64,
    /// Whether the transmitter says how large its panel is: see [`link::geometry`].
    pub tells_size: bool,
}

impl Link {
    /// The symbols that one exposure may see: the one at its start and those after it.
    pub const WINDOW: usize = 4;
}

impl Default for Link {
    fn default() -> Self {
        Self {
            l2a: L2a::Ratio(2.0),
            table: None,
            contrast: Contrast::Exposure,
            symbol_rate_hz: 100.0,
            phase: 0.5,
            clock_ppm: 0.0,
            tells_size: false,
        }
    }
}

/// Whether an effect is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// When leaving it out could change a pixel by more than the tolerance.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// Which effects are simulated: a tolerance, and a word for each effect that shall not be left to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EffectSettings {
    /// An effect is left out when that changes no pixel by more than this, 0 to 255 grey levels before rounding.
    pub tolerance_grey: f64,
    /// `auto`, `on` or `off` by the effect's name; `auto` where nothing is said.
    #[serde(flatten)]
    pub modes: BTreeMap<String, Mode>,
}

impl Default for EffectSettings {
    fn default() -> Self {
        Self {
            tolerance_grey: 0.5,
            modes: BTreeMap::new(),
        }
    }
}

impl EffectSettings {
    /// What the scene says of the effect `name`.
    pub fn mode(&self, name: &str) -> Mode {
        self.modes.get(name).copied().unwrap_or_default()
    }
}

impl Scene {
    /// The pose of panel `index`: its own, or the scene's.
    pub fn pose_of(&self, index: usize) -> &Pose {
        self.panels.get(index).and_then(|panel| panel.pose.as_ref()).unwrap_or(&self.pose)
    }

    /// The same to be changed.
    pub fn pose_of_mut(&mut self, index: usize) -> &mut Pose {
        let own = self.panels.get_mut(index);
        own.and_then(|panel| panel.pose.as_mut()).unwrap_or(&mut self.pose)
    }

    /// The lens's distortion k₁: 0 where the scene leaves it out.
    pub fn distortion_k1(&self) -> f64 {
        match self.effects.mode("distortion") {
            Mode::Off => 0.0,
            Mode::Auto | Mode::On => self.camera.distortion_k1,
        }
    }
}
