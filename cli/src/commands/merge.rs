//! `vocc merge`: merges the shards of an evaluation, a sweep or a table into the result of a single run, byte for byte.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use studies::sweep::Results;
use studies::table::TableFile;

use super::optimize;
use super::sweep::{self, folder};
use crate::options::SharedOptions;
use crate::output::{self, Verdict, tell};
use crate::{files, report, results};

/// Arguments of `vocc merge`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Result files of `vocc evaluate --shard` or `vocc sweep --shard`, all shards of one run, or the folder that holds them; or tables
    /// (.toml) of `vocc optimize --shard`.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Save the merged results in this file, with a table and a plot beside it; for tables, the whole table.
    #[arg(short, long, value_name = "FILE.json", value_parser = results::out_file("json"))]
    out: Option<PathBuf>,
}

/// Merges and prints; rejects missing, duplicate and foreign parts.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let is_table = |path: &PathBuf| path.extension().is_some_and(|kind| kind == "toml");
    if arguments.files.iter().all(is_table) {
        return merge_tables(&arguments.files, arguments.out.as_deref());
    }
    let mut files = Vec::new();
    for path in &arguments.files {
        if path.is_dir() {
            files.extend(folder::shards(path)?);
        } else {
            files.push(path.clone());
        }
    }
    let (first, others) = files
        .split_first()
        .context("there are no shards: give the result files of all shards, or their folder")?;
    if let Some(path) = &arguments.out {
        results::check(path, "json", &["csv", "svg", "png"], files.iter().cloned())?;
    }
    let mut results = results::read(first)?;
    for path in others {
        results::merge(&mut results, path)?;
    }
    let results = results.finish()?;
    if let Some(path) = &arguments.out {
        let same_sweep = |there: Results| there.sweep() == results.sweep();
        ensure!(
            !path.exists() || results::read(path).is_ok_and(same_sweep),
            "{} exists and does not hold the sum of these shards: give another file",
            path.display()
        );
        sweep::keep(&results, path)?;
    }
    if results.sweep().grid.is_empty() {
        output::evaluation(&results, None, shared.json)?;
    } else {
        report::sweep::print(&results, shared.json)?;
    }
    Ok(Verdict::Yes)
}

/// Merges the parts of a table, and reports missing ones.
fn merge_tables(parts: &[PathBuf], out: Option<&Path>) -> anyhow::Result<Verdict> {
    let out = out.context("give the file of the merged table with --out")?;
    results::check(out, "toml", &[], parts.iter().cloned())?;
    let mut whole: Option<TableFile> = None;
    for path in parts {
        let part = TableFile::read(path)?;
        part.check().with_context(|| path.display().to_string())?;
        match &mut whole {
            None => whole = Some(part),
            Some(whole) => whole.merge(part).with_context(|| path.display().to_string())?,
        }
    }
    let whole = whole.context("there are no parts: give the tables of all shards")?;
    ensure!(
        !out.exists() || TableFile::read(out).is_ok_and(|there| there.is_of_same_survey(&whole)),
        "{} exists and is not a table of these parts: give another file",
        out.display()
    );
    files::write(out, whole.to_toml()?)?;
    let mut answer = optimize::verdict(&whole);
    for [illuminance_lx, interval] in whole.missing() {
        tell(format_args!(
            "vocc: the entry at {illuminance_lx} lx and interval {interval} is missing"
        ));
        answer = Verdict::No;
    }
    Ok(answer)
}
