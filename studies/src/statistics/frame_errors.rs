//! Counted bit errors, and the interval of their rate.

use serde::{Deserialize, Serialize};

use super::MOST_FRAMES;
use super::proportion::{mean_95, share_95};

/// Bit errors by frame: the numbers of frames with 0, 1, … 64 of them.
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

impl FrameErrors {
    /// Adds a frame with its bit errors (more than 64 count as 64).
    pub fn push(&mut self, errors: u32) {
        self.0[(errors as usize).min(64)] += 1;
    }

    /// Adds all frames of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0).for_each(|(own, others)| *own += others);
    }

    /// Without the frames of `part`; `None` if they are not all included.
    pub fn without(&self, part: &Self) -> Option<Self> {
        let mut rest = *self;
        for (own, part) in rest.0.iter_mut().zip(part.0) {
            *own = own.checked_sub(part)?;
        }
        Some(rest)
    }

    /// The number of frames.
    pub fn frames(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Bits of those frames.
    pub fn bits(&self) -> u64 {
        64 * self.frames()
    }

    /// The number of bit errors.
    pub fn errors(&self) -> u64 {
        self.0.iter().zip(0..).map(|(frames, errors)| frames * errors).sum()
    }

    /// Frames with any error.
    pub fn wrong_frames(&self) -> u64 {
        self.frames() - self.0[0]
    }

    /// The share of frames with any error, 0 without frames, and its 95 % interval ([`share_95`]), 0 to 1 without frames.
    ///
    /// ```
    /// use studies::statistics::FrameErrors;
    /// let mut errors = FrameErrors::default();
    /// [0, 3, 0, 0].into_iter().for_each(|wrong| errors.push(wrong));
    /// let (rate, [low, high]) = errors.frame_error_rate();
    /// assert!(rate == 0.25 && low < 0.01 && 0.8 < high && high < 0.82);
    /// ```
    pub fn frame_error_rate(&self) -> (f64, [f64; 2]) {
        let (wrong, frames) = (self.wrong_frames() as f64, self.frames() as f64);
        (wrong / frames.max(1.0), share_95(wrong, frames))
    }

    /// Bit error rate; 0 without frames.
    pub fn rate(&self) -> f64 {
        self.errors() as f64 / self.bits().max(1) as f64
    }

    /// The 95 % interval of the bit error rate: frames are the units, because their bits may be wrong together ([`mean_95`]). Without
    /// frames it is 0 to 1.
    pub fn interval_95(&self) -> [f64; 2] {
        let counts = self.0.iter().zip(0..).filter(|(frames, _)| **frames > 0);
        let units: Vec<(f64, f64)> = counts.map(|(&frames, wrong)| (f64::from(wrong) / 64.0, frames as f64)).collect();
        mean_95(&units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_errors_are_no_less_than_none() {
        let of = |wrong: &[u32]| {
            let mut errors = FrameErrors::default();
            (0..1000).for_each(|frame| errors.push(wrong.get(frame).copied().unwrap_or(0)));
            errors.interval_95()
        };
        let ([low, none], [_, three]) = (of(&[]), of(&[1, 1, 1]));
        assert!(low == 0.0 && (3.6e-3..3.8e-3).contains(&none) && none <= three, "{none} {three}");
        assert_eq!(FrameErrors::default().interval_95(), [0.0, 1.0]);
    }

    #[test]
    fn errors_that_come_together_widen_the_interval() {
        let (mut spread, mut clustered) = (FrameErrors::default(), FrameErrors::default());
        for frame in 0..1000 {
            spread.push(u32::from(frame % 10 == 0));
            clustered.push(if frame % 100 == 0 { 10 } else { 0 });
        }
        // 2^30 frames, so that one more is negligible.
        for errors in [&mut spread, &mut clustered] {
            (0..20).for_each(|_| errors.merge(&errors.clone()));
        }
        assert_eq!(spread.errors(), clustered.errors());
        let width = |e: &FrameErrors| e.interval_95()[1] - e.interval_95()[0];
        // Binomial of frames: √10 times as wide.
        let ratio = width(&clustered) / width(&spread);
        assert!((3.0..3.4).contains(&ratio), "{ratio}");
        let deviation = (0.1f64 * 0.9 / spread.frames() as f64).sqrt() / 64.0;
        let ratio = width(&spread) / (3.92 * deviation);
        assert!((0.98..1.05).contains(&ratio), "{ratio}");
    }
}
