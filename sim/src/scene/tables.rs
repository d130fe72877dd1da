//! The tables of a scene file, **each key in one line**: words, name, type, default, range, unit, and its comment in presets.
//!
//! A line defines the field, the check of its range and its error text, its place in presets, and its name in overrides and in Python. Each
//! [effect](crate::effects) lists the keys that it reads; a test compares the page's settings with the ranges and units here.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use link::camera::{Camera as LinkCamera, Encoding as Standard};
use link::panel::{LEDS, SIDE};
use link::waveform::Waveform;
use serde::{Deserialize, Serialize};

use super::key::{Key, Table, table};
use super::range::{RangeError, Ranged};
use super::values::{Contrast, Encoding, L2a, Leds, Mode, Psf};

/// All tables, in the order in which presets write them.
pub(crate) const TABLES: [Table; 7] = [
    Camera::TABLE,
    Panel::TABLE,
    Pose::TABLE,
    Ambient::TABLE,
    Atmosphere::TABLE,
    Link::TABLE,
    EffectSettings::TABLE,
];

/// The range of illuminance, in lx.
pub const ILLUMINANCE_LX: RangeInclusive<f64> = 0.1..=200_000.0;

/// The range of the exposure's offset, in stops.
pub(super) const EXPOSURE_BIAS_EV: RangeInclusive<f64> = -8.0..=8.0;

