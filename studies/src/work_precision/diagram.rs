//! Work-precision diagrams: what was measured, as data.

use serde::{Deserialize, Serialize};

use super::pareto::mark_front;
use super::point::Point;
use super::scale::Scale;
use super::timing::{Candidate, time_by_turns};

/// A question and what was measured to answer it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its name, a word.
    pub name: String,
    /// Its title.
    pub title: String,
    /// What was compared, and how; a few sentences.
    pub method: String,
    /// What the errors are taken against, and how much tighter that is.
    pub reference: String,
    /// The default among the variants, and why it is that.
    pub default: String,
    /// What was measured.
    pub diagrams: Vec<Diagram>,
}

/// Error against cost of variants that do the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagram {
    /// What sets it apart from the others of its part.
    pub title: String,
    /// What the error is, without its unit.
    pub error: String,
    /// The error's unit; empty for a pure number.
    pub error_unit: String,
    /// What the cost is of.
    pub cost: String,
    /// The cost's unit.
    pub cost_unit: CostUnit,
    /// The variants.
    pub points: Vec<Point>,
}

impl Diagram {
    /// Errors, in their unit, against the time of `cost`, of variants that are timed by turns.
    pub(super) fn timed(
        title: impl Into<String>,
        error: [&str; 2],
        cost: impl Into<String>,
        variants: Vec<Candidate>,
        scale: &Scale,
    ) -> Self {
        Self::of(title, error, cost, time_by_turns(variants, scale.turns))
    }

    /// Errors, in their unit, against the time of `cost`, where both are known.
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

/// What costs are counted in.
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
