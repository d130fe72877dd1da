//! Numbers of diagrams in the text beside them: computed from the points, so that they agree.

use super::diagram::Diagram;
use super::point::Point;

/// The variant of that name.
pub fn variant<'a>(diagram: &'a Diagram, name: &str) -> Option<&'a Point> {
    diagram.points.iter().find(|point| point.variant == name)
}

/// The least and the greatest, "1.2 to 34", or one number if they are equal.
pub fn range(values: impl IntoIterator<Item = f64>) -> String {
    let ends = values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    let [low, high] = ends.map(rounded);
    if low == high { low } else { format!("{low} to {high}") }
}

/// A number of two significant digits.
pub fn rounded(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = 1 - value.abs().log10().floor() as i32;
    let unit = 10f64.powi(-digits);
    let decimals = digits.max(0) as usize;
    format!("{:.decimals$}", (value / unit).round() * unit)
}

/// A share in percent; "none" if nothing was seen.
pub fn percent(point: &Point) -> String {
    match point.at_most {
        true => "none".into(),
        false => format!("{} %", rounded(100.0 * point.error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_digits_that_count() {
        for (value, text) in [
            (0.712_75, "0.71"),
            (9.61, "9.6"),
            (1.0, "1.0"),
            (54.499, "54"),
            (20_182.8, "20000"),
            (-0.0449, "-0.045"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(rounded(value), text);
        }
    }

    #[test]
    fn a_range_of_what_rounds_to_one_number_is_that_number() {
        assert_eq!(range([3.19, 7.51, 3.5]), "3.2 to 7.5");
        assert_eq!(range([0.4179, 0.418]), "0.42");
    }
}
