//! Result files: reading, saving during the work, and the table and the plot beside them.

use std::cell::Cell;
use std::ffi::OsStr;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, ensure};
use clap::builder::{PathBufValueParser, TypedValueParser};
use sim::input;
use studies::sweep::{Results, Run, SweepProgress};

use crate::checkpoint::Periodic;
use crate::files;
use crate::outputs;

/// Parses a file for `--out`: with its own extension `own`, not that of the table or the plot.
pub fn out_file(own: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| match path.extension().and_then(OsStr::to_str) {
        Some(beside @ ("csv" | "svg" | "png")) => Err(format!(
            ".{beside} is for files beside this one, which is .{own}: give {}",
            path.with_extension(own).display()
        )),
        _ => Ok(path),
    })
}

/// The path without the extension `own`, as stem for the files beside it.
pub fn stem(path: &Path, own: &str) -> PathBuf {
    if path.extension().is_some_and(|found| found == own) {
        path.with_extension("")
    } else {
        path.into()
    }
}

/// Checks a file with the extension `own`, and the files beside it with the extensions `beside`, before the work; `read` are the inputs.
///
/// # Errors
/// If one of them cannot be written, or would overwrite something else.
pub fn check(path: &Path, own: &str, beside: &[&str], read: impl IntoIterator<Item = PathBuf>) -> anyhow::Result<()> {
    let beside = beside.iter();
    let beside: Vec<PathBuf> = beside.map(|kind| stem(path, own).with_added_extension(kind)).collect();
    outputs::check_beside(path, &beside)?;
    outputs::check([path.to_owned()].into_iter().chain(beside), read)
}

pub fn read(path: &Path) -> anyhow::Result<Results> {
    // Many cells have many sums.
    let text = input::read_text(path, input::RESULTS_MAX).with_context(|| format!("cannot read the results {}", path.display()))?;
    Results::from_json(&text).with_context(|| path.display().to_string())
}

/// Merges a file's results into `results`.
pub fn merge(results: &mut Results, path: &Path) -> anyhow::Result<()> {
    let other = read(path)?;
    results.merge(&other).with_context(|| path.display().to_string())
}

/// A run's result file, which another run might also write.
pub struct Place {
    path: PathBuf,
    seen: Cell<Option<Stamp>>,
}

/// Modification time, length and inode of a file; the clock may be set back between writes.
type Stamp = (SystemTime, u64, u64);

impl Place {
    /// The file in its present state.
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.into(),
            seen: Cell::new(stamp(path)),
        }
    }

    /// Calls `write` on the file.
    ///
    /// # Errors
    /// Errors of `write`, and an error if another run has written the file since this run last did, because its work would be lost.
    pub fn keep(&self, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let now = stamp(&self.path);
        ensure!(
            now.is_none() || now == self.seen.get(),
            "another run has written {} meanwhile, and its results are kept: give this run another file",
            self.path.display()
        );
        let written = write(&self.path);
        self.seen.set(stamp(&self.path));
        written
    }
}

fn stamp(path: &Path) -> Option<Stamp> {
    let known = std::fs::metadata(path).ok()?;
    Some((known.modified().ok()?, known.len(), number(&known)))
}

/// The file's inode number; 0 on other systems.
#[cfg(unix)]
fn number(known: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(known)
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> u64 {
    0
}

/// Writes results atomically.
///
/// # Errors
/// If they cannot be written; the previous file is then unchanged.
pub fn write(results: &Results, path: &Path) -> anyhow::Result<()> {
    let text = results.to_json()?;
    files::write(path, text)
}

/// Writes results, and a CSV table beside them.
pub fn write_with_table(results: &Results, path: &Path) -> anyhow::Result<()> {
    write(results, path)?;
    let table = results.to_csv();
    files::write(&stem(path, "json").with_added_extension("csv"), table)
}

/// Completes the run's missing `results` while `tell` returns true; calls `keep` from time to time and, however the run ends, at the end.
/// Returns whether all is done.
pub fn advance(
    run: &Run,
    results: &mut Results,
    keep: impl Fn(&Results) -> anyhow::Result<()>,
    mut tell: impl FnMut(&SweepProgress) -> anyhow::Result<bool>,
) -> anyhow::Result<bool> {
    let mut now_and_then = Periodic::begin();
    let mut trouble = None;
    let done = run.advance(results, |news| {
        now_and_then.write(|| keep(news.results));
        tell(news).unwrap_or_else(|error| {
            trouble = Some(error);
            false
        })
    });
    let kept = keep(results);
    let done = done?;
    kept?;
    trouble.map_or(Ok(done), Err)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_clock_that_was_set_back_hides_no_other_run() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.json");
        let place = Place::new(&path);
        let writing = |text| move |path: &Path| files::write(path, text);
        place.keep(writing("mine")).expect("kept");
        let (written, ..) = stamp(&path).expect("there");
        files::write(&path, "your").expect("room");
        let file = std::fs::File::options().write(true).open(&path);
        file.and_then(|file| file.set_modified(written)).expect("set back");
        let error = place.keep(writing("mine")).expect_err("refused");
        assert!(error.to_string().contains("another run"), "{error}");
    }

    #[test]
    fn what_another_run_has_written_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.json");
        let (one, other) = (Place::new(&path), Place::new(&path));
        let writing = |text| move |path: &Path| files::write(path, text);
        one.keep(writing("one")).expect("kept");
        one.keep(writing("one more")).expect("kept");
        let error = other.keep(writing("other")).expect_err("refused");
        assert!(error.to_string().contains("another run"), "{error}");
        assert_eq!(std::fs::read(&path).expect("there"), b"one more");
        std::fs::remove_file(&path).expect("removed");
        other.keep(writing("other")).expect("kept");
    }
}
