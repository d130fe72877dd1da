//! A number with its 95 % interval, from batches of frames.

use serde::{Deserialize, Serialize};

/// A value and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Batches of frames of every point: see [`jackknife`].
pub const BATCHES: usize = 32;
/// The 97.5 % point of Student's t with [`BATCHES`] − 1 degrees of freedom.
const STUDENT_T: f64 = 2.0395;

/// Estimates a statistic from that of all batches and those with one batch left out in turn (the delete-one jackknife).
///
/// Batches hold whole frames, which covers the correlation of a frame's 64 LEDs. A statistic of several points whose batches have the same
/// random numbers benefits from their correlation.
///
/// ```
/// use studies::statistics::{BATCHES, jackknife};
/// let means: Vec<f64> = (0..BATCHES).map(|k| (k % 2) as f64).collect();
/// let mean = jackknife(|left_out| {
///     let kept: Vec<f64> = (0..BATCHES).filter(|&k| Some(k) != left_out).map(|k| means[k]).collect();
///     kept.iter().sum::<f64>() / kept.len() as f64
/// });
/// assert_eq!(mean.value, 0.5);
/// // Student's t times the standard error of a mean of 32, 0.508/√32.
/// assert!((mean.high - mean.value - 2.0395 * 0.508 / 32f64.sqrt()).abs() < 1e-3);
/// ```
pub fn jackknife(statistic: impl Fn(Option<usize>) -> f64) -> Estimate {
    let value = statistic(None);
    let parts: Vec<f64> = (0..BATCHES).map(|k| statistic(Some(k))).collect();
    let count = BATCHES as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let squares: f64 = parts.iter().map(|part| (part - mean).powi(2)).sum();
    let reach = STUDENT_T * (squares * (count - 1.0) / count).sqrt();
    Estimate {
        value,
        low: value - reach,
        high: value + reach,
    }
}

impl Estimate {
    /// Whether the whole interval is above `bound`: `None` if the interval holds it.
    pub fn exceeds(&self, bound: f64) -> Option<bool> {
        if self.low > bound {
            Some(true)
        } else if self.high < bound {
            Some(false)
        } else {
            None
        }
    }
}
