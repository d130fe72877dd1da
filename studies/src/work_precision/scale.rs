//! The amount of measurement.

use serde::{Deserialize, Serialize};

/// The amount of work for a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Turns of every variant.
    pub turns: usize,
    /// The share of a full measurement's frames and blocks, 0 to 1.
    pub share: f64,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Scale {
    /// For results.
    pub const FULL: Self = Self {
        turns: 15,
        share: 1.0,
        seed: 1,
    };
    /// For a first look.
    pub const QUICK: Self = Self {
        turns: 5,
        share: 0.1,
        seed: 1,
    };
    /// For tests: errors are those of few frames, times are meaningless.
    pub const TINY: Self = Self {
        turns: 1,
        share: 0.02,
        seed: 1,
    };

    /// The scale's share of `full`, but at least `least`.
    pub(super) fn of(&self, full: usize, least: usize) -> usize {
        ((full as f64 * self.share) as usize).max(least)
    }
}
