//! Rates too small to count, from swarms of frames (see [`crate::splitting`]).

use serde::{Deserialize, Serialize};

use super::{MOST_FRAMES, student_97_5};

/// Frames of a swarm.
pub(crate) const SWARM: usize = 256;
/// The factor by which each level is rarer than the one before.
pub(crate) const RARER: usize = 5;

/// Sums over independent swarms, each of which estimates the rate.
///
/// ```
/// use studies::statistics::RareErrors;
/// let mut errors = RareErrors::default();
/// (0..100).for_each(|swarm| errors.push(if swarm % 2 == 0 { 1e-8 } else { 3e-8 }));
/// assert!((errors.rate() - 2e-8).abs() < 1e-16);
/// // The mean of 100 that are off by a half each, one of which goes into the mean itself.
/// assert!((errors.effective_errors() - 99.0 / 0.25).abs() < 1e-6);
/// let [low, high] = errors.interval_95();
/// assert!(1.8e-8 < low && low < 1.82e-8 && 2.2e-8 < high && high < 2.22e-8);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RareErrorsRecord")]
pub struct RareErrors {
    swarms: u64,
    /// Swarms that reached an error.
    errors: u64,
    /// The sum of the estimates.
    sum: f64,
    /// The sum of their squares.
    squares: f64,
}

impl RareErrors {
    /// Adds the estimate of a swarm, 0 to 1.
    pub fn push(&mut self, rate: f64) {
        self.swarms += 1;
        self.errors += u64::from(rate > 0.0);
        self.sum += rate;
        self.squares += rate * rate;
    }

    /// Adds all swarms of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.swarms += other.swarms;
        self.errors += other.errors;
        self.sum += other.sum;
        self.squares += other.squares;
    }

    /// Whether there is no swarm.
    pub fn is_empty(&self) -> bool {
        self.swarms == 0
    }

    /// The number of swarms.
    pub fn swarms(&self) -> u64 {
        self.swarms
    }

    /// The number of swarms that reached an error.
    pub fn errors(&self) -> u64 {
        self.errors
    }

    /// The bit error rate: unbiased; 0 without swarms.
    pub fn rate(&self) -> f64 {
        self.sum / self.swarms.max(1) as f64
    }

    /// The relative variance of the rate; infinite if unknown.
    fn relative_variance(&self) -> f64 {
        if self.swarms < 2 || self.sum <= 0.0 {
            return f64::INFINITY;
        }
        let swarms = self.swarms as f64;
        let scattered = self.squares * swarms / (self.sum * self.sum) - 1.0;
        // Few swarms may agree by chance, which does not make them more certain than the minimum variance.
        let least = least_variance(self.rate()) / (swarms * SWARM as f64);
        (scattered / (swarms - 1.0)).max(least)
    }

    /// The number of independent counted errors with the same uncertainty: one over the relative variance of the rate. At most one per
    /// initial frame of the swarms.
    pub fn effective_errors(&self) -> f64 {
        1.0 / self.relative_variance()
    }

    /// The 95 % interval of the rate.
    ///
    /// Swarms are independent, and the logarithm of their mean counts as normally distributed (delta method, with Student's t for the
    /// unknown spread). If estimates scatter as widely as for rates of 10⁻⁸, the interval holds the truth in 90 % of all runs of 30 swarms,
    /// and in 93 % from 150 on. Swarms that agree more closely than their frames allow do so by chance, and get the least variance of these
    /// frames. With fewer than two swarms, or none that reached an error, it is 0 to 1.
    pub fn interval_95(&self) -> [f64; 2] {
        let variance = self.relative_variance();
        if variance.is_infinite() {
            return [0.0, 1.0];
        }
        let rate = self.rate();
        let reach = (student_97_5((self.swarms - 1) as f64) * variance.sqrt()).exp();
        [rate / reach, (rate * reach).min(1.0)]
    }
}

/// The least relative variance of a rate from one frame: each level counted among independent frames, one in [`RARER`] of them above it.
/// From a rate of 1/[`RARER`] on that is counting. A frame counts as at most one error.
fn least_variance(rate: f64) -> f64 {
    let rarer = RARER as f64;
    let levels = (-rate.ln() / rarer.ln()).floor();
    let counted = |part: f64| (1.0 - part) / part;
    let all = levels * counted(1.0 / rarer) + counted(rate * rarer.powf(levels));
    all.max(1.0)
}

/// The file format.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RareErrorsRecord {
    swarms: u64,
    errors: u64,
    sum: f64,
    squares: f64,
}

/// Sums that no swarms can have.
#[derive(Debug, thiserror::Error)]
#[error(
    "{} swarms, {} of which reached errors, with rates that sum to {} and squares to {}: squares are at most the rates, these the \
     errors, these the swarms, these {MOST_SWARMS}; the file is damaged",
    .0.swarms, .0.errors, .0.sum, .0.squares
)]
struct Impossible(RareErrorsRecord);

