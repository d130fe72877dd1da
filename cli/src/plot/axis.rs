//! Axes: positions of values and ticks.

/// An axis: its label, and the values at its ends.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The label, with its unit.
    pub label: String,
    ends: [f64; 2],
    is_logarithmic: bool,
}

/// Margin beyond the outermost values, as a fraction of the axis.
const ROOM: f64 = 0.07;
/// Minimum length of a logarithmic axis, in decades.
const SHORTEST: f64 = 0.5;
/// Ticks within a decade, from few to many; the axis uses the first set with enough ticks.
const STEPS: [&[f64]; 3] = [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]];
const FEWEST: usize = 3;
/// Maximum number of ticks of a linear axis.
const MOST: f64 = 10.0;

impl Axis {
    /// A linear axis between two values.
    pub fn linear(label: &str, ends: [f64; 2]) -> Self {
        Self {
            label: label.into(),
            ends,
            is_logarithmic: false,
        }
    }

    /// A logarithmic axis between two positive values.
    pub fn logarithmic(label: &str, ends: [f64; 2]) -> Self {
        Self {
            is_logarithmic: true,
            ..Self::linear(label, ends)
        }
    }

    /// A linear axis from 0 to slightly above the maximum of `values`.
    pub fn from_zero(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let top = values.filter(|value| value.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
        Self::linear(label, [0.0, (1.0 + ROOM) * top])
    }

    /// A linear axis that holds all values, with a margin.
    pub fn around(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = extremes(values).unwrap_or([0.0, 1.0]);
        let room = ROOM * (high - low).max(0.1 * high.abs()).max(1e-9);
        Self::linear(label, [low - room, high + room])
    }

    /// A logarithmic axis that holds all positive values, with a margin.
    pub fn around_logarithms(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let logarithms = values.filter(|value| *value > 0.0).map(f64::log10);
        let [low, high] = extremes(logarithms).unwrap_or([-1.0, 1.0]);
        let lacking = (SHORTEST - (high - low)).max(0.0) / 2.0;
        let room = lacking + ROOM * (high - low).max(SHORTEST);
        Self::logarithmic(label, [low - room, high + room].map(|end| 10f64.powf(end)))
    }

    /// Position of a value, clamped to 0..=1.
    pub fn share(&self, value: f64) -> f64 {
        let place = |value: f64| {
            if self.is_logarithmic {
                value.max(f64::MIN_POSITIVE).log10()
            } else {
                value
            }
        };
        let [low, high] = self.ends.map(place);
        ((place(value) - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// The ticks, ascending, with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        if self.is_logarithmic {
            self.logarithmic_ticks()
        } else {
            self.linear_ticks()
        }
    }

    /// Multiples of 1, 2 or 5 times a power of ten.
    fn linear_ticks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.ends;
        let least = (high - low) / MOST;
        let power = 10f64.powf(least.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|step| step * power)
            .into_iter()
            .find(|step| *step >= least)
            .unwrap_or(least);
        // Keep a tick at an end despite rounding.
        let (first, last) = (low / step - 1e-9, high / step + 1e-9);
        if (last - first).is_nan() {
            return Vec::new();
        }
        (first.ceil() as i64..=last.floor() as i64)
            .map(|k| (k as f64 * step, short(k as f64 * step)))
            .collect()
    }

    /// Powers of ten, and as many steps between them as needed.
    fn logarithmic_ticks(&self) -> Vec<(f64, String)> {
        let [low, high] = self.ends.map(f64::log10);
        let every = ((high - low) / 7.0).ceil().max(1.0) as i32;
        let of = |steps: &[f64]| -> Vec<f64> {
            let powers = (low.floor() as i32..=high.ceil() as i32).filter(|power| power.rem_euclid(every) == 0);
            powers
                .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
                .filter(|tick| (self.ends[0] * (1.0 - 1e-9)..=self.ends[1] * (1.0 + 1e-9)).contains(tick))
                .collect()
        };
        let powers = of(STEPS[0]);
        // If one label needs an exponent, all have one.
        if powers.len() >= FEWEST && powers.iter().any(|tick| !is_plain(*tick)) {
            let label = |tick: f64| format!("10{}", superscript(tick.log10().round() as i32));
            return powers.into_iter().map(|tick| (tick, label(tick))).collect();
        }
        let mut finer = STEPS.iter().map(|steps| of(steps));
        let ticks = finer.clone().find(|ticks| ticks.len() >= FEWEST).or_else(|| finer.next_back());
        let ticks = ticks.unwrap_or_default().into_iter();
        ticks.map(|tick| (tick, short(tick))).collect()
    }
}

/// Minimum and maximum; `None` without values.
fn extremes(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values
        .filter(|value| value.is_finite())
        .map(|value| [value; 2])
        .reduce(|[low, high], [value, _]| [low.min(value), high.max(value)])
}

/// Whether a number is short without an exponent.
fn is_plain(value: f64) -> bool {
    value == 0.0 || (1e-3..1e5).contains(&value.abs())
}

/// Formats a number in its shortest form: 0.02, 5, 300, 10⁻⁶.
pub fn short(value: f64) -> String {
    if is_plain(value) {
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
    let raised = digits.bytes().map(|digit| DIGITS[usize::from(digit - b'0')]);
    sign.chars().chain(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn values_stand_between_the_ends_in_proportion_of_their_logarithms() {
        let axis = Axis::around_logarithms("", [1.0, 100.0].into_iter());
        let [one, ten, hundred] = [1.0, 10.0, 100.0].map(|value| axis.share(value));
        assert!(0.0 < one && (ten - one - (hundred - ten)).abs() < 1e-9 && hundred < 1.0);
        assert_eq!(axis.share(0.0), 0.0);
        assert_eq!(ticks(&axis), ["1", "10", "100"]);
        let rates = Axis::logarithmic("", [1e-4, 1.0]);
        assert_eq!(ticks(&rates), ["10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
    }

    #[test]
    fn linear_axes_have_round_ticks_and_room() {
        let axis = Axis::linear("", [0.2, 4.0]);
        assert_eq!(ticks(&axis), ["0.5", "1", "1.5", "2", "2.5", "3", "3.5", "4"]);
        let around = Axis::around("", [30.0, 70.0].into_iter());
        assert!(around.share(30.0) > 0.0 && around.share(70.0) < 1.0);
        assert_eq!(Axis::from_zero("", [5.0].into_iter()).share(0.0), 0.0);
        for ends in [[0.0, 0.0], [f64::NAN, 1.0], [-1e300, 1e300], [1.0, 0.0]] {
            assert!(Axis::linear("", ends).ticks().len() < 20, "{ends:?}");
        }
    }

    #[test]
    fn short_axes_have_ticks_between_the_powers_and_none_panics() {
        let of = |values: &[f64]| Axis::around_logarithms("", values.iter().copied()).ticks();
        assert!(of(&[2.0, 3.0]).len() >= FEWEST);
        assert!(!of(&[1e-12, 1e12]).is_empty());
        assert!(!of(&[f64::NAN, 0.0]).is_empty());
    }

    #[test]
    fn numbers_are_short() {
        let shown = [0.02, 5.0, 300.0, 1e-6, 2.5e7].map(short);
        assert_eq!(shown, ["0.02", "5", "300", "10⁻⁶", "2.5·10⁷"]);
    }
}
