//! Levels of accuracy, and the parameter that bounds each error.
//!
//! | level | numbers | declared bound | for |
//! |---|---|---|---|
//! | `reference` | f64, error function | 1e-9 of an LED's light, linear | tests, other levels |
//! | `fine` | f32, table | 0.01 unrounded grey levels from the reference | figures, pictures |
//! | `fast` | f32, table | 0.25 unrounded grey levels from the reference: half of the rounding error | Monte Carlo |
//!
//! The test of `reference` uses values of thirty digits: `cargo test -p vocc-tests --test numerics disc_integral`. The test of the others
//! uses the reference: `cargo test -p vocc-tests --test levels`.
//!
//! [`Accuracy`] holds the parameters that keep a level's bound in one scene. A renderer can also be made with your own parameters
//! ([`crate::renderer::Renderer::with_accuracy`]). The errors and their bounds:
//!
//! | error | parameter | reason |
//! |---|---|---|
//! | a disc as a few chords | [`Accuracy::quadrature`] | chords at Chebyshev's nodes converge faster than any power of their number: 4 suffice for `fast` at 50 m |
//! | light beyond the drawn margin | [`Accuracy::truncation`] | the blur falls off as a Gaussian, so a tenth of the error costs half a pixel |
//! | values between tabulated phases | [`Accuracy::phases`] | linear, one vector operation; the table grows with the inverse root of the error |
//! | rounding of f32 | none: [`Level::Reference`] draws in f64 | about 1e-7 of a pixel's value |
//! | the encoding curve | none: [`crate::camera::encoder::CURVE_ERROR_GREY`] | a polynomial of vectors, or a table, closer than either level needs |
//!
//! The parameters of [`Accuracy`] apply if a blur spreads each LED over its neighbourhood: LEDs are then drawn by a few
//! [`Chords`](crate::disc::chords::Chords). Without a blur, or under one so small that no affordable number of chords keeps the bound, all
//! levels draw pixel by pixel from the [`Outline`](crate::disc::outline::Outline) itself. Without a blur, the outline is a closed form on
//! the few pixels that an LED covers: 8 × 8 samples a pixel would err by more than a hundredth of an LED's light (see the test above),
//! while 0.25 grey levels allow 3e-4 of it at an L2A of 2. Only the error of f32 remains.

use std::str::FromStr;

use libm::erfc;

use crate::camera::curve::Curve;
use crate::disc::kernel::CURVATURE;
use crate::disc::outline::Blur;

/// A compromise between accuracy and time; see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Double precision and the error function itself.
    Reference,
    /// Within 0.01 grey levels of the reference.
    Fine,
    /// Within 0.25 grey levels of the reference.
    #[default]
    Fast,
}

impl Level {
    /// The declared bound of the difference from the reference, in grey levels before rounding.
    pub fn error_bound_grey(self) -> f64 {
        match self {
            Self::Reference => 0.0,
            Self::Fine => 0.01,
            Self::Fast => 0.25,
        }
    }
}

impl FromStr for Level {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "reference" => Ok(Self::Reference),
            "fine" => Ok(Self::Fine),
            "fast" => Ok(Self::Fast),
            _ => Err(format!("no level {text:?}: choose reference, fine or fast")),
        }
    }
}

/// The tolerance of each error at [`Level::Reference`], as a part of an LED's light: with rounding, errors stay far below 1e-9.
pub const REFERENCE: f64 = 1e-13;
/// The relative step of f32, rounded up.
const F32_STEP: f64 = 1e-7;

/// The parameters of a level, for one scene; they do not change during rendering. Each bounds one error, as a part of an LED's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Largest error of the integral over a disc; sets the number of chords.
    pub quadrature: f64,
    /// Maximum light cut off from a plane full of LEDs; it sets the reach of the blur.
    pub truncation: f64,
    /// Table entries a pixel, 0 for none; bounds the interpolation (of whole LEDs, and see [`crate::disc::kernel::KernelTables`]).
    pub phases: usize,
}

impl Accuracy {
    /// The parameters that keep `level`'s bound if pixels are at least as bright as `floor` and LEDs exceed it by at most `excess` (both
    /// linear), under a blur of `sigma_px`, encoded by `curve`.
    ///
    /// The bound is divided into four equal parts: quadrature, truncation, table, and f32 with all else. No part has to be finer than f32,
    /// so the bound holds for scenes whose floor is at least a thousandth of their brightest LED.
    pub fn new(level: Level, floor: f64, excess: f64, sigma_px: f64, curve: &Curve) -> Self {
        match level {
            Level::Reference => Self::even(REFERENCE),
            Level::Fine | Level::Fast => Self::within(level.error_bound_grey(), floor, excess, sigma_px, curve),
        }
    }

    /// Equal tolerances and no table: for drawing in f64.
    pub fn even(tolerance: f64) -> Self {
        Self {
            quadrature: tolerance,
            truncation: tolerance,
            phases: 0,
        }
    }

    /// As [`Self::new`], for any bound, in grey levels before rounding.
    pub fn within(bound_grey: f64, floor: f64, excess: f64, sigma_px: f64, curve: &Curve) -> Self {
        let share = bound_grey / 4.0;
        // The curve is steepest at the floor: a change of light that moves the grey by its share there moves it by less elsewhere.
        let allowed = curve.linear(curve.unrounded(floor) + share) - floor;
        let part = (allowed / excess.max(1e-3)).clamp(F32_STEP, 1e-2);
        // The table errs by CURVATURE/(8·σ²·n²), in each of up to about eight overlapping terms.
        let per_px = (CURVATURE / (sigma_px.max(0.1).powi(2) * part)).sqrt();
        Self {
            quadrature: part,
            truncation: part,
            phases: (per_px as usize).next_power_of_two().clamp(16, 4096),
        }
    }

    /// A blur of `sigma_px` for drawing pixel by pixel. Beyond its reach lies at most `truncation` of the blurred light of a plane full of
    /// LEDs, 2·erfc(z/√2) for a reach of z·σ.
    pub fn blur(&self, sigma_px: f64) -> Blur {
        let mut z = 0.0;
        while 2.0 * erfc(z * std::f64::consts::FRAC_1_SQRT_2) > self.truncation {
            z += 0.1;
        }
        Blur::within(sigma_px, z * sigma_px, self.quadrature)
    }

    /// The drawn margin beyond a disc's edge: the blur's reach, and half a pixel for the pixel's own square.
    pub(crate) fn margin_px(&self, sigma_px: f64) -> f64 {
        self.blur(sigma_px).margin_px()
    }
}
