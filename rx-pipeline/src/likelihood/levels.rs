//! The levels of a panel's image: what it depends on beside its bits.

use link::panel::LEDS;
use nalgebra::{SMatrix, SVector};

/// The standard deviation of the contrast by the phase of a carrier (share of it). Less: frames of little contrast seem to show two symbols;
/// more: the levels of a frame are found by it alone.
#[cfg(feature = "carrier")]
const CARRIER_SPREAD: f32 = 0.6;

/// The levels of a panel's image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Levels {
    /// Light of the background.
    pub background: f32,
    /// By how much an Off LED's light exceeds the background's, times its area in px².
    pub off: f32,
    /// By how much an On LED's exceeds an Off one's, times its area in px².
    pub contrast: f32,
    /// Variance of an LED's image in each direction, in px²: lens blur, LED and pixel.
    pub variance: f32,
    /// By how much the LEDs stand beside where the corners say, in px.
    pub shift: [f32; 2],
    /// Variance of a pixel's root light about the model.
    pub noise: f32,
}

impl Levels {
    /// Light above the background, times its area, of LEDs `lit` so many contrasts above Off.
    pub fn light(&self, lit: &[f32; LEDS]) -> [f32; LEDS] {
        lit.map(|lit| self.off + self.contrast * lit)
    }

    /// By how much light the middle of an On LED exceeds that of an Off one.
    pub fn peak(&self) -> f32 {
        self.contrast / (core::f32::consts::TAU * self.variance)
    }

    /// The same as a share of all light there: exposures change nothing of it.
    pub fn modulation(&self) -> f32 {
        let off = self.off.max(0.0) / (core::f32::consts::TAU * self.variance);
        let peak = self.peak();
        peak / (self.background.max(0.0) + off + peak).max(f32::MIN_POSITIVE)
    }

    /// The same of the light that is the mean of an On LED's and an Off one's, which is that of a panel of any contrast that is On for half of
    /// the time.
    #[cfg(feature = "carrier")]
    pub fn modulation_of_mean(&self) -> f32 {
        let modulation = self.modulation();
        2.0 * modulation / (2.0 - modulation)
    }

    /// By how much they differ from frame to frame by the phase of a carrier, as a covariance: what On LEDs have less, Off ones have more.
    #[cfg(feature = "carrier")]
    pub fn spread_by_carrier(&self) -> Matrix {
        let [off, contrast] = [-0.5, 1.0].map(|by| by * CARRIER_SPREAD * self.contrast);
        let along = Vector::from([0.0, off, contrast, 0.0, 0.0, 0.0]);
        along * along.transpose()
    }

    /// All but the noise.
    pub fn values(&self) -> [f32; LEVELS] {
        let [x, y] = self.shift;
        [self.background, self.off, self.contrast, self.variance, x, y]
    }

    pub fn from_values([background, off, contrast, variance, x, y]: [f32; LEVELS], noise: f32) -> Self {
        Self {
            background,
            off,
            contrast,
            variance,
            shift: [x, y],
            noise,
        }
    }
}

/// What is fitted: background, Off, contrast, variance, and a shift of the LEDs in x and y.
pub(super) const LEVELS: usize = 6;
pub(super) type Vector = SVector<f32, LEVELS>;
pub(super) type Matrix = SMatrix<f32, LEVELS, LEVELS>;