table! {
    /// The camera: Table 1 of Do & Yoo 2020 if not noted otherwise.
    #[serde(deny_unknown_fields, default)]
    "[camera]" Camera as camera {
        /// Focal length of the lens.
        focal_length_mm: f64 = 25.0, in 0.5..=1000.0, unit "mm", # "18 in the paper's text";
        /// Pixel pitch; pixels are square.
        pixel_pitch_um: f64 = 6.875, in 0.5..=50.0, unit "µm", # "13.2 mm / 1920";
        /// Columns of the sensor.
        width_px: usize = 1920, in 16.0..=8192.0, unit "px";
        /// Rows of the sensor.
        height_px: usize = 1080, in 16.0..=8192.0, unit "px";
        /// Frames a second.
        frame_rate_hz: f64 = 100.0, in 1.0..=10_000.0, unit "Hz";
        /// The longest exposure: at most one frame period.
        exposure_max_s: f64 = 0.001, in 1e-6..=1.0 / camera.frame_rate_hz, unit "s";
        /// A fixed exposure: at most one frame period. The ISO still follows the meter; with iso_min = iso_max it is fixed, too.
        exposure_s: Option<f64> = None, in 1e-6..=1.0 / camera.frame_rate_hz, unit "s", such as "0.0005", # "left out: automatic";
        /// f-number of the lens.
        f_number: f64 = 2.7, in 0.7..=64.0;
        /// Lowest ISO speed the camera chooses.
        iso_min: f64 = 100.0, in 1.0..=1e6;
        /// Highest ISO speed the camera chooses.
        iso_max: f64 = 32_000.0, in camera.iso_min..=1e7, # "3200 in the paper's Table 1";
        /// Reflected-light meter constant K of ISO 2720.
        meter_constant: f64 = 12.5, in 5.0..=30.0;
        /// The curve from light to grey levels.
        encoding: Encoding = Encoding::Gamma, # "linear, srgb, rec709, shoulder";
        /// γ of the curves `gamma` and `shoulder`.
        gamma: f64 = Standard::USUAL_GAMMA, in 1.0..=4.0;
        /// The grey level of no light.
        black_grey: f64 = 0.0, in 0.0..=64.0, unit "grey levels";
        /// Standard deviation of the lens blur: the geometric mean of those along x and along y.
        blur_sigma_px: f64 = LinkCamera::USUAL_BLUR_SIGMA_PX, in 0.0..=20.0, unit "px";
        /// The shape of the blur.
        psf: Psf = Psf::Gauss, # "disc: of a radius of 2 blur_sigma_px";
        /// The blur along x over that along y.
        blur_aspect: f64 = 1.0, in 0.25..=4.0, # "along x over along y";
        /// The offset of the exposure from the meter's.
        exposure_bias_ev: f64 = 0.0, in EXPOSURE_BIAS_EV, unit "EV";
        /// The amplitude of an automatic exposure that hunts: during a film the offset swings by this to both sides, as a sine.
        exposure_swing_ev: f64 = 0.0, in 0.0..=4.0, unit "EV", # "an exposure that hunts during a film; 0: steady";
        /// The period of that swing.
        exposure_swing_s: f64 = 2.0, in 0.02..=100.0, unit "s", # "its period";
        /// Whether the lens darkens towards the corners (cos⁴).
        vignetting: bool = false;
        /// Electrons of a pixel at grey 255 and ISO 100.
        full_well_e: f64 = 20_000.0, in 100.0..=1e7, unit "electrons", # "electrons at grey 255, ISO 100";
        /// Read noise.
        read_noise_e: f64 = LinkCamera::USUAL_READ_NOISE_E, in 0.0..=1000.0, unit "electrons";
        /// Time from the first row's exposure to the last's; 0 is a global shutter. At most one frame period.
        readout_s: f64 = 0.0, in 0.0..=1.0 / camera.frame_rate_hz, unit "s", # "0: global shutter";
        /// The part of a lamp's light that the lens scatters over the whole image.
        glare_percent: f64 = 2.0, in 0.0..=20.0, unit "%", # "veiling glare of ambient.lamp_lx";
        /// The mean angle by which it is scattered.
        glare_deg: f64 = 10.0, in 0.1..=60.0, unit "°", # "mean angle of that glare";
        /// Reflectance of each coated surface of the lens: a ghost has its square of a lamp's light.
        coating_percent: f64 = 1.0, in 0.0..=10.0, unit "%", # "reflectance of a lens surface: ghosts of the lamp";
        /// Radial distortion: a point at radius ρ (in units of the focal length) is imaged at ρ·(1 + k₁·ρ²).
        distortion_k1: f64 = 0.0, in -0.5..=0.5;
        /// The camera's vibration: root mean square of its pitch, and of its yaw.
        shake_deg: f64 = 0.0, in 0.0..=2.0, unit "°", # "vibration, rms of pitch and of yaw; 0: the camera stands still";
        /// Root mean square of its roll.
        shake_roll_deg: f64 = 0.0, in 0.0..=2.0, unit "°", # "rms of roll";
        /// The lowest frequency of the vibration.
        shake_lowest_hz: f64 = 1.0, in 0.01..=1000.0, unit "Hz", # "band of the vibration";
        /// The highest frequency of the vibration.
        shake_highest_hz: f64 = 15.0, in camera.shake_lowest_hz..=1000.0, unit "Hz";
        /// Whether frames are raw mosaics: red and green pixels by turns in even rows, green and blue ones in odd rows.
        mosaic: bool = false, # "true: raw frames of red, green, green and blue pixels";
        /// Standard deviation of the pixels' gain (PRNU).
        prnu_percent: f64 = 0.0, in 0.0..=20.0, unit "%";
        /// Standard deviation of the pixels' dark offset (DSNU).
        dsnu_e: f64 = 0.0, in 0.0..=1000.0, unit "electrons";
        /// Hot pixels per million.
        hot_pixels_ppm: f64 = 0.0, in 0.0..=10_000.0, unit "ppm";
        /// The least grey level of a hot pixel.
        hot_pixel_grey: f64 = 255.0, in 0.0..=255.0, unit "grey levels";
        /// The specimen of the camera: its fixed pattern and its hot pixels.
        seed: u32 = 0, # "of the fixed pattern and the hot pixels";
        /// Amount of the camera's unsharp mask.
        sharpening: f64 = 0.0, in 0.0..=5.0, # "amount of an unsharp mask";
        /// Standard deviation of that mask's mean.
        sharpening_radius_px: f64 = 1.0, in 0.3..=10.0, unit "px";
        /// The JPEG quality of each frame; none: no loss.
        jpeg_quality: Option<u8> = None, in 1.0..=100.0, such as "75", # "left out: no loss";
    }
}

