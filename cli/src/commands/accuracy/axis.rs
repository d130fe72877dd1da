//! A logarithmic axis: where a value stands, and where its ticks are.

/// An axis along some pixels.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// The values at its ends.
    ends: [f64; 2],
    /// The pixels at its ends.
    pixels: [i32; 2],
}

/// Room beyond the outermost values, as a part of the axis.
const ROOM: f64 = 0.07;
/// The shortest axis, in powers of ten.
const SHORTEST: f64 = 0.5;
/// Ticks within a power of ten, from few to many; as many as it takes for so many on an axis.
const STEPS: [&[f64]; 3] = [
    &[1.0],
    &[1.0, 2.0, 5.0],
    &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0],
];
const FEWEST: usize = 3;

impl Axis {
    /// An axis that holds all positive values.
    pub fn over(values: impl Iterator<Item = f64>, pixels: [i32; 2]) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite() && *value > 0.0)
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        let (low, high) = if low > high { (-1.0, 1.0) } else { (low, high) };
        let lacking = (SHORTEST - (high - low)).max(0.0) / 2.0;
        let room = lacking + ROOM * (high - low).max(SHORTEST);
        Self {
            ends: [low - room, high + room].map(|end| 10f64.powf(end)),
            pixels,
        }
    }

    /// The pixel of a value; the end where it lies beyond.
    pub fn pixel(&self, value: f64) -> i32 {
        let [low, high] = self.ends.map(f64::log10);
        let share = ((value.max(f64::MIN_POSITIVE).log10() - low) / (high - low)).clamp(0.0, 1.0);
        let [first, last] = self.pixels.map(f64::from);
        (first + share * (last - first)).round() as i32
    }

    /// The values to be labelled, ascending: powers of ten, or as many between them as it takes.
    pub fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.ends.map(f64::log10);
        let every = ((high - low) / 7.0).ceil().max(1.0) as i32;
        let of = |steps: &[f64]| -> Vec<f64> {
            let powers = (low.floor() as i32..=high.ceil() as i32)
                .filter(|power| power.rem_euclid(every) == 0);
            powers
                .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
                .filter(|tick| (self.ends[0]..=self.ends[1]).contains(tick))
                .collect()
        };
        let mut finer = STEPS.iter().map(|steps| of(steps));
        finer
            .clone()
            .find(|ticks| ticks.len() >= FEWEST)
            .or_else(|| finer.next_back())
            .unwrap_or_default()
    }
}

/// A number as short as can be: 0.02, 5, 300, 10⁻⁶.
pub fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        let text = format!("{value:.5}");
        return text.trim_end_matches('0').trim_end_matches('.').into();
    }
    let power = value.abs().log10().floor() as i32;
    let digits = format!("{:.1}", value / 10f64.powi(power));
    match digits.as_str() {
        "1.0" => format!("10{}", superscript(power)),
        digits => format!("{}·10{}", digits.trim_end_matches(".0"), superscript(power)),
    }
}

fn superscript(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let sign = if number < 0 { "⁻" } else { "" };
    let digits = number.unsigned_abs().to_string();
    let raised = digits
        .bytes()
        .map(|digit| DIGITS[usize::from(digit - b'0')]);
    sign.chars().chain(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_between_the_ends_in_proportion_of_their_logarithms() {
        let axis = Axis::over([1.0, 100.0].into_iter(), [0, 1140]);
        let [one, ten, hundred] = [1.0, 10.0, 100.0].map(|value| axis.pixel(value));
        assert!(0 < one && (ten - one - (hundred - ten)).abs() <= 1 && hundred < 1140);
        assert_eq!(axis.pixel(0.0), 0);
        assert_eq!(axis.ticks(), [1.0, 10.0, 100.0]);
    }

    #[test]
    fn short_axes_have_ticks_between_the_powers_and_none_panics() {
        assert!(Axis::over([2.0, 3.0].into_iter(), [0, 100]).ticks().len() >= FEWEST);
        assert!(
            !Axis::over([1e-12, 1e12].into_iter(), [0, 100])
                .ticks()
                .is_empty()
        );
        let none = Axis::over([f64::NAN, 0.0].into_iter(), [0, 100]);
        assert!(!none.ticks().is_empty());
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.02, 5.0, 300.0, 1e-6, 2.5e7].map(short);
        assert_eq!(shown, ["0.02", "5", "300", "10⁻⁶", "2.5·10⁷"]);
    }
}
