//! The checkpoint of a run, from which it resumes or repeats single parts.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use studies::work_precision::{Part, Scale, StepResults};

/// The version of the file's format.
const FORMAT: u32 = 1;

/// The measurements of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// The inputs of the measurements.
    pub run: Run,
    /// Finished parts, in order.
    pub parts: Vec<Part>,
    /// Finished steps of unfinished parts, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub begun: BTreeMap<String, StepResults>,
    /// Names of the unfinished parts.
    #[serde(skip)]
    pub missing: Vec<String>,
}

/// Settings and machine of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    format: u32,
    version: String,
    /// The amount of work.
    pub scale: Scale,
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

impl Checkpoint {
    /// An empty checkpoint.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            parts: Vec::new(),
            begun: BTreeMap::new(),
            missing: Vec::new(),
        }
    }
}

impl crate::checkpoint::Resumable for Checkpoint {
    type Run = Run;
    const IS: &str = "points of vocc accuracy";
    const SAME: &str = "machine, seed, --quick and version";
    const GOES_ON: &str = "--resume and --part";

    fn run(&self) -> &Run {
        &self.run
    }
}

/// Processor model, number of processors, and operating system.
fn machine() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = known
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(": "))
        .map_or(std::env::consts::ARCH, |(_, model)| model);
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let build = if cfg!(debug_assertions) { "debug" } else { "release" };
    format!("{model}, {processors} processors, {}, {build} build", std::env::consts::OS)
}