table! {
    /// One 8×8 LED panel.
    #[serde(deny_unknown_fields, default)]
    "[[panel]]" # "one or more" Panel as panel {
        /// Diameter of a round LED.
        led_diameter_m: f64 = 0.03, in 0.001..=1.0, unit "m";
        /// Gap between neighbouring LEDs over their diameter.
        interval: f64 = 1.0, in 0.05..=10.0, unit "× LED", # "gap / diameter";
        /// Reflectance of the LED's surface.
        reflectance: f64 = 0.4, in 0.01..=1.0, unit "part";
        /// The least luminance of an On LED; none: no limit.
        luminance_min_cd_m2: Option<f64> = None, in 0.0..=1e7, unit "cd/m²", such as "50", # "left out: unlimited";
        /// The greatest luminance of an On LED; none: no limit.
        luminance_max_cd_m2: Option<f64> = None, in panel.luminance_min_cd_m2.unwrap_or(0.0).max(1e-3)..=1e7, unit "cd/m²", such as "8000";
        /// Relative standard deviation of the luminance between LEDs.
        led_spread: f64 = 0.0, in 0.0..=0.5;
        /// The parts of the LEDs' own light that red, green and blue pixels of a mosaic receive.
        colour: [f64; 3] = [1.0; 3], in 0.0..=1.0, unit "part",
            # "what such pixels see of the LEDs' own light; red: [1, 0.15, 0.05]";
        /// LEDs that never light: a number, or a list.
        dead_leds: Leds = Leds::Count(0), in 0.0..=LEDS as f64, # "how many, or which: [3, 17] with 8*row + column";
        /// LEDs that always light: a number, or a list.
        stuck_leds: Leds = Leds::Count(0), in 0.0..=LEDS as f64;
        /// The row of dimmer LEDs, counted from the top row, 0; none: no such row.
        dim_row: Option<u8> = None, in 0.0..=(SIDE - 1) as f64, such as "2", # "left out: none";
        /// The relative luminance of LEDs in the dim row.
        dim_row_light: f64 = 0.5, in 0.0..=1.0, unit "part";
        /// The specimen of the panel: the brightness of its LEDs, and its broken ones.
        seed: u32 = 0, # "of the spread and of which LEDs are broken";
        /// Frequency of the dimming PWM; 0 is ideal dimming.
        pwm_hz: f64 = 0.0, in 0.0..=1e7, unit "Hz", # "0: ideal dimming";
        /// Rows shown one after another; 0 is a static drive.
        scan_rows: u32 = 0, in 0.0..=SIDE as f64, # "0: static drive";
        /// Reflectance of an opaque board of 8 × 8 pitches behind the LEDs; none: no board.
        board_reflectance: Option<f64> = None, in 0.0..=1.0, unit "part", such as "0.05", # "left out: no board";
    }
    with {
        /// This panel's own pose; none: the scene's.
        #[serde(skip_serializing_if = "Option::is_none")]
        pose: Option<Pose> = None;
    }
}

table! {
    /// The position and orientation of a panel. Camera axes: x right, y down, z forward.
    #[serde(deny_unknown_fields, default)]
    "[pose]" Pose as pose {
        /// Depth of the panel's centre.
        distance_m: f64 = 50.0, in 0.5..=2000.0, unit "m";
        /// The panel's centre to the right of the optical axis.
        x_m: f64 = 0.0, in -2000.0..=2000.0, unit "m", # "right";
        /// The panel's centre below the optical axis.
        y_m: f64 = 0.0, in -2000.0..=2000.0, unit "m", # "down";
        /// Rotation about the optical axis.
        roll_deg: f64 = 0.0, in -180.0..=180.0, unit "°";
        /// Rotation about the vertical.
        yaw_deg: f64 = 0.0, in -80.0..=80.0, unit "°";
        /// Rotation about the horizontal.
        pitch_deg: f64 = 0.0, in -80.0..=80.0, unit "°";
        /// Velocity of the panel relative to the camera, each component.
        velocity_m_s: [f64; 3] = [0.0; 3], in -200.0..=200.0, unit "m/s";
    }
}

