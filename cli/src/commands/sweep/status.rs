//! The state of a sweep's shards.

use std::path::Path;

use anyhow::Context;
use serde::Serialize;
use studies::monte_carlo::ChunkProgress;
use studies::sweep::{Partition, Results, Shard, Sweep, Work};

use super::folder;
use crate::output::{Verdict, json, line};
use crate::report;
use crate::results;

/// State of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    /// All chunks are done.
    Done,
    /// Some chunks are done.
    Unfinished,
    /// The run ended with an error.
    Failed,
    /// No results exist.
    Missing,
}

#[derive(Serialize)]
struct Status {
    shard: u64,
    state: State,
    /// The fraction of finished chunks.
    done: f64,
    why: Option<String>,
}

/// Prints each shard's state and how to complete it; of an undivided sweep, each cell's state.
pub fn run(path: &Path, as_json: bool) -> anyhow::Result<Verdict> {
    if !folder::plan(path).exists() && folder::whole(path).exists() {
        return undivided(&folder::whole(path), as_json);
    }
    let plan = folder::kept_plan(path)?;
    let count = plan.division.as_ref().map(|division| division.shards).with_context(|| {
        format!(
            "{} is not a folder of a sweep's shards: its plan has no [division]; give the folder of --out or --slurm",
            path.display()
        )
    })?;
    let partition = plan.sweep.partition(plan.expected_frames())?;
    let mut open = Vec::new();
    for index in 0..count {
        let status = status(path, &plan.sweep, &partition, Shard::new(index, count)?);
        if as_json {
            json(&status)?;
        } else if status.state != State::Done {
            line(&describe(&status))?;
        }
        if status.state != State::Done {
            open.push(index);
        }
    }
    if !as_json {
        let whole = folder::whole(path);
        let merged = if whole.exists() { "" } else { "not " };
        line(&format!("{} of {count} shards done; {merged}merged", count as usize - open.len()))?;
        if !open.is_empty() {
            let list = open.iter().map(u64::to_string).collect::<Vec<_>>().join(",");
            line(&format!("to repeat the shards that are not running: --array={list}"))?;
        }
    }
    Ok(if open.is_empty() { Verdict::Yes } else { Verdict::No })
}

fn undivided(path: &Path, as_json: bool) -> anyhow::Result<Verdict> {
    let results = results::read(path)?;
    report::sweep::print(&results, as_json)?;
    let mut cells = 0..results.sweep().cells();
    Ok(if cells.all(|cell| results.summary(cell).finished) {
        Verdict::Yes
    } else {
        Verdict::No
    })
}

fn status(path: &Path, sweep: &Sweep, partition: &Partition, shard: Shard) -> Status {
    let found = folder::shard(path, shard);
    let failure = std::fs::read_to_string(folder::failure(path, shard)).ok();
    let work = partition.work(shard);
    let (mut state, mut done, mut why) = (State::Missing, 0.0, failure);
    if found.exists() {
        match results::read(&found) {
            Ok(results) if results.sweep() == sweep => {
                done = part_done(&results, &work);
                state = if done == 1.0 { State::Done } else { State::Unfinished };
            }
            Ok(_) => why = Some(format!("{} belongs to another run", found.display())),
            Err(error) => why = Some(format!("{error:#}")),
        }
    }
    if why.is_some() && state != State::Done {
        state = State::Failed;
    }
    Status {
        shard: shard.index(),
        state,
        done,
        why,
    }
}

fn part_done(results: &Results, work: &[Work]) -> f64 {
    let of = |work: &Work| {
        let most = work.chunks.end - work.chunks.start;
        match results.standing_of(work) {
            ChunkProgress::Done(_) => (most, most),
            ChunkProgress::Missing(_) => (results.chunks_of(work.cell).min(most), most),
        }
    };
    let (done, all) = work.iter().map(of).fold((0, 0), |(done, all), (d, a)| (done + d, all + a));
    if done == all { 1.0 } else { done as f64 / all as f64 }
}

fn describe(status: &Status) -> String {
    let part = format!("{:.0} %", 100.0 * status.done);
    let why = status.why.as_deref().unwrap_or("");
    match status.state {
        State::Done => format!("shard {} is done", status.shard),
        State::Missing => format!("shard {} is missing", status.shard),
        State::Unfinished => format!("shard {} is unfinished, {part}", status.shard),
        State::Failed => format!("shard {} failed, {part} done: {why}", status.shard),
    }
}
