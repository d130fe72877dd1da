//! Powers of 2 in fixed point, the inverse of the logarithmic scale on which light is smoothed.

use fixed::types::{I6F26, U2F30, U32F32};

/// Bound of the relative error of [`exp2`], beside the step of 2⁻³² of the result's type.
pub const EXP2_ERROR: f64 = 5e-9;

/// 2 to the power y.
///
/// ```
/// use fixed::types::I6F26;
/// use tx_firmware::power::exp2;
/// assert_eq!(exp2(I6F26::from_num(10)), 1024);
/// ```
pub fn exp2(y: I6F26) -> U32F32 {
    let mantissa = u64::from(exp2_of_fraction(U2F30::from_num(y.frac())).to_bits());
    // From 30 fraction bits to 32, and 2 to the integer part of y: a shift by −30 to 33 places, of which a mantissa below 2 has room.
    let places = 2 + y.int().to_num::<i32>();
    let bits = if places < 0 {
        mantissa >> places.unsigned_abs()
    } else {
        mantissa << places
    };
    U32F32::from_bits(bits)
}

/// 2 to the power x for x in 0 to 1: the power series of e^(x·ln 2), whose 12th term is below 2⁻³⁰.
fn exp2_of_fraction(x: U2F30) -> U2F30 {
    const TERMS: u32 = 11;
    let x = x * U2F30::LN_2;
    (1..=TERMS).rev().fold(U2F30::ONE, |sum, term| U2F30::ONE + x * sum / term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn relative_error(y: I6F26) -> f64 {
        let exact = y.to_num::<f64>().exp2();
        let step = 1.0 / (1u64 << 32) as f64;
        ((exp2(y).to_num::<f64>() - exact).abs() - step) / exact
    }

    properties! {
        #[test]
        fn it_keeps_its_bound(bits in any::<i32>()) {
            let y = I6F26::from_bits(bits);
            prop_assert!(relative_error(y) <= EXP2_ERROR, "2^{y} is off by {:e}", relative_error(y));
        }
    }

    #[test]
    fn it_keeps_its_bound_at_the_ends() {
        for y in [I6F26::MIN, I6F26::MAX, -I6F26::DELTA, I6F26::ZERO, I6F26::from_num(31)] {
            assert!(relative_error(y) <= EXP2_ERROR, "2^{y}");
        }
    }

    #[test]
    fn whole_powers_are_exact() {
        for n in -32..32 {
            assert_eq!(exp2(I6F26::from_num(n)).to_bits(), 1u64 << (n + 32));
        }
    }
}
