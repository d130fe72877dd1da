//! The description of a sweep: a scene, a grid over its keys, detectors, and the amount of work.

use std::collections::BTreeSet;

use link::camera::Camera;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Settings, chunks};
use crate::stop::Stop;
use sim::accuracy::Level;
use sim::scene::{Scene, SceneError, parse_value};

/// The most frames of a cell: at 100 000 a second, four months.
pub const MOST_FRAMES: u64 = 1_000_000_000_000;
/// The most cells of a sweep.
pub const MOST_CELLS: usize = 100_000;

/// All that the results of a sweep depend on, except the program's version.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// The scene with the values that the grid does not vary.
    pub scene: Scene,
    /// The varied keys, the slowest first; empty for a sweep of one scene.
    pub grid: Vec<Axis>,
    /// The detectors; they vary fastest.
    pub detectors: Vec<DetectorChoice>,
    /// Frames of a cell, at most; 1 to [`MOST_FRAMES`].
    pub frames: u64,
    /// Bit errors at which a cell has enough, or swarms that reached one; `None`: all frames are done.
    pub stop_errors: Option<u64>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Whether each frame's reflectance is drawn at random.
    pub random_reflectance: bool,
    /// The accuracy of frames.
    pub level: Level,
    /// Whether errors are reached by splitting ([`crate::splitting`]) instead of counted; frames are then the initial ones of swarms, in
    /// whole swarms.
    pub rare_events: bool,
    /// The receivers' camera settings; `None`: those of each scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
}

/// One key of a scene and its values, in the form of `--set KEY=`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The key, such as `pose.distance_m`.
    pub key: String,
    /// Its values.
    pub values: Vec<String>,
}

/// One combination of the grid's values and the detectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Its number.
    pub index: usize,
    /// A value for each axis.
    pub values: Vec<String>,
    /// The detector.
    pub detector: DetectorChoice,
}

/// An invalid sweep.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// An axis has no values.
    #[error("the grid's key {key} has no values: give at least one, such as {key} = [1, 2], or remove the key")]
    EmptyAxis {
        /// Its key.
        key: String,
    },
    /// A value is repeated.
    #[error("the grid's key {key} has the value {value} twice: give each once")]
    Doubled {
        /// Its key.
        key: String,
        /// The value.
        value: String,
    },
    /// There are no detectors.
    #[error("there are no detectors: give at least one, such as detectors = [\"kmeans\"]")]
    NoDetectors,
    /// The same detector twice.
    #[error("the detector {0} is listed twice: give each once")]
    DoubledDetector(&'static str),
    /// Too many combinations.
    #[error("the grid has more than {MOST_CELLS} cells: divide it into several plans")]
    TooManyCells,
    /// No frames, or too many.
    #[error("frames = {0}: give 1 to {MOST_FRAMES}")]
    Frames(u64),
    /// A stopping rule that holds at the start.
    #[error("stop.errors = 0: give 1 or more, or remove the rule to evaluate all frames")]
    NoErrors,
    /// A level for single frames only.
    #[error("level = \"reference\" is for single frames (vocc render): choose fine or fast")]
    Level,
    /// A cell's scene is invalid.
    #[error("cell {cell}: {source}")]
    Scene {
        /// The cell and its values.
        cell: String,
        /// The cause.
        source: Box<SceneError>,
    },
    /// A cell cannot be evaluated.
    #[error("cell {cell}: {source}")]
    Evaluate {
        /// The cell and its values.
        cell: String,
        /// The cause.
        source: Box<EvaluateError>,
    },
}

impl SweepError {
    /// Why a cell stays empty while others need not: its frames cannot be read. `None` if the sweep cannot continue.
    pub(super) fn why_empty(&self) -> Option<String> {
        match self {
            Self::Evaluate { source, .. } if source.is_of_what_is_seen() => Some(source.to_string()),
            _ => None,
        }
    }

    /// Whether the work was stopped.
    pub(super) fn is_stop(&self) -> bool {
        matches!(self, Self::Evaluate { source, .. } if matches!(**source, EvaluateError::Stopped))
    }
}

impl Sweep {
    /// An evaluation of one scene as a sweep of one cell.
    pub fn single(scene: Scene, settings: &Settings) -> Self {
        Self {
            scene,
            grid: Vec::new(),
            detectors: vec![settings.detector],
            frames: settings.frames,
            stop_errors: None,
            seed: settings.seed,
            random_reflectance: settings.random_reflectance,
            level: settings.level,
            rare_events: false,
            camera: settings.camera,
        }
    }

    /// Checks the description, and that any cell's scene can be seen; returns the cost of a frame of each, in ns, 0 for an unseen one.
    ///
    /// # Errors
    /// The fault, and its cell.
    pub fn check(&self) -> Result<Vec<f64>, SweepError> {
        self.check_description()?;
        let mut unseen = None;
        let cost = |index| match self.frame_cost(index) {
            Err(fault) if fault.why_empty().is_some() => {
                unseen.get_or_insert(fault);
                Ok(0.0)
            }
            known => known,
        };
        let costs = (0..self.cells()).map(cost).collect::<Result<Vec<f64>, SweepError>>()?;
        match unseen.filter(|_| costs.iter().all(|&cost| cost == 0.0)) {
            Some(fault) => Err(fault),
            None => Ok(costs),
        }
    }

