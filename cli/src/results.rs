//! The file in which `vocc evaluate` keeps what is finished, and from which `vocc merge` adds up.

use std::path::Path;

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use sim::accuracy::Level;
use sim::detectors::DETECTORS;
use sim::evaluate::{self, Settings, chunks};
use sim::plan::Plan;
use sim::scene::Scene;
use sim::tally::Tally;
use sim::view::View;

use crate::output;
use crate::pictures::write_aside;

/// The version of the file's format.
const FORMAT: u32 = 1;

/// What was evaluated, and the sums of the chunks that are finished.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// What the sums belong to: they may be added to those of the same run only.
    pub run: Run,
    /// The sums.
    pub tally: Tally,
}

/// All that the result of a run depends on.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    format: u32,
    version: String,
    /// Frames of the whole run, all shards together.
    pub frames: u64,
    seed: u64,
    random_reflectance: bool,
    detector: String,
    level: Level,
    scene: Scene,
}

impl Run {
    /// The run of these settings.
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        let name = DETECTORS
            .iter()
            .find(|(_, choice)| *choice == settings.detector);
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            frames: settings.frames,
            seed: settings.seed,
            random_reflectance: settings.random_reflectance,
            detector: name.map_or("best", |(name, _)| name).into(),
            level: settings.level,
            scene: scene.clone(),
        }
    }

    /// The scene as the run sees it.
    pub fn view(&self) -> anyhow::Result<View> {
        Ok(evaluate::view(&self.scene, self.random_reflectance)?)
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The level.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Chunks of the whole run.
    pub fn chunks(&self) -> u64 {
        chunks(self.frames)
    }
}

impl Results {
    /// The results in a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the results {}", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("{} holds no results of vocc evaluate", path.display()))
    }

    /// Writes them: whole or not at all.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string(self)?;
        write_aside(path, |aside| Ok(std::fs::write(aside, text)?))
    }

    /// Adds the results of a file of the same run.
    pub fn merge(&mut self, path: &Path) -> anyhow::Result<()> {
        let other = Self::read(path)?;
        ensure!(
            other.run == self.run,
            "{} is of another run: scene, frames, seed, detector, level and version must be the same",
            path.display()
        );
        self.tally
            .merge(&other.tally)
            .map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))
    }

    /// The first chunk that is missing from the whole run.
    pub fn first_missing(&self) -> Option<u64> {
        (0..self.run.chunks()).find(|&chunk| !self.tally.contains(chunk))
    }

    /// Prints them as the outcome of a run by a plan; `seconds` where it is known how long it took.
    pub fn report(&self, plan: &Plan, seconds: Option<f64>, as_json: bool) -> anyhow::Result<()> {
        let evaluation = self.tally.total();
        output::evaluation(&self.run, plan, &evaluation, seconds, as_json)
    }
}
