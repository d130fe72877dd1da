//! What accuracy costs in time: work-precision diagrams of everything that has more than one way to be done.
//!
//! A [`Part`] asks one question. Its [`Diagram`]s hold [`Point`]s: variants with their error against a reference that is
//! solved far tighter, and their cost. A point on the [front](mark_front) is one that no other beats in both. All of a diagram's variants are [timed](time_by_turns) by
//! turns in the same run, and as multiples of one of them, its baseline: the numbers hold on other machines too, and
//! a machine that is busy does not choose whom it disturbs. After Rackauckas & Nie 2017, whose `WorkPrecisionSet` shows differential
//! equation solvers that way.
//!
//! ```
//! use studies::work_precision::{PARTS, Scale};
//! let decoder = PARTS.iter().find(|part| part.name == "decoder").expect("a part");
//! let part = (decoder.measure)(&Scale::TINY)?;
//! assert!(part.diagrams.iter().all(|diagram| diagram.points.iter().any(|point| point.on_front)));
//! # Ok::<(), studies::work_precision::PrecisionError>(())
//! ```

mod counts;
mod decoder;
mod detectors;
mod diagram;
mod effects;
mod error;
mod locator;
mod monte_carlo;
mod numbers;
mod pareto;
mod quartiles;
mod renderer;
mod scale;
mod timing;
mod transmitter;

pub use counts::rows as counted_rows;
pub use detectors::{PLACES, scene_at};
pub use diagram::{CostUnit, Diagram, Part, Point};
pub use error::PrecisionError;
pub use pareto::mark_front;
pub use quartiles::Quartiles;
pub use scale::Scale;
pub use timing::{Candidate, time_by_turns};

/// A part that can be measured.
pub struct Measurable {
    /// Its name, a word.
    pub name: &'static str,
    /// Measures it.
    pub measure: fn(&Scale) -> Result<Part, PrecisionError>,
}

/// All parts.
pub const PARTS: [Measurable; 7] = [
    Measurable {
        name: "renderer",
        measure: renderer::measure,
    },
    Measurable {
        name: "effects",
        measure: effects::measure,
    },
    Measurable {
        name: "monte-carlo",
        measure: monte_carlo::measure,
    },
    Measurable {
        name: "detectors",
        measure: detectors::measure,
    },
    Measurable {
        name: "locator",
        measure: locator::measure,
    },
    Measurable {
        name: "transmitter",
        measure: transmitter::measure,
    },
    Measurable {
        name: "decoder",
        measure: decoder::measure,
    },
];