table! {
    /// The ambient light and the background.
    #[serde(deny_unknown_fields, default)]
    "[ambient]" Ambient as ambient {
        /// Illuminance on the panel and on the background that the light meter sees.
        illuminance_lx: f64 = 10_000.0, in ILLUMINANCE_LX, unit "lx";
        /// Mean reflectance of the background.
        background_reflectance: f64 = 0.18, in 0.01..=1.0, unit "part";
        /// A grey photograph behind the panel (PNG, JPEG or PGM); none: a plain background.
        background_image: Option<String> = None, such as "\"road.png\"";
        /// The sun, or a head lamp: illuminance that it alone causes at the lens, on a plane that faces it; 0 is no lamp.
        lamp_lx: f64 = 0.0, in 0.0..=*ILLUMINANCE_LX.end(), unit "lx", # "a low sun 30000, a high beam at 50 m 30; 0: none";
        /// Its direction, to the right of the optical axis.
        lamp_x_deg: f64 = 0.0, in -80.0..=80.0, unit "°", # "right";
        /// Its direction, below the optical axis.
        lamp_y_deg: f64 = 0.0, in -80.0..=80.0, unit "°", # "down";
        /// Its apparent diameter.
        lamp_diameter_deg: f64 = 0.53, in 0.001..=10.0, unit "°", # "the sun's";
    }
}

table! {
    /// The air between panel and camera.
    #[serde(deny_unknown_fields, default)]
    "[atmosphere]" Atmosphere as atmosphere {
        /// The part of the light transmitted by 70 m of air (Table 1: 0.9932).
        transmission_at_70m: f64 = 0.9932, in 1e-6..=1.0, unit "part";
        /// Whether the air scatters ambient light to the camera (Koschmieder).
        airlight: bool = false;
        /// Luminance of the horizon; none: that of a white diffuser in the ambient light, E/π.
        airlight_cd_m2: Option<f64> = None, in 0.0..=1e6, unit "cd/m²", such as "3000", # "left out: from the illuminance";
    }
}

table! {
    /// Brightness, symbols and clocks of the link.
    #[serde(deny_unknown_fields, default)]
    "[link]" Link as link {
        /// The LED-to-ambient ratio.
        l2a: L2a = L2a::Ratio(2.0), in 0.01..=10.0, unit "1/sr", # "or \"table\", with table = \"FILE\"";
        /// The table's file, for `l2a = "table"`.
        #[serde(skip_serializing_if = "Option::is_none")]
        table: Option<String> = None;
        /// The reading of the paper's contrast.
        contrast: Contrast = Contrast::Exposure, # "1 + pi*r; \"eq10\": 1 + r";
        /// Panels a second.
        symbol_rate_hz: f64 = 100.0, in 0.1..=10_000.0, unit "Hz";
        /// The phase within a symbol at which the first exposure starts.
        phase: f64 = 0.5, in 0.0..=1.0;
        /// The relative excess of the transmitter's clock over the camera's.
        clock_ppm: f64 = 0.0, in -10_000.0..=10_000.0, unit "ppm";
        /// Cycles of the carrier a symbol: see [`link::waveform`]; none, or 0: still panels.
        carrier_cycles: Option<u16> = None, in 0.0..=Waveform::MAX_CYCLES.into(), unit "cycles", such as "16",
            # "left out: panels stand still";
        /// Whether the transmitter sends its panel's size: see [`link::geometry`].
        tells_size: bool = false, # "true: the panel says how large it is";
    }
}

table! {
    /// The simulated effects: a tolerance, and a mode for each effect that does not follow it.
    #[serde(default)]
    "[effects]" EffectSettings as effects {
        /// An effect is left out if that changes no pixel by more than this, before rounding.
        tolerance_grey: f64 = 0.5, in 0.0..=255.0, unit "grey levels", # "for each effect: NAME = \"auto\", \"on\" or \"off\"";
    }
    with {
        /// `auto`, `on` or `off` by the effect's name; `auto` if not given.
        #[serde(flatten)]
        modes: BTreeMap<String, Mode> = BTreeMap::new();
    }
}
