//! `vocc merge`: the shards of an evaluation, added up to what one run gives, bit for bit.

use std::path::PathBuf;

use anyhow::{Context, bail};
use sim::plan::Plan;

use crate::options::Shared;
use crate::output::Answer;
use crate::results::Results;

/// Arguments of `vocc merge`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Result files of `vocc evaluate --shard`, all shards of one run.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

/// Merges and prints; what is missing, doubled or of another run is refused.
pub fn run(arguments: &Arguments, shared: &Shared) -> anyhow::Result<Answer> {
    let (first, others) = arguments
        .files
        .split_first()
        .context("give the result files of all shards")?;
    let mut results = Results::read(first)?;
    for path in others {
        results.merge(path)?;
    }
    if let Some(chunk) = results.first_missing() {
        bail!(
            "chunk {chunk} of {} is missing: give all shards, and finish unfinished ones with --resume",
            results.run.chunks()
        );
    }
    let plan = Plan::of(&results.run.view()?);
    results.report(&plan, None, shared.json)?;
    Ok(Answer::Yes)
}
