//! Monte Carlo at one setting: the distinguishability of On and Off, and the bit error rate.
//!
//! Every frame has random bits, a random sub-pixel phase and, optionally, a random reflectance, all drawn from the frame's own stream.
//! Frames are processed in fixed chunks whose results are added in a fixed order, so that the result does not depend on threads, shards or
//! interruptions.
//!
//! ```
//! use sim::scene::Scene;
//! use studies::detectors::DetectorChoice;
//! use studies::monte_carlo::{Evaluator, Settings};
//! let settings = Settings { random_reflectance: false, ..Settings::fast(256, 1, DetectorChoice::KMeans) };
//! let evaluation = Evaluator::new(&Scene::load("paper", &[])?, settings)?.run(|_| true)?;
//! assert_eq!(evaluation.errors.frames(), 256);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod accumulator;
mod carrier;
mod error;
mod evaluation;
mod evaluator;
mod frame_source;
mod observation;

pub use accumulator::{Accumulator, AccumulatorError, ChunkProgress};
pub use error::EvaluateError;
pub use evaluation::{CHUNK, Evaluation, chunks};
pub use evaluator::{Evaluator, REFLECTANCES, Settings, Workspace, receiving_method, view};
pub use frame_source::{FrameSource, LabelledFrame, Labels, Tally};
pub use observation::Observation;
pub(crate) use observation::{PANEL_PIXELS, measure};
