//! `vocc merge`: the shards of an evaluation or a sweep, added up to what one run gives, byte for byte.

use std::path::PathBuf;

use anyhow::{Context, ensure};
use studies::sweep::Results;

use super::sweep::{self, folder};
use crate::options::Shared;
use crate::output::{self, Answer};
use crate::{report, results};

/// Arguments of `vocc merge`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Result files of `vocc evaluate --shard` or `vocc sweep --shard`, all shards of one run, or the folder that holds them.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Keep the sums in this file, and a table and a plot beside it.
    #[arg(long, value_name = "FILE.json", value_parser = results::out_file("json"))]
    out: Option<PathBuf>,
}

/// Merges and prints; what is missing, doubled or of another run is refused.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
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
        .context("there are no shards: give the result files of all shards, or the folder")?;
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
            "{} exists and holds no sum of these shards: name another file",
            path.display()
        );
        sweep::keep(&results, path)?;
    }
    if results.sweep().grid.is_empty() {
        output::evaluation(&results, None, shared.json)?;
    } else {
        report::sweep::print(&results, shared.json)?;
    }
    Ok(Answer::Yes)
}
