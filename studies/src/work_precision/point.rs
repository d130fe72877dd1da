//! One variant of a diagram: its error and its cost.

use serde::{Deserialize, Serialize};

use super::quartiles::Quartiles;

/// What stands for none where a share is shown on a logarithmic axis: half of one.
const NONE: f64 = 0.5;

/// One variant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Whether it is the project's default.
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
            error,
            ..Self::default()
        }
    }

    /// One whose error is a share of `count`, with its 95 % interval; where nothing was wrong, a bound.
    pub(super) fn share(variant: impl Into<String>, wrong: f64, count: f64, interval_95: impl FnOnce() -> [f64; 2]) -> Self {
        let at_most = wrong == 0.0;
        Self {
            error_95: (!at_most).then(interval_95),
            at_most,
            ..Self::new(variant, wrong.max(NONE) / count)
        }
    }

    /// On a curve.
    pub(super) fn on(self, curve: &str) -> Self {
        let curve = curve.into();
        Self { curve, ..self }
    }

    /// The default, which the others' costs are divided by, or one of the others.
    pub(super) fn with_default(self, is_default: bool) -> Self {
        Self {
            is_default,
            is_baseline: is_default,
            ..self
        }
    }
}
