//! A number with its 95 % interval.

use crate::statistics::{Moments, student_97_5};

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its 95 % interval, if the encoding is the camera's own.
    pub interval_95: [f64; 2],
    /// Its 95 % interval, if the encoding is off by as much as the pictures allow.
    pub doubted_95: [f64; 2],
}

impl Estimate {
    /// The mean of two or more values.
    pub(super) fn mean(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        Self::about(value, student_97_5(count - 1.0) * deviation(values) / count.sqrt())
    }

    fn about(value: f64, reach: f64) -> Self {
        Self {
            value,
            interval_95: [value - reach, value + reach],
            doubted_95: [value - reach, value + reach],
        }
    }

    /// The estimate with ends that are farther out by that part of the value.
    pub(super) fn widened(self, part: f64) -> Self {
        Self::about(self.value, (self.relative_reach() + part) * self.value.abs())
    }

    /// The estimate of a non-negative number, with doubt that moves its ends out by at most that part if the encoding is wrong.
    pub(super) fn doubted(self, part: f64) -> Self {
        let [low, high] = self.widened(part).interval_95;
        Self {
            doubted_95: [low.max(0.0), high],
            ..self
        }
    }

    /// The union with another interval.
    pub(super) fn or(self, other: &Self) -> Self {
        let ([low, high], [least, most]) = (self.doubted_95, other.doubted_95);
        Self {
            doubted_95: [low.min(least), high.max(most)],
            ..self
        }
    }

    /// The estimate, multiplied by a factor.
    pub fn times(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            interval_95: self.interval_95.map(|end| end * factor),
            doubted_95: self.doubted_95.map(|end| end * factor),
        }
    }

    /// Whether 0 is in the interval.
    pub(super) fn may_be_zero(&self) -> bool {
        let [low, high] = self.interval_95;
        low <= 0.0 && 0.0 <= high
    }

    /// The magnitude of its farther end.
    pub(super) fn most(&self) -> f64 {
        self.interval_95[0].abs().max(self.interval_95[1].abs())
    }

    /// The distance of its ends from it, relative to it.
    pub(super) fn relative_reach(&self) -> f64 {
        (self.interval_95[1] - self.value) / self.value.abs()
    }
}

/// A straight line.
pub(super) struct Line {
    /// Its slope.
    pub slope: Estimate,
    /// Its height at 0.
    pub at_zero: Estimate,
}

impl Line {
    /// The least-squares line through three or more points, not all at one x.
    pub(super) fn through(points: &[[f64; 2]]) -> Self {
        let count = points.len() as f64;
        let moments = Moments::of(points);
        let [x, y] = moments.mean();
        let [[xx, xy], _] = moments.covariance();
        let slope = xy / xx;
        let left = |point: &[f64; 2]| (point[1] - y - slope * (point[0] - x)).powi(2);
        let freedom = points.len() - 2;
        let variance = points.iter().map(left).sum::<f64>() / freedom as f64;
        let quantile = student_97_5(freedom as f64);
        let sxx = xx * count;
        let at_zero = variance * (1.0 / count + x * x / sxx);
        Self {
            slope: Estimate::about(slope, quantile * (variance / sxx).sqrt()),
            at_zero: Estimate::about(y - slope * x, quantile * at_zero.sqrt()),
        }
    }
}

/// The standard deviation of two or more values.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (count - 1.0)).sqrt()
}
