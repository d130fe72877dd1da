//! Checkpoints: what a run of hours has finished, so that one that was interrupted can go on.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sim::input;

use crate::{checksum, files, output, outputs};

/// Between two times that a run writes what it has finished.
const EVERY: Duration = Duration::from_secs(10);

/// Writes what is finished now and then. Trouble does not end the work: there may be room again before its end.
pub struct NowAndThen(Instant);

impl NowAndThen {
    /// The work begins.
    pub fn begin() -> Self {
        Self(Instant::now())
    }

    /// Writes, if it is time to.
    pub fn write(&mut self, write: impl FnOnce() -> anyhow::Result<()>) {
        if self.0.elapsed() > EVERY {
            if let Err(error) = write() {
                output::tell(format_args!("vocc: {error:#}; going on"));
            }
            self.0 = Instant::now();
        }
    }
}

/// A file that a run resumes from: what is finished, and of which run.
pub trait Resumable: Serialize + DeserializeOwned {
    /// All that it depends on.
    type Run: PartialEq;
    /// What it is, and of which command.
    const IS: &str;
    /// What must be the same for a run to go on.
    const SAME: &str;
    /// The options that ask to go on.
    const GOES_ON: &str;

    /// The run it is of.
    fn run(&self) -> &Self::Run;

    /// What the file holds, which must be of this run.
    fn read(path: &Path, run: &Self::Run) -> anyhow::Result<Self> {
        let (file, goes_on) = (path.display(), Self::GOES_ON);
        let text = input::read_text(path, input::RESULTS_MAX).with_context(|| format!("cannot read {file}: run without {goes_on}"))?;
        let checkpoint: Self =
            checksum::from_json(&text).with_context(|| format!("{file} holds no {}: run without {goes_on}", Self::IS))?;
        ensure!(
            checkpoint.run() == run,
            "{file} is of another run: {} must be the same; choose another folder, or start again without {goes_on}",
            Self::SAME
        );
        Ok(checkpoint)
    }

    /// Writes it: whole or not at all.
    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = checksum::to_json(self)?;
        files::write(path, text)
    }
}

/// Makes the folder of a checkpoint, and holds it for this run as long as the answer lives, where nothing there or among the inputs would be
/// overwritten.
///
/// # Errors
/// When the folder cannot be made, another run holds it, or one of the files cannot be written.
pub fn hold_folder(checkpoint: &Path, pages: Vec<PathBuf>, inputs: impl IntoIterator<Item = PathBuf>) -> anyhow::Result<Option<File>> {
    let folder = checkpoint.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let held = outputs::hold(folder)?;
    outputs::check_beside(checkpoint, &pages)?;
    outputs::check(pages.into_iter().chain([checkpoint.to_owned()]), inputs)?;
    Ok(held)
}
