//! Files that keep what a run of hours has finished, so that one that was interrupted can go on: of `vocc figures` and `vocc accuracy`.

use std::path::Path;

use anyhow::{Context, ensure};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sim::input;

use crate::{checksum, files};

/// What is finished, and of which run.
pub trait Kept: Serialize + DeserializeOwned {
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
        let kept: Self = checksum::from_json(&text).with_context(|| format!("{file} holds no {}: run without {goes_on}", Self::IS))?;
        ensure!(
            kept.run() == run,
            "{file} is of another run: {} must be the same; choose another folder, or start again without {goes_on}",
            Self::SAME
        );
        Ok(kept)
    }

    /// Writes it: whole or not at all.
    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = checksum::to_json(self)?;
        files::write(path, text)
    }
}
