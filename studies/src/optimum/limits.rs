//! The limits of any search for a ratio.

use super::{FRAMES_MIN, RANGE_MAX};

/// An invalid search.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SearchError {
    /// The range is invalid.
    #[error("the range of L2A is {low} to {high}: it must ascend and lie within {} to {}", RANGE_MAX[0], RANGE_MAX[1])]
    Range {
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// Too few frames.
    #[error("{frames} frames are too few for an uncertainty: give at least {FRAMES_MIN}")]
    Frames {
        /// The requested number.
        frames: u64,
    },
    /// The tolerance is invalid.
    #[error("the tolerance is {tolerance}: it must be 0 (use all frames) or above")]
    Tolerance {
        /// The tolerance.
        tolerance: f64,
    },
}

/// Checks a search over these ratios, with `frames` at each, to this tolerance.
///
/// # Errors
/// The first invalid setting.
pub(crate) fn check_limits([low, high]: [f64; 2], frames: u64, tolerance: f64) -> Result<(), SearchError> {
    let within = |ratio| (RANGE_MAX[0]..=RANGE_MAX[1]).contains(&ratio);
    if !within(low) || !within(high) || low >= high {
        return Err(SearchError::Range { low, high });
    }
    if frames < FRAMES_MIN {
        return Err(SearchError::Frames { frames });
    }
    if tolerance >= 0.0 {
        Ok(())
    } else {
        Err(SearchError::Tolerance { tolerance })
    }
}
