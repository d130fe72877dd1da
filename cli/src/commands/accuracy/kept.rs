//! What a run has measured so far, so that an interrupted one can go on and single parts be measured again.

use std::path::Path;

use anyhow::{Context, ensure};
use serde::{Deserialize, Serialize};
use sim::input;
use studies::work_precision::{Part, Scale};

use crate::{checksum, files};

/// The version of the file's format.
const FORMAT: u32 = 1;

/// The measurements of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// What they depend on.
    pub run: Run,
    /// The parts that are measured, in their order.
    pub parts: Vec<Part>,
    /// The names of those that are still to be.
    #[serde(skip)]
    pub missing: Vec<String>,
}

/// Settings and machine of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    format: u32,
    version: String,
    /// How much work it was worth.
    pub scale: Scale,
    /// What it ran on.
    pub machine: String,
}

impl Run {
    /// A run on this machine.
    pub fn new(scale: Scale) -> Self {
        Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            scale,
            machine: machine(),
        }
    }
}

impl Kept {
    /// Nothing yet.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            parts: Vec::new(),
            missing: Vec::new(),
        }
    }

    /// What a file holds of the same run.
    pub fn read(path: &Path, run: &Run) -> anyhow::Result<Self> {
        let text = input::read_text(path, u64::MAX)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let kept: Self = checksum::from_json(&text)
            .with_context(|| format!("{} holds no points of vocc accuracy", path.display()))?;
        ensure!(
            kept.run == *run,
            "{} is of another run: machine, seed, --quick and version must be the same; choose another folder or leave \
             --resume and --part out",
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

/// The processor, how many of it there are, and the system.
fn machine() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = known
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "))
        .map_or(std::env::consts::ARCH, |(_, model)| model);
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let build = if cfg!(debug_assertions) {
        "debug"
    } else {
        "release"
    };
    format!(
        "{model}, {processors} processors, {}, {build} build",
        std::env::consts::OS
    )
}
