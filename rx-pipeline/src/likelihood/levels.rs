//! The levels of a panel's image: its parameters besides the bits.

use link::panel::LEDS;
use nalgebra::{SMatrix, SVector};

/// The standard deviation of the contrast by the phase of a carrier (share of it). Less: frames of little contrast seem to show two
/// symbols; more: the levels of a frame depend on that frame alone.
#[cfg(feature = "carrier")]
const CARRIER_SPREAD: f32 = 0.6;

/// The levels of a panel's image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Levels {
    /// Light of the background.
    pub background: f32,
    /// An Off LED's light above the background's, times its area in px².
    pub off: f32,
    /// An On LED's light above an Off one's, times its area in px².
    pub contrast: f32,
    /// Variance of an LED's image in each direction, in px²: lens blur, LED and pixel.
    pub variance: f32,
    /// The offset of the LEDs from the positions by the corners, in px.
    pub shift: [f32; 2],
    /// Variance of a pixel's root light about the model.
    pub noise: f32,
}

impl Levels {
    /// The light of LEDs `lit` contrasts above Off: above the background, times the area.
    pub fn light(&self, lit: &[f32; LEDS]) -> [f32; LEDS] {
        lit.map(|lit| self.off + self.contrast * lit)
    }

    /// The light in the middle of an On LED above that of an Off one.
    pub fn peak(&self) -> f32 {
        self.contrast / (core::f32::consts::TAU * self.variance)
    }

    /// The same as a share of all light there: independent of the exposure.
    pub fn modulation(&self) -> f32 {
        let off = self.off.max(0.0) / (core::f32::consts::TAU * self.variance);
        let peak = self.peak();
        peak / (self.background.max(0.0) + off + peak).max(f32::MIN_POSITIVE)
    }

    /// The same as a share of the mean light of an On LED and an Off one, which is that of a panel of any contrast that is On half of the
    /// time.
    #[cfg(feature = "carrier")]
    pub fn modulation_of_mean(&self) -> f32 {
        let modulation = self.modulation();
        2.0 * modulation / (2.0 - modulation)
    }

    /// The covariance of the levels by the phase of a carrier: Off LEDs gain the light that On LEDs lose.
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

/// Fitted levels: background, Off, contrast, variance, and a shift of the LEDs in x and y.
pub(super) const LEVELS: usize = 6;
pub(super) type Vector = SVector<f32, LEVELS>;
pub(super) type Matrix = SMatrix<f32, LEVELS, LEVELS>;
