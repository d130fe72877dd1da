//! One variant of a diagram: its error and its cost.

use serde::{Deserialize, Serialize};

use super::quartiles::Quartiles;

/// The count for zero on a logarithmic axis: half of one.
const NONE: f64 = 0.5;

/// One variant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Its name.
    pub variant: String,
    /// The curve of a variant with a varied parameter; empty for a single variant.
    pub curve: String,
    /// Its error.
    pub error: f64,
    /// Its root mean square, if `error` is the greatest.
    pub rms: Option<f64>,
    /// The 95 % interval of a sampled error.
    pub error_95: Option<[f64; 2]>,
    /// Whether the error is an upper bound rather than a value.
    pub at_most: bool,
    /// Its cost.
    pub cost: Quartiles,
    /// Its cost relative to the baseline's, turn by turn.
    pub ratio: Quartiles,
    /// Whether it is the baseline of costs.
    pub is_baseline: bool,
    /// Whether it is the project's default.
    pub is_default: bool,
    /// Whether no other is at least as good in both error and cost, and better in one.
    pub on_front: bool,
    /// A further note; may be empty.
    pub note: String,
}

impl Point {
    /// A single variant.
    pub fn new(variant: impl Into<String>, error: f64) -> Self {
        Self {
            variant: variant.into(),
            error,
            ..Self::default()
        }
    }

    /// A variant whose error is a share of `count`, with its 95 % interval; an upper bound if nothing was wrong.
    pub(super) fn share(variant: impl Into<String>, wrong: f64, count: f64, interval_95: impl FnOnce() -> [f64; 2]) -> Self {
        let at_most = wrong == 0.0;
        Self {
            error_95: (!at_most).then(interval_95),
            at_most,
            ..Self::new(variant, wrong.max(NONE) / count)
        }
    }

    /// The same on a curve.
    pub(super) fn on(self, curve: &str) -> Self {
        let curve = curve.into();
        Self { curve, ..self }
    }

    /// The default, which is the baseline of costs, or another variant.
    pub(super) fn with_default(self, is_default: bool) -> Self {
        Self {
            is_default,
            is_baseline: is_default,
            ..self
        }
    }
}
