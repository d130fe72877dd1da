//! Checkpoints of long runs, from which an interrupted run resumes.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sim::input;

use crate::{checksum, files, output, outputs};

/// Interval between two writes of a checkpoint.
const EVERY: Duration = Duration::from_secs(10);

/// Writes a checkpoint from time to time. An error does not end the run: space may be free again later.
pub struct Periodic(Instant);

impl Periodic {
    /// Starts the interval.
    pub fn begin() -> Self {
        Self(Instant::now())
    }

    /// Calls `write` if the interval has passed.
    pub fn write(&mut self, write: impl FnOnce() -> anyhow::Result<()>) {
        if self.0.elapsed() > EVERY {
            if let Err(error) = write() {
                output::tell(format_args!("vocc: {error:#}; continuing"));
            }
            self.0 = Instant::now();
        }
    }
}

/// A checkpoint file: finished work and the run that it belongs to.
pub trait Resumable: Serialize + DeserializeOwned {
    /// All inputs of the results.
    type Run: PartialEq;
    /// A description of the file, with its command.
    const IS: &str;
    /// The settings that must be equal to resume.
    const SAME: &str;
    /// The options that resume a run.
    const GOES_ON: &str;

    /// The run of this checkpoint.
    fn run(&self) -> &Self::Run;

    /// Reads a file, which must belong to `run`.
    fn read(path: &Path, run: &Self::Run) -> anyhow::Result<Self> {
        let (file, goes_on) = (path.display(), Self::GOES_ON);
        let text = input::read_text(path, input::RESULTS_MAX).with_context(|| format!("cannot read {file}: run without {goes_on}"))?;
        let checkpoint: Self =
            checksum::from_json(&text).with_context(|| format!("{file} holds no {}: run without {goes_on}", Self::IS))?;
        ensure!(
            checkpoint.run() == run,
            "{file} belongs to another run: {} must be the same; choose another folder, or start again without {goes_on}",
            Self::SAME
        );
        Ok(checkpoint)
    }

    /// Writes the file atomically.
    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = checksum::to_json(self)?;
        files::write(path, text)
    }
}

/// Creates a checkpoint's folder and locks it for this run while the result lives.
///
/// # Errors
/// If the folder cannot be created, another run holds the lock, one of the files cannot be written, or an output would overwrite an input.
pub fn hold_folder(checkpoint: &Path, pages: Vec<PathBuf>, inputs: impl IntoIterator<Item = PathBuf>) -> anyhow::Result<Option<File>> {
    let folder = checkpoint.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let held = outputs::hold(folder)?;
    outputs::check_beside(checkpoint, &pages)?;
    outputs::check(pages.into_iter().chain([checkpoint.to_owned()]), inputs)?;
    Ok(held)
}
