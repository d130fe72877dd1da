//! Monte Carlo at many settings: a grid over scene keys and detectors, divided into shards that add up to one run.
//!
//! A [`Sweep`] describes the work: every combination of the grid's values and the detectors is a [`Cell`]. Each cell has its own frames,
//! drawn as in [`crate::monte_carlo`], in chunks whose results are added in a fixed order ([`crate::monte_carlo::Accumulator`]). An
//! evaluation of one scene is a sweep of one cell: there is one engine ([`Run`]) and one format of results ([`Results`]).
//!
//! # Shards
//!
//! All chunks of all cells, cell after cell, form a line; a [`Shard`] is a piece of it. Pieces are cut to equal expected times: by the cost
//! of the cell's frames (`sweep/cost.rs`) and, if a run stops at a number of errors, by the number of frames that a first chunk predicts.
//!
//! # Stopping rules and shards
//!
//! A cell ends with the block (see [`crate::monte_carlo::Accumulator`]) in which its bit errors, counted from its first chunk on, reach a
//! number, or with its last frame. This alone determines the chunks of the result, independent of who computed them and when. A shard with
//! only a part of a cell cannot know whether earlier parts have enough already. It therefore computes its own part until that alone has
//! enough, and [`Results::merge`] followed by [`Results::finish`] drops the chunks beyond the end. The dropped chunks are the price: at
//! most, for each further shard of a cell, as many as the cell needed.
//!
//! A run stopped at a number of errors r overestimates the rate by about one part in r (Haldane 1945). Applying the rule at the ends of
//! blocks only reduces this.
//!
//! ```
//! use studies::sweep::{Results, Run, Shard, Sweep};
//! let sweep = Sweep::from_toml("a plan", "frames = 600\n[grid]\npose.distance_m = [50, 60]", &[])?.sweep;
//! let run = |shard| {
//!     let mut results = Results::new(sweep.clone());
//!     Run::new(&sweep, shard, None)?.advance(&mut results, |_| true)?;
//!     Ok::<_, studies::sweep::SweepError>(results)
//! };
//! let whole = run(Shard::WHOLE)?;
//! let mut parts = run(Shard::new(0, 2)?)?;
//! parts.merge(&run(Shard::new(1, 2)?)?)?;
//! assert_eq!(parts.finish()?, whole);
//! assert_eq!(whole.total(0).errors.frames(), 600);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cost;
mod description;
mod plan_file;
mod results;
mod run;
mod shard;
mod summary;
#[cfg(test)]
mod tests;

pub use description::{Axis, Cell, MOST_CELLS, MOST_FRAMES, Sweep, SweepError};
pub use plan_file::{Division, EXAMPLE, PlanError, PlanFile};
pub use results::{Results, ResultsError};
pub use run::{Run, SweepProgress};
pub use shard::{MOST_SHARDS, Partition, Shard, ShardError, Work};
pub use summary::Summary;
