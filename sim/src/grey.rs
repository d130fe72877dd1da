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

    /// The grey levels of a row.
    pub fn encode(&self, linear: &[f32], grey: &mut [u8]) {
        for (grey, &linear) in grey.iter_mut().zip(linear) {
            *grey = self.grey(linear);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
