//! The best LED-to-ambient ratio of a scene: the one that maximises a [`Criterion`].
//!
//! All ratios use the same frames (common random numbers: same bits, phases and reflectances), so that the difference between two of them
//! is known much better than either. A grid over the whole range finds the neighbourhood. For the criteria that are ratios of variances, a
//! finer grid there and a parabola through it give the optimum. For the bit error rate, which is flat and coarse-grained, a parabola is
//! fitted to the log-odds of the wide grid near the minimum.
//!
//! Frames come in rounds of doubling size, 64 batches each. The uncertainty is that of the same fit to bootstrap resamples of the batches;
//! the search ends if it is below the tolerance, or after the last frame.
//!
//! The interval does not cover the deviation of the curve's top from a parabola's. On the finer grid, ±0.1 wide at first, that is about
//! 0.005 at interval 1 and 50 m, by the curve's third derivative; on the wide grid, for the bit error rate, up to about 0.05. A range much
//! narrower than 0.2 to 4 makes the grids finer, and the curve's roughness, due to rounded greys, then widens the interval.

mod criterion;
mod limits;
mod parabola;
mod peak;
mod samples;
mod search;

pub use criterion::Criterion;
pub use limits::SearchError;
pub(crate) use limits::check_limits;
pub(crate) use parabola::Parabola;
pub(crate) use peak::percentiles;
pub(crate) use peak::{Peak, Window};
pub use samples::{FIRST_ROUND, Sample, Samples};
pub(crate) use samples::{PIECE, Piece, RESAMPLES, at_ratio, of_resamples, rounds};
pub use search::optimum;
pub(crate) use search::optimum_from;

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Evaluation, Settings};
use crate::stop::Stop;
use sim::accuracy::Level;

/// The range of ratios of Do & Yoo 2020 (section 3.4.2).
pub const RANGE: [f64; 2] = [0.2, 4.0];
/// The widest range of a search.
pub const RANGE_MAX: [f64; 2] = [0.01, 10.0];
/// The fewest frames of a search.
pub const FRAMES_MIN: u64 = 64;
/// Points of the grid over the whole range.
pub const GRID: usize = 20;

/// The settings of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// The criterion.
    pub criterion: Criterion,
    /// The range of ratios, within [`RANGE_MAX`].
    pub range: [f64; 2],
    /// The most frames at one ratio, at least [`FRAMES_MIN`].
    pub frames: u64,
    /// The search ends if the 95 % interval is no wider than ± this; 0: it uses all frames.
    pub tolerance: f64,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Whether each frame's reflectance is drawn from [`crate::monte_carlo::REFLECTANCES`].
    pub random_reflectance: bool,
    /// The detector whose bit errors are counted.
    pub detector: DetectorChoice,
    /// The accuracy of frames.
    pub level: Level,
    /// The flag that ends the search early, also in the middle of a round.
    pub stop: Stop,
}

impl Default for Search {
    /// The paper's: B2W over 0.2 to 4, 100 000 frames at one ratio, reflectances drawn.
    fn default() -> Self {
        Self {
            criterion: Criterion::B2w,
            range: RANGE,
            frames: 100_000,
            tolerance: 0.0,
            seed: 1,
            random_reflectance: true,
            detector: DetectorChoice::KMeans,
            level: Level::Fast,
            stop: Stop::NEVER,
        }
    }
}

impl Search {
    /// The settings for one ratio.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            frames: self.frames,
            seed: self.seed,
            random_reflectance: self.random_reflectance,
            detector: self.detector,
            level: self.level,
            camera: None,
            stop: self.stop,
        }
    }
}

/// Why there is no optimum.
#[derive(Debug, thiserror::Error)]
pub enum OptimumError {
    /// The search is invalid.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// A ratio cannot be evaluated.
    #[error("at L2A {l2a:.3}: {source}")]
    Evaluate {
        /// The ratio.
        l2a: f64,
        /// The cause.
        source: Box<EvaluateError>,
    },
    /// On and Off LEDs do not vary, or are missing.
    #[error(
        "{} is not defined somewhere in {low} to {high}: On or Off LEDs are missing or do not vary; give more frames or a narrower range",
        criterion.name()
    )]
    Undefined {
        /// The criterion.
        criterion: Criterion,
        /// The lower end of the range.
        low: f64,
        /// The upper end of the range.
        high: f64,
    },
    /// [`Search::stop`] ended the search.
    #[error("interrupted before the optimum was known")]
    Interrupted,
}

/// The best ratio and its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// The best ratio.
    pub l2a: f64,
    /// Its 95 % interval.
    pub l2a_95: [f64; 2],
    /// Whether it is the end of the range: the true one may lie beyond.
    pub at_border: bool,
    /// The criterion's value there, by the fit.
    pub value: f64,
    /// The ratios of the wide grid that are not significantly worse (paired, one-sided, 5 %).
    pub not_worse: [f64; 2],
    /// The result at the ratio next to the best one, among those with the most frames.
    pub evaluation: Evaluation,
    /// All tried ratios, ascending, with their results, from different numbers of frames.
    pub curve: Vec<(f64, Evaluation)>,
    /// Frames at [`Optimum::evaluation`].
    pub frames: u64,
    /// The wide grid, with the same frames at all its points: for comparisons, and for pooling with other scenes.
    pub grid: Samples,
}

impl Optimum {
    /// The criterion at the best ratio relative to that at another, as a factor (for the bit error rate: its odds, inverted), by straight
    /// lines between the wide grid's points. `None` if the criterion is undefined at one of these.
    pub fn loss_at(&self, criterion: Criterion, l2a: f64) -> Option<f64> {
        let best = self.objective_at(criterion, self.l2a)?;
        Some((best - self.objective_at(criterion, l2a)?).exp())
    }

    fn objective_at(&self, criterion: Criterion, l2a: f64) -> Option<f64> {
        let points = self.grid.points();
        let above = points.partition_point(|point| point.l2a < l2a).clamp(1, points.len().max(2) - 1);
        let (Some(low), Some(high)) = (points.get(above - 1), points.get(above)) else {
            return None;
        };
        let share = ((l2a - low.l2a) / (high.l2a - low.l2a)).clamp(0.0, 1.0);
        let of = |point: &Sample| criterion.objective(&point.total());
        let (low, high) = (of(low)?, of(high)?);
        Some(low + share * (high - low))
    }
}

/// The ratio of the least mean bit error rate over several scenes, each with its own optimum: their wide grids pooled.
///
/// `None` if they have fewer than three ratios in common.
pub(crate) fn least_mean_ber(optima: &[&Optimum], search: &Search) -> Option<Peak> {
    let grids: Vec<&Samples> = optima.iter().map(|optimum| &optimum.grid).collect();
    let pooled = Samples::pooled(&grids);
    Peak::of(&pooled, Criterion::Ber, Window::NearHighest, search.range, search.seed)
}
