//! Work-precision diagrams: what was measured, as data.

use serde::{Deserialize, Serialize};

use super::quartiles::Quartiles;

/// What stands for none where a share is shown on a logarithmic axis: half of one.
pub(super) const NONE: f64 = 0.5;

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

/// One variant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Its name.
    pub variant: String,
    /// The curve it is on, a variant with a knob that is turned; empty for one that stands alone.
    pub curve: String,
    /// Its error.
    pub error: f64,
    /// Its root mean square, where `error` is the greatest.
    pub rms: Option<f64>,
    /// The 95 % interval of an error that was sampled.
    pub error_95: Option<[f64; 2]>,
    /// Whether the error is a bound, and no value: it is at most `error`.
    pub at_most: bool,
    /// What it costs.
    pub cost: Quartiles,
    /// The same over the baseline's, turn by turn.
    pub ratio: Quartiles,
    /// Whether it is what costs are divided by.
    pub is_baseline: bool,
    /// Whether it is what the project does unless told otherwise.
    pub is_default: bool,
    /// Whether no other is at least as good in both error and cost, and better in one.
    pub on_front: bool,
    /// What else is worth knowing of it; may be empty.
    pub note: String,
}

impl Point {
    /// A variant that stands alone.
    pub fn new(variant: impl Into<String>, error: f64) -> Self {
        Self {
            variant: variant.into(),
            curve: String::new(),
            error,
            rms: None,
            error_95: None,
            at_most: false,
            cost: Quartiles::default(),
            ratio: Quartiles::default(),
            is_baseline: false,
            is_default: false,
            on_front: false,
            note: String::new(),
        }
    }

    /// On a curve.
    pub fn on(self, curve: &str) -> Self {
        let curve = curve.into();
        Self { curve, ..self }
    }
}