/// The most swarms in a file.
const MOST_SWARMS: u64 = MOST_FRAMES / SWARM as u64;

impl TryFrom<RareErrorsRecord> for RareErrors {
    type Error = Impossible;

    fn try_from(written: RareErrorsRecord) -> Result<Self, Impossible> {
        let RareErrorsRecord {
            swarms,
            errors,
            sum,
            squares,
        } = written;
        // Rates are 0 to 1, and 0 if no error was reached. Rounding keeps the order.
        let is_possible = 0.0 <= squares && squares <= sum && sum <= errors as f64 && errors <= swarms && swarms <= MOST_SWARMS;
        if !is_possible {
            return Err(Impossible(written));
        }
        Ok(Self {
            swarms,
            errors,
            sum,
            squares,
        })
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, LogNormal};

    use super::*;
    use sim::random::{Purpose, stream};

    /// The number of 2000 runs whose interval holds the truth, for lognormal estimates with a deviation of one.
    fn held(swarms: u64) -> u64 {
        let random = &mut stream(1, swarms, Purpose::Resampling);
        // Mean 1e-8.
        let estimates = LogNormal::new(1e-8f64.ln() - 0.5, 1.0).unwrap();
        let mut holds = || {
            let mut errors = RareErrors::default();
            (0..swarms).for_each(|_| errors.push(estimates.sample(random)));
            let [low, high] = errors.interval_95();
            u64::from(low <= 1e-8 && 1e-8 <= high)
        };
        (0..2000).map(|_| holds()).sum()
    }

    #[test]
    fn intervals_hold_the_truth_as_often_as_is_stated() {
        // Four deviations of a count of 2000.
        assert!(held(30).abs_diff(1800) < 54, "{}", held(30));
        assert!(held(150).abs_diff(1860) < 46, "{}", held(150));
    }

    #[test]
    fn what_tells_nothing_claims_nothing() {
        let mut errors = RareErrors::default();
        assert_eq!(errors.interval_95(), [0.0, 1.0]);
        errors.push(0.0);
        errors.push(0.0);
        assert_eq!((errors.rate(), errors.effective_errors()), (0.0, 0.0));
        assert_eq!(errors.interval_95(), [0.0, 1.0]);
    }

    #[test]
    fn swarms_that_agree_by_chance_claim_no_more_than_their_frames_could_tell() {
        for rate in [1.0, 0.4375, 0.2, 0.1, 1e-3, 1e-8, 1e-20] {
            for swarms in 2..9 {
                let mut errors = RareErrors::default();
                (0..swarms).for_each(|_| errors.push(rate));
                let frames = (swarms * SWARM as u64) as f64;
                let effective = errors.effective_errors();
                assert!(0.0 < effective && effective <= frames, "{rate}: {effective} of {frames}");
                let [low, high] = errors.interval_95();
                assert!(low < rate && rate <= high, "{rate}: {low} to {high}");
                // Without a level before the error, splitting is counting.
                if rate >= 0.2 {
                    let of_count = ((1.0 - rate) / rate / frames).sqrt();
                    let reach = (rate / low).ln();
                    assert!(reach > 1.96 * of_count, "{rate}: {low} to {high}");
                    assert!((high / rate).ln() > 1.96 * of_count || high == 1.0);
                }
            }
        }
    }

    #[test]
    fn sums_that_no_swarms_leave_are_refused() {
        let read = |swarms: &str, errors: &str, sum: &str, squares: &str| {
            let text = format!(r#"{{"swarms":{swarms},"errors":{errors},"sum":{sum},"squares":{squares}}}"#);
            serde_json::from_str::<RareErrors>(&text)
        };
        let mut errors = RareErrors::default();
        (0..7).for_each(|swarm| errors.push(0.1 * f64::from(swarm)));
        let text = serde_json::to_string(&errors).unwrap();
        assert_eq!(serde_json::from_str::<RareErrors>(&text).unwrap(), errors);
        assert!(read("3", "2", "0.5", "0.25").is_ok());
        for [swarms, errors, sum, squares] in [
            ["18446744073709551615", "1", "0.5", "0.25"],
            ["3", "4", "0.5", "0.25"],
            ["3", "2", "2.5", "0.25"],
            ["3", "2", "-0.5", "0.25"],
            ["3", "2", "0.5", "0.75"],
            ["3", "2", "0.5", "-0.25"],
        ] {
            let fault = read(swarms, errors, sum, squares).map_err(|fault| fault.to_string());
            assert!(fault.as_ref().is_err_and(|text| text.contains("damaged")), "{fault:?}");
        }
    }
}
