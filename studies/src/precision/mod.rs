//! What accuracy costs in time: work-precision diagrams of everything that has more than one way to be done.
//!
//! A [`Part`] asks one question. Its [`Diagram`]s hold [`Point`]s: variants with their error against a reference that is
//! solved far tighter, and their cost. A point on the [front] is one that no other beats in both. All of a diagram's variants are [timed](race) by
//! turns in the same run, and as multiples of one of them, its baseline: the numbers hold on other machines too, and
//! a machine that is busy does not choose whom it disturbs. After Rackauckas & Nie 2017, whose `WorkPrecisionSet` shows differential
//! equation solvers that way.
//!
//! ```
//! use studies::precision::{PARTS, Scale};
//! let decoder = PARTS.iter().find(|part| part.name == "decoder").expect("a part");
//! let part = (decoder.measure)(&Scale::TINY)?;
//! assert!(part.diagrams.iter().all(|diagram| diagram.points.iter().any(|point| point.on_front)));
//! # Ok::<(), studies::precision::PrecisionError>(())
//! ```

pub mod counts;
mod decoder;
pub mod detectors;
mod effects;
pub mod front;
mod locator;
mod monte_carlo;
pub mod race;
mod renderer;
mod summary;
mod transmitter;

use link::camera::CameraError;
use serde::{Deserialize, Serialize};

use crate::evaluate::EvaluateError;
use crate::precision::race::Spread;
use sim::scene::SceneError;
use sim::view::ViewError;

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
    pub cost: Spread,
    /// The same over the baseline's, turn by turn.
    pub ratio: Spread,
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
            cost: Spread::default(),
            ratio: Spread::default(),
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

/// How much work a measurement is worth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Turns that every variant has.
    pub turns: usize,
    /// The share of a full measurement's frames and blocks, 0 to 1.
    pub share: f64,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Scale {
    /// For results.
    pub const FULL: Self = Self {
        turns: 15,
        share: 1.0,
        seed: 1,
    };
    /// For a first look.
    pub const QUICK: Self = Self {
        turns: 5,
        share: 0.1,
        seed: 1,
    };
    /// For tests: errors are those of few frames, times mean nothing.
    pub const TINY: Self = Self {
        turns: 1,
        share: 0.02,
        seed: 1,
    };

    /// So much of `full`, at least `least`.
    fn of(&self, full: usize, least: usize) -> usize {
        ((full as f64 * self.share) as usize).max(least)
    }
}

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

/// Why something could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum PrecisionError {
    /// A scene is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A frame cannot be measured.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// No camera is like that.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A photograph is none.
    #[error("a photograph that is part of the program is damaged: {0}")]
    Photograph(#[from] image::ImageError),
}

/// What stands for none where a share is shown on a logarithmic axis: half of one.
const NONE: f64 = 0.5;

/// The 95 % interval of a share, of which `hits` of `count` were seen (Wilson 1927).
fn share_95(hits: f64, count: f64) -> [f64; 2] {
    const Z: f64 = 1.96;
    let (share, squared) = (hits / count, Z * Z / count);
    let middle = share + squared / 2.0;
    let reach = Z * ((share * (1.0 - share) + squared / 4.0) / count).sqrt();
    [-1.0, 1.0].map(|sign| (middle + sign * reach) / (1.0 + squared))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_share_is_that_of_the_textbook() {
        // 10 of 100: 0.0552 to 0.1744.
        let [low, high] = share_95(10.0, 100.0);
        assert!(
            (low - 0.0552).abs() < 1e-4 && (high - 0.1744).abs() < 1e-4,
            "{low} {high}"
        );
    }
}
