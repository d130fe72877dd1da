//! Statistics that take one value at a time, merge, and stay exact: memory does not grow with the number of frames.
//!
//! [`Moments`] and [`Distinguishability`] are for features, [`FrameErrors`] for bits counted frame by frame, [`RareErrors`] for bits
//! reached by splitting, [`Reliability`] for bits by their reported certainty. [`jackknife`] gives an interval to any function of batches.

mod distinguishability;
mod frame_errors;
mod jackknife;
mod moments;
mod proportion;
mod rare_errors;
mod ratio;
mod reliability;
mod student;
mod symbol_changes;

pub use distinguishability::{COLLINEAR, Distinguishability};
pub use frame_errors::FrameErrors;
pub use jackknife::{BATCHES, Estimate, jackknife};
pub use moments::Moments;
pub use proportion::{mean_95, share_95};
pub use rare_errors::RareErrors;
pub(crate) use rare_errors::{RARER, SWARM};
pub use ratio::ratio_95;
pub use reliability::{Bin, Reliability};
pub(crate) use student::student_97_5;
pub use symbol_changes::SymbolChanges;

/// The most frames in a file, so that no sum overflows.
const MOST_FRAMES: u64 = 1 << 48;
