//! Files of results: read, kept while work goes on, and the table and the plot beside them.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use clap::builder::{PathBufValueParser, TypedValueParser};
use studies::sweep::{News, Results, Run};

use crate::files;

/// Between two times that a run keeps what it has finished.
const KEEP_EVERY: Duration = Duration::from_secs(10);

/// A file as `--out` names it, whose own extension is `own`: none that is taken for the table or the plot beside it.
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

/// The results in a file.
///
/// # Errors
/// When there is no such file, or it holds no whole results of this version.
pub fn read(path: &Path) -> anyhow::Result<Results> {
    // A device may have no end.
    let is_file = !path.exists() || path.is_file();
    ensure!(
        is_file,
        "{} is no file: give results that were kept",
        path.display()
    );
    let text = std::fs::read_to_string(path)
        .with_context(|| format!("cannot read the results {}", path.display()))?;
    Results::from_json(&text).with_context(|| path.display().to_string())
}

/// Adds the results of a file.
///
/// # Errors
/// Those of [`read`], and when they are of another run or there already.
pub fn merge(results: &mut Results, path: &Path) -> anyhow::Result<()> {
    let other = read(path)?;
    results
        .merge(&other)
        .with_context(|| path.display().to_string())
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
///
/// # Errors
/// As [`write()`].
pub fn write_with_table(results: &Results, path: &Path) -> anyhow::Result<()> {
    write(results, path)?;
    let table = results.to_csv();
    files::write(&stem(path, "json").with_added_extension("csv"), table)
}

/// Does what `results` lack of a run, while `tell` says that it may go on; `keep` is given them now and then and at the end, whatever
/// ends it. Returns whether all is done.
///
/// Trouble in keeping does not end the work: there may be room again before its end.
///
/// # Errors
/// When the work cannot be done, or the results not be kept at last.
pub fn advance(
    run: &Run,
    results: &mut Results,
    keep: impl Fn(&Results) -> anyhow::Result<()>,
    mut tell: impl FnMut(&News) -> anyhow::Result<bool>,
) -> anyhow::Result<bool> {
    let mut kept = Instant::now();
    let mut trouble = None;
    let done = run.advance(results, |news| {
        if kept.elapsed() > KEEP_EVERY {
            if let Err(error) = keep(news.results) {
                eprintln!("vocc: {error:#}; going on");
            }
            kept = Instant::now();
        }
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
