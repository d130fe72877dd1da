//! The checkpoint, from which an interrupted run resumes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sim::scene::Scene;
use studies::reproduction::{Findings, Pieces, Task};

/// The version of the file's format.
const FORMAT: u32 = 2;

/// Finished work, and the run that it belongs to.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    run: Run,
    /// Findings by reading; the scene itself has an empty name.
    pub findings: BTreeMap<String, Findings>,
    /// The current task.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    begun: Option<TaskInWork>,
}

/// The current task and its finished pieces.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TaskInWork {
    reading: String,
    task: Task,
    pieces: Pieces,
}

/// All inputs of the findings.
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

impl Checkpoint {
    /// An empty checkpoint.
    pub fn new(run: Run) -> Self {
        Self {
            run,
            findings: BTreeMap::new(),
            begun: None,
        }
    }

    /// Takes the finished pieces of a task under a reading.
    pub fn take_pieces(&mut self, reading: &str, task: &Task) -> Pieces {
        let begun = self.begun.take();
        let own = begun.filter(|begun| begun.reading == reading && begun.task == *task);
        own.map(|begun| begun.pieces).unwrap_or_default()
    }

    /// Stores the finished pieces of a task under a reading.
    pub fn keep_pieces(&mut self, reading: &str, task: &Task, pieces: &Pieces) {
        self.begun = Some(TaskInWork {
            reading: reading.into(),
            task: task.clone(),
            pieces: pieces.clone(),
        });
    }
}

impl crate::checkpoint::Resumable for Checkpoint {
    type Run = Run;
    const IS: &str = "findings of vocc figures";
    const SAME: &str = "scene, frames, seed and version";
    const GOES_ON: &str = "--resume";

    fn run(&self) -> &Run {
        &self.run
    }
}
