//! Linear values to grey levels: the gamma curve, rounding and clipping (Do & Yoo 2020, Eq. 11).

/// The grey level of linear value 1.
pub(crate) const MIDDLE_GREY: f64 = link::camera::MIDDLE_GREY as f64;

/// The unrounded grey level of a linear value: 118·x^(1/γ), at most 255; 0 for negative values and NaN. γ is 1 to 4.
///
/// ```
/// assert_eq!(sim::camera::grey::unrounded(1.0, 2.2), 118.0);
/// assert_eq!(sim::camera::grey::unrounded(100.0, 2.2), 255.0);
/// ```
pub fn unrounded(linear: f64, gamma: f64) -> f64 {
    unclipped(linear, gamma).min(255.0)
}

/// The same without clipping at white.
pub(super) fn unclipped(linear: f64, gamma: f64) -> f64 {
    MIDDLE_GREY * linear.max(0.0).powf(1.0 / gamma)
}

/// The linear value of a grey level: the inverse of [`unrounded`] below 255; 0 for negative levels and NaN.
pub fn linear(grey: f64, gamma: f64) -> f64 {
    (grey.max(0.0) / MIDDLE_GREY).powf(gamma)
}

/// Encodes whole rows of f32 linear values, a vector at a time.
///
/// With x = m·2^e the curve is 118·m^(1/γ)·2^(e/γ): a polynomial in the mantissa, and one in the fractional part of e/γ, whose integer part
/// goes into the exponent. Both are interpolated at Chebyshev's nodes when the encoder is made.
#[derive(Clone, Copy, Debug)]
pub struct GammaEncoder {
    inverse_gamma: f32,
    /// In m − 1.5, for m from 1 to 2.
    mantissa: [f32; 8],
    /// In the distance from the nearest integer.
    exponent: [f32; 7],
}

/// Adding this rounds a number below 2²² to an integer, which is then in the last bits.
const ROUNDING: f32 = 12_582_912.0;
/// Darker values are black at any γ up to 4, to within [`super::encoder::CURVE_ERROR_GREY`].
pub(super) const DARKEST: f32 = 1e-24;
/// Brighter values are white.
pub(super) const BRIGHTEST: f32 = 1e3;

/// The linear value clamped to [`DARKEST`] to [`BRIGHTEST`]; the darkest for NaN.
#[inline(always)]
pub(super) fn visible(linear: f32) -> f32 {
    // NaN is not brighter than the darkest.
    let linear = if linear > DARKEST { linear } else { DARKEST };
    linear.min(BRIGHTEST)
}

/// The nearest of 256 grey levels.
#[inline(always)]
pub(super) fn rounded(grey: f32) -> u8 {
    (grey + ROUNDING).to_bits() as u8
}

impl GammaEncoder {
    /// The encoder for a gamma of 1 to 4.
    pub fn new(gamma: f64) -> Self {
        Self {
            inverse_gamma: (1.0 / gamma) as f32,
            mantissa: interpolation(0.5, |x| MIDDLE_GREY * (1.5 + x).powf(1.0 / gamma)),
            exponent: interpolation(0.5, f64::exp2),
        }
    }

    /// The unrounded grey level of a linear value; 0 for negative values and NaN.
    #[inline(always)]
    pub fn unrounded(&self, linear: f32) -> f32 {
        let bits = visible(linear).to_bits();
        let exponent = (bits >> 23) as i32 - 127;
        let mantissa = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000);
        let power = exponent as f32 * self.inverse_gamma;
        let whole = power + ROUNDING;
        let rest = power - (whole - ROUNDING);
        let scale = (whole.to_bits() as i32).wrapping_sub(ROUNDING.to_bits() as i32 - 127) << 23;
        let curve = horner(&self.mantissa, mantissa - 1.5) * horner(&self.exponent, rest);
        (curve * f32::from_bits(scale as u32)).min(255.0)
    }

    /// The grey level of one value.
    #[inline(always)]
    pub fn grey(&self, linear: f32) -> u8 {
        rounded(self.unrounded(linear))
    }

    /// The grey levels of a row.
    #[inline(always)]
    pub fn encode(&self, linear: &[f32], grey: &mut [u8]) {
        for (grey, &linear) in grey.iter_mut().zip(linear) {
            *grey = self.grey(linear);
        }
    }
}

#[inline(always)]
fn horner<const N: usize>(coefficients: &[f32; N], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, &c| sum * x + c)
}

/// The polynomial, lowest power first, through `f` at the N Chebyshev nodes between ±`half_width` (Newton's form, multiplied out).
fn interpolation<const N: usize>(half_width: f64, f: impl Fn(f64) -> f64) -> [f32; N] {
    let nodes: [f64; N] = std::array::from_fn(|k| half_width * ((k as f64 + 0.5) * std::f64::consts::PI / N as f64).cos());
    let mut differences = nodes.map(f);
    for order in 1..N {
        for k in (order..N).rev() {
            differences[k] = (differences[k] - differences[k - 1]) / (nodes[k] - nodes[k - order]);
        }
    }
    let mut coefficients = [0.0; N];
    for (node, difference) in nodes.iter().zip(&differences).rev() {
        for k in (1..N).rev() {
            coefficients[k] = coefficients[k - 1] - node * coefficients[k];
        }
        coefficients[0] = difference - node * coefficients[0];
    }
    coefficients.map(|c| c as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::encoder::CURVE_ERROR_GREY;

    #[test]
    fn the_curve_keeps_its_bound() {
        for gamma in [1.0, 1.8, 2.2, 2.4, 4.0] {
            let encoder = GammaEncoder::new(gamma);
            let mut linear = 1e-9f32;
            while linear < 40.0 {
                let error = f64::from(encoder.unrounded(linear)) - unrounded(linear.into(), gamma);
                assert!(error.abs() < CURVE_ERROR_GREY, "γ {gamma}, x {linear}: off by {error}");
                linear *= 1.000_037;
            }
            let mut grey = [1; 6];
            encoder.encode(&[-1.0, f32::NAN, 0.0, 1.0, f32::INFINITY, 1e30], &mut grey);
            assert_eq!(grey, [0, 0, 0, 118, 255, 255]);
        }
    }
}
