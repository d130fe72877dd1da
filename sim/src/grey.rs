//! From linear values to grey levels: the gamma curve, rounding and clipping (Do & Yoo 2020, Eq. 11).

/// The grey level of linear value 1.
pub const MIDDLE_GREY: f64 = 118.0;

/// The unrounded grey level of a linear value: 118·x^(1/γ), at most 255.
///
/// ```
/// assert_eq!(sim::grey::unrounded(1.0, 2.2), 118.0);
/// assert_eq!(sim::grey::unrounded(100.0, 2.2), 255.0);
/// ```
pub fn unrounded(linear: f64, gamma: f64) -> f64 {
    (MIDDLE_GREY * linear.max(0.0).powf(1.0 / gamma)).min(255.0)
}

/// The linear value of a grey level: the inverse of [`unrounded`] below 255.
pub fn linear(grey: f64, gamma: f64) -> f64 {
    (grey / MIDDLE_GREY).powf(gamma)
}

/// The most that a change of `linear_change` can move the unrounded grey of a pixel not darker than `floor`.
///
/// The curve is concave, so the change is greatest at the floor.
pub fn greatest_change(floor: f64, linear_change: f64, gamma: f64) -> f64 {
    unrounded(floor + linear_change.abs(), gamma) - unrounded(floor, gamma)
}

/// Encodes f32 linear values as 8-bit grey, by table: the same result as rounding [`unrounded`] to nearest.
///
/// The upper bits of the number (exponent and eight bits of mantissa) give the grey level at the start of a span that
/// is 1/256 of its value wide. Such a span is less than one grey level wide for γ ≥ 1, so one comparison with the
/// next level's threshold finishes it.
#[derive(Clone, Debug)]
pub struct Encoder {
    levels: Vec<u8>,
    thresholds: [f32; 257],
}

/// Mantissa bits below those that choose the span.
const SPAN_SHIFT: u32 = 15;
/// Spans begin at 2^-40, far below the first threshold at any γ up to 4, and end at 2^5, above the last.
const FIRST_SPAN: u32 = (127 - 40) << 8;
const LAST_SPAN: u32 = (127 + 5) << 8;

impl Encoder {
    /// The encoder for a gamma of 1 to 4.
    pub fn new(gamma: f64) -> Self {
        let mut thresholds = [f32::INFINITY; 257];
        thresholds[0] = 0.0;
        for (level, threshold) in thresholds.iter_mut().enumerate().take(256).skip(1) {
            *threshold = linear(level as f64 - 0.5, gamma) as f32;
        }
        let level_of = |span: u32| {
            let start = f32::from_bits(span << SPAN_SHIFT);
            thresholds[1..256].partition_point(|&t| t <= start) as u8
        };
        Self {
            levels: (FIRST_SPAN..=LAST_SPAN).map(level_of).collect(),
            thresholds,
        }
    }

    /// The grey level of one linear value; negative values and NaN are black.
    #[inline]
    pub fn grey(&self, linear: f32) -> u8 {
        let linear = if linear > 0.0 {
            linear.min(f32::MAX)
        } else {
            0.0
        };
        let span = (linear.to_bits() >> SPAN_SHIFT).clamp(FIRST_SPAN, LAST_SPAN) - FIRST_SPAN;
        let level = self.levels[span as usize];
        level + u8::from(linear >= self.thresholds[usize::from(level) + 1])
    }
}

/// What [`Curve`] may differ from [`unrounded`], in grey levels.
pub const CURVE_ERROR_GREY: f64 = 5e-4;

/// Encodes whole rows of f32 linear values, a vector at a time.
///
/// With x = m·2^e the curve is 118·m^(1/γ)·2^(e/γ): a polynomial in the mantissa, and one in the fractional part of e/γ whose whole
/// part goes into the exponent. Both are interpolated at Chebyshev's nodes when the curve is made. What comes out is rounded, so the
/// result is that of [`Encoder`] but for values within [`CURVE_ERROR_GREY`] of a threshold.
#[derive(Clone, Copy, Debug)]
pub struct Curve {
    inverse_gamma: f32,
    /// Of m − 1.5, for m from 1 to 2.
    mantissa: [f32; 8],
    /// Of the distance from the nearest integer.
    exponent: [f32; 7],
}

