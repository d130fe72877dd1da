//! Number formats.

use crate::plot::short;

/// Formats a claim's number to three significant digits.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "?".into();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let digits = (2 - magnitude).clamp(0, 6) as usize;
    format!("{value:.digits$}").replace('-', "−")
}

/// Formats a number with its interval.
pub fn with_interval(value: f64, [low, high]: [f64; 2], shown: fn(f64) -> String) -> String {
    format!("{} ({} to {})", shown(value), shown(low), shown(high))
}

/// Formats a number of any magnitude to three significant digits.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return short(value);
    }
    let places = (2.0 - magnitude).max(0.0) as usize;
    format!("{value:.places$}")
}

/// Formats a time in a suitable unit.
pub fn time(ns: f64) -> String {
    let (value, unit) = match ns.abs() {
        size if size < 1e3 => (ns, "ns"),
        size if size < 1e6 => (ns / 1e3, "µs"),
        size if size < 1e9 => (ns / 1e6, "ms"),
        _ => (ns / 1e9, "s"),
    };
    let digits = (2 - value.abs().max(1.0).log10() as i32).max(0) as usize;
    format!("{value:.digits$} {unit}")
}

/// Formats a variance or a ratio of variances to two decimals.
pub fn two_decimals(value: Option<f64>) -> String {
    value.map_or("undefined".into(), |value| format!("{value:.2}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let shown = [0.0, 2.0449, -14.96, 1234.5, 0.00123, f64::NAN].map(number);
        assert_eq!(shown, ["0.00", "2.04", "−15.0", "1234", "0.00123", "?"]);
        let shown = [0.0, 2.0449, 0.00123, 2e-9].map(digits);
        assert_eq!(shown, ["0", "2.04", "0.00123", "2·10⁻⁹"]);
    }

    #[test]
    fn times_have_the_unit_that_suits_them() {
        let shown = [9.57, 21_700.0, -3e6, 2e9].map(time);
        assert_eq!(shown, ["9.57 ns", "21.7 µs", "-3.00 ms", "2.00 s"]);
    }
}
