//! Work-precision diagrams as data.

use serde::{Deserialize, Serialize};

use super::PARTS;
use super::pareto::mark_front;
use super::point::Point;
use super::scale::Scale;
use super::timing::{Candidate, time_by_turns};

/// A question and its measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its name, a word.
    pub name: String,
    /// Its title.
    pub title: String,
    /// The compared variants and the method, in a few sentences.
    pub method: String,
    /// The reference of the errors, and how much tighter it is.
    pub reference: String,
    /// The measurement.
    pub diagrams: Vec<Diagram>,
}

impl Part {
    /// The default among the variants, and the reason; empty for a part that this program does not know.
    ///
    /// The text is computed from the points, so that it can be reworded without measuring again.
    pub fn default_choice(&self) -> String {
        let known = PARTS.iter().find(|known| known.name == self.name);
        known.map_or_else(String::new, |known| (known.why)(&self.diagrams))
    }
}

/// Error against cost of equivalent variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagram {
    /// Its difference from the others of its part.
    pub title: String,
    /// The kind of error, without its unit.
    pub error: String,
    /// The error's unit; empty for a pure number.
    pub error_unit: String,
    /// The kind of cost.
    pub cost: String,
    /// The cost's unit.
    pub cost_unit: CostUnit,
    /// The variants.
    pub points: Vec<Point>,
}

impl Diagram {
    /// Errors, in their unit, against the time of `cost`, for variants with interleaved timing.
    pub(super) fn timed(
        title: impl Into<String>,
        error: [&str; 2],
        cost: impl Into<String>,
        variants: Vec<Candidate>,
        scale: &Scale,
    ) -> Self {
        Self::of(title, error, cost, time_by_turns(variants, scale.turns))
    }

    /// Errors, in their unit, against the time of `cost`, if both are known.
    pub(super) fn of(title: impl Into<String>, [error, error_unit]: [&str; 2], cost: impl Into<String>, mut points: Vec<Point>) -> Self {
        mark_front(&mut points);
        Self {
            title: title.into(),
            error: error.into(),
            error_unit: error_unit.into(),
            cost: cost.into(),
            cost_unit: CostUnit::Ns,
            points,
        }
    }
}

/// The unit of costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CostUnit {
    /// Nanoseconds on this machine.
    Ns,
    /// Instructions of an emulated processor: exact, the same on every machine.
    Instructions,
    /// Cycles of an emulated processor.
    Cycles,
}