    pub(super) fn check_description(&self) -> Result<(), SweepError> {
        for Axis { key, values } in &self.grid {
            if values.is_empty() {
                return Err(SweepError::EmptyAxis { key: key.clone() });
            }
            if let Some(value) = first_doubled(values, |text| meaning(&parse_value(text))) {
                let (key, value) = (key.clone(), value.clone());
                return Err(SweepError::Doubled { key, value });
            }
        }
        if self.detectors.is_empty() {
            return Err(SweepError::NoDetectors);
        }
        if let Some(choice) = first_doubled(&self.detectors, |choice| choice.name()) {
            return Err(SweepError::DoubledDetector(choice.name()));
        }
        let lengths = self.grid.iter().map(|axis| axis.values.len());
        let cells = lengths.fold(self.detectors.len(), usize::saturating_mul);
        if cells > MOST_CELLS {
            return Err(SweepError::TooManyCells);
        }
        if !(1..=MOST_FRAMES).contains(&self.frames) {
            return Err(SweepError::Frames(self.frames));
        }
        if self.stop_errors == Some(0) {
            return Err(SweepError::NoErrors);
        }
        if self.level == Level::Reference {
            return Err(SweepError::Level);
        }
        Ok(())
    }

    /// The number of cells.
    pub fn cells(&self) -> usize {
        let lengths = self.grid.iter().map(|axis| axis.values.len());
        lengths.product::<usize>() * self.detectors.len()
    }

    /// Chunks of a cell, at most.
    pub fn chunks(&self) -> u64 {
        chunks(self.frames)
    }

    /// Cell `index`, which must be below [`Sweep::cells`].
    pub fn cell(&self, index: usize) -> Cell {
        let mut left = index / self.detectors.len();
        let mut values: Vec<String> = self
            .grid
            .iter()
            .rev()
            .map(|axis| {
                let value = axis.values[left % axis.values.len()].clone();
                left /= axis.values.len();
                value
            })
            .collect();
        values.reverse();
        Cell {
            index,
            values,
            detector: self.detectors[index % self.detectors.len()],
        }
    }

    /// Cell `index` in words: its number, keys, values and detector.
    pub fn name_of(&self, index: usize) -> String {
        let cell = self.cell(index);
        let keys = self.grid.iter().zip(&cell.values);
        let settings = keys.map(|(axis, value)| format!("{}={value}, ", axis.key));
        format!("{index} ({}{})", settings.collect::<String>(), cell.detector.name())
    }

    /// The scene of cell `index`.
    ///
    /// # Errors
    /// If the grid's values do not make a valid one.
    pub fn scene_of(&self, index: usize) -> Result<Scene, SweepError> {
        let cell = self.cell(index);
        let overrides: Vec<String> = self
            .grid
            .iter()
            .zip(&cell.values)
            .map(|(axis, value)| format!("{}={value}", axis.key))
            .collect();
        if overrides.is_empty() {
            return Ok(self.scene.clone());
        }
        self.scene.with("the grid", &overrides).map_err(|fault| SweepError::Scene {
            cell: self.name_of(index),
            source: Box::new(fault),
        })
    }

    /// The settings of cell `index`.
    pub fn settings_of(&self, index: usize) -> Settings {
        Settings {
            frames: self.frames,
            seed: self.seed,
            random_reflectance: self.random_reflectance,
            detector: self.cell(index).detector,
            level: self.level,
            camera: self.camera,
            stop: Stop::NEVER,
        }
    }

    /// The error of cell `index`.
    pub(super) fn evaluate_error(&self, index: usize, source: EvaluateError) -> SweepError {
        SweepError::Evaluate {
            cell: self.name_of(index),
            source: Box::new(source),
        }
    }
}

/// The first value whose key equals an earlier one.
fn first_doubled<T, K: Ord>(values: &[T], key: impl Fn(&T) -> K) -> Option<&T> {
    let mut seen = BTreeSet::new();
    values.iter().find(|value| !seen.insert(key(value)))
}

/// A canonical text of a value, the same for 50 and 50.0, which make the same scene.
fn meaning(value: &Value) -> String {
    // Integers are exact here, because larger ones are read as floats. Adding 0 turns −0 into 0.
    let of_number = |number: f64| (number + 0.0).to_string();
    match value {
        Value::Integer(number) => of_number(*number as f64),
        Value::Float(number) => of_number(*number),
        Value::Array(values) => {
            let meanings: Vec<String> = values.iter().map(meaning).collect();
            format!("[{}]", meanings.join(", "))
        }
        other => other.to_string(),
    }
}
