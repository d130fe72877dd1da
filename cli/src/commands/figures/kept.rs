//! The file that keeps what is finished, so that an interrupted run can go on.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use sim::input;
use sim::scene::Scene;
use studies::reproduction::Findings;

use crate::{checksum, files};

/// The version of the file's format.
const FORMAT: u32 = 1;

/// What is finished, and of which run.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    run: Run,
    /// The findings by reading; those of the scene itself under no name.
    pub findings: BTreeMap<String, Findings>,
}

/// All that findings depend on.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    format: u32,
    version: String,
    frames: u64,
    quick: bool,
    seed: u64,
    scene: Scene,
}

impl Run {
    /// The run of these settings.
    pub fn new(scene: &Scene, frames: u64, quick: bool, seed: u64) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            frames,
            quick,
            seed,
            scene: scene.clone(),
        }
    }
}

impl Kept {
    /// Nothing yet.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            findings: BTreeMap::new(),
        }
    }

    /// What the file holds, which must be of this run.
    pub fn read(path: &Path, run: &Run) -> anyhow::Result<Self> {
        let text = input::read_text(path, u64::MAX)
            .with_context(|| format!("cannot read {}: run without --resume", path.display()))?;
        let kept: Self = checksum::from_json(&text).with_context(|| {
            format!(
                "{} holds no findings of vocc figures: run without --resume",
                path.display()
            )
        })?;
        ensure!(
            kept.run == *run,
            "{} is of another run: scene, frames, seed and version must be the same; run without --resume to start again",
            path.display()
        );
        Ok(kept)
    }

    /// Writes it: whole or not at all.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = checksum::to_json(self)?;
        files::write(path, text)
    }
}