/// Adding this rounds a number below 2²² in size to an integer, which then stands in the last bits.
const ROUNDING: f32 = 12_582_912.0;
/// Darker values are grey level 0 at any γ up to 4; brighter ones 255.
const DARKEST: f32 = 1e-20;
const BRIGHTEST: f32 = 1e3;

impl Curve {
    /// The curve of a gamma of 1 to 4.
    pub fn new(gamma: f64) -> Self {
        Self {
            inverse_gamma: (1.0 / gamma) as f32,
            mantissa: interpolation(0.5, |x| MIDDLE_GREY * (1.5 + x).powf(1.0 / gamma)),
            exponent: interpolation(0.5, f64::exp2),
        }
    }

    /// The unrounded grey level of a linear value; 0 of negative values and NaN.
    #[inline(always)]
    fn unrounded(&self, linear: f32) -> f32 {
        // NaN is not brighter than the darkest.
        let linear = if linear > DARKEST { linear } else { DARKEST };
        let bits = linear.min(BRIGHTEST).to_bits();
        let exponent = (bits >> 23) as i32 - 127;
        let mantissa = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000);
        let power = exponent as f32 * self.inverse_gamma;
        let whole = power + ROUNDING;
        let rest = power - (whole - ROUNDING);
        let scale = (whole.to_bits() as i32).wrapping_sub(ROUNDING.to_bits() as i32 - 127) << 23;
        let curve = horner(&self.mantissa, mantissa - 1.5) * horner(&self.exponent, rest);
        (curve * f32::from_bits(scale as u32)).min(255.0)
    }

    /// The grey levels of a row.
    #[inline(always)]
    pub fn encode(&self, linear: &[f32], grey: &mut [u8]) {
        for (grey, &linear) in grey.iter_mut().zip(linear) {
            *grey = (self.unrounded(linear) + ROUNDING).to_bits() as u8;
        }
    }
}

#[inline(always)]
fn horner<const N: usize>(coefficients: &[f32; N], x: f32) -> f32 {
    coefficients.iter().rev().fold(0.0, |sum, &c| sum * x + c)
}

/// The polynomial, lowest power first, through `f` at the N Chebyshev nodes between ±`half_width` (Newton's form, multiplied out).
fn interpolation<const N: usize>(half_width: f64, f: impl Fn(f64) -> f64) -> [f32; N] {
    let nodes: [f64; N] = std::array::from_fn(|k| {
        half_width * ((k as f64 + 0.5) * std::f64::consts::PI / N as f64).cos()
    });
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

    #[test]
    fn the_curve_keeps_its_bound() {
        for gamma in [1.0, 1.8, 2.2, 2.4, 4.0] {
            let curve = Curve::new(gamma);
            let mut linear = 1e-9f32;
            while linear < 40.0 {
                let error = f64::from(curve.unrounded(linear)) - unrounded(linear.into(), gamma);
                assert!(
                    error.abs() < CURVE_ERROR_GREY,
                    "γ {gamma}, x {linear}: off by {error}"
                );
                linear *= 1.000_037;
            }
            let mut grey = [1; 6];
            curve.encode(&[-1.0, f32::NAN, 0.0, 1.0, f32::INFINITY, 1e30], &mut grey);
            assert_eq!(grey, [0, 0, 0, 118, 255, 255]);
        }
    }

    #[test]
    fn the_table_rounds_as_the_formula_does() {
        for gamma in [1.0, 1.8, 2.2, 2.4, 4.0] {
            let encoder = Encoder::new(gamma);
            let mut linear = 1e-9f32;
            while linear < 40.0 {
                let exact = unrounded(f64::from(linear), gamma);
                // At a threshold itself f32 may fall to either side.
                if (exact.fract() - 0.5).abs() > 1e-4 {
                    assert_eq!(
                        f64::from(encoder.grey(linear)),
                        exact.round(),
                        "γ {gamma}, x {linear}"
                    );
                }
                linear *= 1.000_37;
            }
        }
    }

    #[test]
    fn odd_values_do_no_harm() {
        let encoder = Encoder::new(2.2);
        assert_eq!(
            [-1.0, f32::NAN, 0.0, f32::INFINITY].map(|x| encoder.grey(x)),
            [0, 0, 0, 255]
        );
    }
}
