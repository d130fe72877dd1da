//! The spread of a measured time.

use serde::{Deserialize, Serialize};

/// A median and the quartiles about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quartiles {
    /// The lower quartile.
    pub low: f64,
    /// The median.
    pub median: f64,
    /// The upper quartile.
    pub high: f64,
}

impl Quartiles {
    /// The quartiles of some values; zeros without values.
    ///
    /// ```
    /// use studies::work_precision::Quartiles;
    /// let spread = Quartiles::of([5.0, 1.0, 3.0, 2.0, 4.0]);
    /// assert_eq!((spread.low, spread.median, spread.high), (2.0, 3.0, 4.0));
    /// ```
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |quarter: usize| {
            let place = (values.len().max(1) - 1) * quarter / 4;
            values.get(place).copied().unwrap_or_default()
        };
        Self {
            low: at(1),
            median: at(2),
            high: at(3),
        }
    }

    /// A number that does not vary.
    pub fn exactly(value: f64) -> Self {
        Self {
            low: value,
            median: value,
            high: value,
        }
    }

    /// All three times a factor.
    pub fn times(self, factor: f64) -> Self {
        Self {
            low: self.low * factor,
            median: self.median * factor,
            high: self.high * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_nothing_are_zero() {
        assert_eq!(Quartiles::of([]), Quartiles::default());
    }
}
