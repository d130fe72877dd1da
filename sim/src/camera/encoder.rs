//! Encodes whole rows of f32 linear values, by the curve of any camera.

use super::curve::Curve;
use super::grey::{BRIGHTEST, DARKEST, GammaEncoder, rounded, visible};

/// Maximum difference of [`Encoder`] from [`Curve::unrounded`] before rounding, in grey levels.
pub const CURVE_ERROR_GREY: f64 = 5e-4;

/// Encodes whole rows of f32 linear values.
#[derive(Clone, Debug)]
pub enum Encoder {
    /// By two polynomials, a vector at a time.
    Gamma(GammaEncoder),
    /// By a table.
    Table(CurveTable),
}

impl Encoder {
    /// The encoder of a curve.
    pub fn new(curve: &Curve) -> Self {
        match curve.as_gamma() {
            Some(gamma) => Self::Gamma(GammaEncoder::new(gamma)),
            None => Self::Table(CurveTable::new(curve)),
        }
    }

    /// The grey levels of a row.
    #[inline(always)]
    pub fn encode(&self, linear: &[f32], grey: &mut [u8]) {
        match self {
            Self::Gamma(encoder) => encoder.encode(linear, grey),
            Self::Table(table) => table.encode(linear, grey),
        }
    }
}

/// Values of a curve at equal steps within each octave of linear values, with straight lines between.
///
/// A curve x^(1/γ) deviates from such a line by at most y/(32·n²) with n steps an octave: 1.2e-4 grey levels for 256 of them.
#[derive(Clone, Debug)]
pub struct CurveTable {
    levels: Vec<f32>,
}

/// Of the 23 bits of a float's fraction, those that give the position between two steps: there are 2⁸ steps an octave.
const FINE_BITS: u32 = 15;

impl CurveTable {
    fn new(curve: &Curve) -> Self {
        let [first, last] = [DARKEST, BRIGHTEST].map(|linear| linear.to_bits() >> FINE_BITS);
        let level = |step: u32| curve.unclipped(f32::from_bits(step << FINE_BITS).into()) as f32;
        Self {
            levels: (first..=last + 1).map(level).collect(),
        }
    }

    /// The unrounded grey level of a linear value; black of negative values and NaN.
    #[inline(always)]
    pub fn unrounded(&self, linear: f32) -> f32 {
        let bits = visible(linear).to_bits();
        let step = ((bits >> FINE_BITS) - (DARKEST.to_bits() >> FINE_BITS)) as usize;
        let part = (bits & ((1 << FINE_BITS) - 1)) as f32 / (1 << FINE_BITS) as f32;
        let (low, high) = (self.levels[step], self.levels[step + 1]);
        (low + (high - low) * part).min(255.0)
    }

    /// The grey levels of a row.
    #[inline(always)]
    fn encode(&self, linear: &[f32], grey: &mut [u8]) {
        for (grey, &linear) in grey.iter_mut().zip(linear) {
            *grey = rounded(self.unrounded(linear));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Encoding, Scene};

    #[test]
    fn every_curve_keeps_the_bound() {
        for encoding in Encoding::NAMES {
            for (gamma, black) in [(2.2, 0), (1.0, 16), (4.0, 1)] {
                let settings = [
                    format!("camera.encoding={encoding}"),
                    format!("camera.gamma={gamma}"),
                    format!("camera.black_grey={black}"),
                ];
                let curve = Curve::of(&Scene::load("paper", &settings).unwrap().camera);
                let encoder = Encoder::new(&curve);
                let odd = [-1.0, f32::NAN, 0.0, f32::INFINITY, 1e30];
                let bits = 1e-26f32.to_bits()..1e4f32.to_bits();
                for linear in odd.into_iter().chain(bits.step_by(4093).map(f32::from_bits)) {
                    let unrounded = match &encoder {
                        Encoder::Gamma(encoder) => encoder.unrounded(linear),
                        Encoder::Table(table) => table.unrounded(linear),
                    };
                    let error = f64::from(unrounded) - curve.unrounded(linear.into());
                    assert!(error.abs() < CURVE_ERROR_GREY, "{settings:?}, {linear}: off by {error}");
                    let mut grey = [7];
                    encoder.encode(&[linear], &mut grey);
                    assert!((f32::from(grey[0]) - unrounded).abs() <= 0.501);
                }
            }
        }
    }
}
