//! Counted bit errors, and the interval of their rate.

use rand::Rng;
use rand_distr::{Binomial, Distribution};
use serde::{Deserialize, Serialize};

use super::MOST_FRAMES;
use super::proportion::wilson_95;
use sim::random::{Purpose, stream};

/// Bit errors by frame: how many frames had 0, 1, … 64 of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<u64>", into = "Vec<u64>")]
pub struct FrameErrors([u64; 65]);

impl Default for FrameErrors {
    fn default() -> Self {
        Self([0; 65])
    }
}

impl From<FrameErrors> for Vec<u64> {
    /// Without the zeros at the end.
    fn from(errors: FrameErrors) -> Self {
        let used = errors.0.iter().rposition(|&frames| frames > 0);
        errors.0[..used.map_or(0, |last| last + 1)].to_vec()
    }
}

impl TryFrom<Vec<u64>> for FrameErrors {
    type Error = String;

    fn try_from(counts: Vec<u64>) -> Result<Self, String> {
        let mut errors = Self::default();
        let place = errors.0.get_mut(..counts.len()).ok_or_else(|| {
            format!(
                "{} counts of bit errors where a frame has at most 64: the file is damaged",
                counts.len()
            )
        })?;
        place.copy_from_slice(&counts);
        let sum = counts.iter().try_fold(0u64, |sum, &n| sum.checked_add(n));
        if sum.is_none_or(|frames| frames > MOST_FRAMES) {
            return Err(format!("more than {MOST_FRAMES} frames are counted: the file is damaged"));
        }
        Ok(errors)
    }
}

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

impl FrameErrors {
    /// Takes a frame with so many bit errors (more than 64 count as 64).
    pub fn push(&mut self, errors: u32) {
        self.0[(errors as usize).min(64)] += 1;
    }

    /// Takes all frames of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(own, others)| *own += others);
    }

    /// Without the frames of `part`; none if it is no part of them.
    pub fn without(&self, part: &Self) -> Option<Self> {
        let mut rest = *self;
        for (own, part) in rest.0.iter_mut().zip(part.0) {
            *own = own.checked_sub(part)?;
        }
        Some(rest)
    }

    /// Frames taken.
    pub fn frames(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Bits of those frames.
    pub fn bits(&self) -> u64 {
        64 * self.frames()
    }

    /// Bit errors in all.
    pub fn errors(&self) -> u64 {
        self.0.iter().zip(0..).map(|(frames, errors)| frames * errors).sum()
    }

    /// Frames with any error.
    pub fn wrong_frames(&self) -> u64 {
        self.frames() - self.0[0]
    }

    /// The share of frames with any error, 0 of none, and its 95 % interval (Wilson 1927), 0 to 1 of none.
    ///
    /// ```
    /// use studies::statistics::FrameErrors;
    /// let mut errors = FrameErrors::default();
    /// [0, 3, 0, 0].into_iter().for_each(|wrong| errors.push(wrong));
    /// let (rate, [low, high]) = errors.frame_error_rate();
    /// assert!(rate == 0.25 && 0.04 < low && low < 0.05 && 0.69 < high && high < 0.71);
    /// ```
    pub fn frame_error_rate(&self) -> (f64, [f64; 2]) {
        let (wrong, frames) = (self.wrong_frames() as f64, self.frames() as f64);
        if frames == 0.0 {
            return (0.0, [0.0, 1.0]);
        }
        (wrong / frames, wilson_95(wrong, frames))
    }

    /// Bit error rate; 0 of no frames.
    pub fn rate(&self) -> f64 {
        self.errors() as f64 / self.bits().max(1) as f64
    }

    /// The 95 % interval of the bit error rate.
    ///
    /// The bits of a frame share phase, reflectance and noise level, so whole frames are resampled (percentiles of the cluster
    /// bootstrap). Where no error was seen the upper end is 3/frames, the 95 % bound of the frame error rate, which the bit
    /// error rate cannot exceed. Without frames nothing is known: 0 to 1.
    pub fn interval_95(&self) -> [f64; 2] {
        let frames = self.frames();
        if frames == 0 {
            return [0.0, 1.0];
        }
        if self.errors() == 0 {
            return [0.0, (3.0 / frames as f64).min(1.0)];
        }
        let mut random = stream(0, frames, Purpose::Resampling);
        let mut rates: Vec<f64> = (0..RESAMPLES).map(|_| self.resampled_rate(&mut random)).collect();
        rates.sort_by(f64::total_cmp);
        [rates[RESAMPLES / 40], rates[RESAMPLES - 1 - RESAMPLES / 40]]
    }

    /// The rate of as many frames drawn from these with replacement: a multinomial draw, one binomial a bin.
    fn resampled_rate(&self, random: &mut impl Rng) -> f64 {
        let frames = self.frames();
        let (mut left_to_draw, mut left_in_bins, mut errors) = (frames, frames, 0);
        for (&count, of_each) in self.0.iter().zip(0..).filter(|(count, _)| **count > 0) {
            let share = count as f64 / left_in_bins as f64;
            let drawn = Binomial::new(left_to_draw, share.min(1.0)).map_or(left_to_draw, |b| b.sample(random));
            errors += drawn * of_each;
            left_to_draw -= drawn;
            left_in_bins -= count;
        }
        errors as f64 / (64 * frames) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_errors_are_a_bound_and_not_a_zero() {
        let mut errors = FrameErrors::default();
        (0..300).for_each(|_| errors.push(0));
        assert_eq!(errors.interval_95(), [0.0, 0.01]);
    }

    #[test]
    fn errors_that_come_together_widen_the_interval() {
        let (mut spread, mut clustered) = (FrameErrors::default(), FrameErrors::default());
        for frame in 0..1000 {
            spread.push(u32::from(frame % 10 == 0));
            clustered.push(if frame % 100 == 0 { 10 } else { 0 });
        }
        assert_eq!(spread.errors(), clustered.errors());
        let width = |e: &FrameErrors| e.interval_95()[1] - e.interval_95()[0];
        // Binomial of frames: √10 times as wide.
        let ratio = width(&clustered) / width(&spread);
        assert!((2.4..4.2).contains(&ratio), "{ratio}");
        let [low, high] = spread.interval_95();
        let deviation = (0.1f64 * 0.9 / 1000.0).sqrt() / 64.0;
        assert!((high - low - 3.92 * deviation).abs() < 0.8 * deviation, "{low} to {high}");
    }
}
