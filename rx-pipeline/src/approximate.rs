//! Approximations of slow functions for loops over pixels. They use multiplications only, so that whole rows are vectorised on every
//! processor. A constant next to each function bounds its error.
//!
//! ```
//! use rx_pipeline::approximate::{INVERSE_SQRT_ERROR, inverse_sqrt};
//! assert!((f64::from(inverse_sqrt(4.0)) / 0.5 - 1.0).abs() <= INVERSE_SQRT_ERROR);
//! ```

/// Bound of the relative error of [`inverse_sqrt`].
pub const INVERSE_SQRT_ERROR: f64 = 4e-7;

/// 1/√x for positive normal x, finite at 0: a first guess from the exponent, then three of Newton's steps.
#[inline(always)]
pub fn inverse_sqrt(x: f32) -> f32 {
    let half = 0.5 * x;
    refined(refined(refined(guess(x), half), half), half)
}

/// The least argument of [`root`].
pub const ROOT_MIN: f32 = 1e-6;
/// Bound of the relative error of [`root`].
pub const ROOT_ERROR: f64 = 5e-6;

/// √x by two steps of Newton's method. Arguments below [`ROOT_MIN`], negative ones and NaN count as [`ROOT_MIN`].
#[inline(always)]
pub fn root(x: f32) -> f32 {
    let x = x.max(ROOT_MIN);
    let half = 0.5 * x;
    x * refined(refined(guess(x), half), half)
}

/// Bounds of the error of [`censored_loss`] up to 10 deviations, [absolute, relative]; the error is at most the sum of both.
pub const CENSORED_LOSS_ERROR: [f64; 2] = [0.05, 0.05];

/// −ln Q(t), by two parabolas: the loss of a saturated pixel that is expected t deviations below saturation. Beyond 10 deviations it is up
/// to 14 % too low.
#[inline(always)]
pub fn censored_loss(t: f32) -> f32 {
    let (near, far) = ((t + 2.0).max(0.0), t.max(0.0));
    0.173 * near * near + 0.257 * far * far
}

/// 1/√x to 3.5 %, from half the exponent (Lomont 2003).
#[inline(always)]
fn guess(x: f32) -> f32 {
    f32::from_bits(0x5f37_5a86 - (x.to_bits() >> 1))
}

/// One of Newton's steps towards 1/√x.
#[inline(always)]
fn refined(guess: f32, half: f32) -> f32 {
    guess * (1.5 - half * guess * guess)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_positive_number_does_no_harm() {
        for x in [0.0, -0.0, f32::MIN_POSITIVE / 2.0] {
            assert!(inverse_sqrt(x).is_finite(), "{x}");
        }
        for x in [0.0, -1.0, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(root(x), root(ROOT_MIN), "{x}");
        }
    }
}
