//! Files of results: read, kept while work goes on, and the table and the plot beside them.

use std::cell::Cell;
use std::ffi::OsStr;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, ensure};
use clap::builder::{PathBufValueParser, TypedValueParser};
use sim::input;
use studies::sweep::{News, Results, Run};

use crate::checkpoint::NowAndThen;
use crate::files;
use crate::outputs;

/// A file as `--out` names it, with its own extension `own`, and not that of the table or the plot beside it.
pub fn out_file(own: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| match path.extension().and_then(OsStr::to_str) {
        Some(beside @ ("csv" | "svg" | "png")) => Err(format!(
            ".{beside} is what goes beside this file, which is .{own}: give {}",
            path.with_extension(own).display()
        )),
        _ => Ok(path),
    })
}

/// The name that what goes beside a file begins with: all of its own but for the extension `own`.
pub fn stem(path: &Path, own: &str) -> PathBuf {
    if path.extension().is_some_and(|found| found == own) {
        path.with_extension("")
    } else {
        path.into()
    }
}

/// Looks at a file whose own extension is `own`, and at what goes beside it by the extensions there, before work begins; `read` is what
/// the command reads.
///
/// # Errors
/// When one of them cannot be written, or would take the place of something else.
pub fn check(path: &Path, own: &str, beside: &[&str], read: impl IntoIterator<Item = PathBuf>) -> anyhow::Result<()> {
    let beside = beside.iter();
    let beside: Vec<PathBuf> = beside.map(|kind| stem(path, own).with_added_extension(kind)).collect();
    outputs::check_beside(path, &beside)?;
    outputs::check([path.to_owned()].into_iter().chain(beside), read)
}

/// The results in a file.
pub fn read(path: &Path) -> anyhow::Result<Results> {
    // Many cells have many sums.
    let text = input::read_text(path, input::RESULTS_MAX).with_context(|| format!("cannot read the results {}", path.display()))?;
    Results::from_json(&text).with_context(|| path.display().to_string())
}

/// Adds the results of a file.
pub fn merge(results: &mut Results, path: &Path) -> anyhow::Result<()> {
    let other = read(path)?;
    results.merge(&other).with_context(|| path.display().to_string())
}

/// A file in which one run keeps its results, and which another may write to meanwhile.
pub struct Place {
    path: PathBuf,
    seen: Cell<Option<Stamp>>,
}

/// When a file was written, how long it is, and which one: the clock may have been set back meanwhile.
type Stamp = (SystemTime, u64, u64);

impl Place {
    /// The file as it is now.
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.into(),
            seen: Cell::new(stamp(path)),
        }
    }

    /// Has `write` write to the file.
    ///
    /// # Errors
    /// Those of `write`, and when another run has written to the file since this one last did: its work would be lost.
    pub fn keep(&self, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let now = stamp(&self.path);
        ensure!(
            now.is_none() || now == self.seen.get(),
            "another run has written {} meanwhile, and its results stay: name another file for this one",
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

/// A number that no other file of its disk has; 0 where the system has none.
#[cfg(unix)]
fn number(known: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(known)
}

#[cfg(not(unix))]
fn number(_: &Metadata) -> u64 {
    0
}

/// Writes results: whole or not at all.
///
/// # Errors
/// When they cannot be written; what was there before is untouched.
pub fn write(results: &Results, path: &Path) -> anyhow::Result<()> {
    let text = results.to_json()?;
    files::write(path, text)
}

/// Writes results, and a table beside them as comma-separated values.
pub fn write_with_table(results: &Results, path: &Path) -> anyhow::Result<()> {
    write(results, path)?;
    let table = results.to_csv();
    files::write(&stem(path, "json").with_added_extension("csv"), table)
}

/// Does what `results` lack of a run, while `tell` says that it may go on; `keep` is given them now and then and at the end, whatever
/// ends it. Returns whether all is done.
pub fn advance(
    run: &Run,
    results: &mut Results,
    keep: impl Fn(&Results) -> anyhow::Result<()>,
    mut tell: impl FnMut(&News) -> anyhow::Result<bool>,
) -> anyhow::Result<bool> {
    let mut now_and_then = NowAndThen::begin();
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
