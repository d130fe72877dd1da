//! `vocc sweep`: Monte Carlo at every setting of a plan, on this computer or as shards anywhere.

mod chart;
pub mod folder;
mod slurm;
mod status;
mod time_limit;

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use sim::input;
use studies::sweep::{EXAMPLE, PlanFile, Results, Run, Shard, Sweep};

use crate::options::SharedOptions;
use crate::output::{self, Verdict};
use crate::outputs;
use crate::report::sweep::Report;
use crate::stop::stop;
use crate::{plot, results};

/// Help text: an example plan, and sharding.
fn help() -> String {
    format!(
        "\
A plan (`vocc scene NAME` prints the keys of a scene):

{EXAMPLE}
In parts, on one computer or many, by hand:
  vocc sweep PLAN.toml --out DIR --shard 0/2
  vocc sweep PLAN.toml --out DIR --shard 1/2
  vocc merge DIR --out DIR/sweep.json

On a cluster, from a folder that all nodes see:
  vocc sweep PLAN.toml --slurm DIR --submit --shards 100 --time 01:00:00
  vocc sweep --status DIR

Exit status: 0 done; 1 interrupted (continue with --resume), or --status with shards missing; 2 bad input."
    )
}

/// Arguments of `vocc sweep`.
#[derive(clap::Args)]
#[command(after_long_help = help())]
pub struct Arguments {
    /// The plan: a TOML file with a scene, a grid over its keys, detectors, frames and a stopping rule (--help has an example).
    #[arg(value_name = "PLAN.toml", required_unless_present = "status")]
    plan: Option<PathBuf>,
    /// Save the results in this folder during the run: sweep.json, with a table (.csv) and a plot (.svg, .png) beside it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Continue from the results in --out.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Evaluate only part i of n, i from 0. All parts take about equally long, except with rare_events, because lower rates take longer.
    /// `vocc merge` adds them up.
    #[arg(long, value_name = "i/n", requires = "out")]
    shard: Option<Shard>,
    /// Print which shards in this folder are finished, missing or failed.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "folder"])]
    status: Option<PathBuf>,
    #[command(flatten)]
    slurm: slurm::Options,
}

/// Runs the requested action.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if let Some(folder) = &arguments.status {
        return status::run(folder, shared.json);
    }
    let path = arguments.plan.as_deref().context("give a plan")?;
    let plan = read(path, shared)?;
    if let Some(folder) = arguments.slurm.folder() {
        ensure!(arguments.out.is_none(), "--slurm gives the folder: omit --out");
        return slurm::run(&arguments.slurm, folder, plan);
    }
    match (arguments.shard, &arguments.out) {
        (Some(shard), Some(folder)) => part(arguments, &plan, shard, folder),
        (_, folder) => {
            if let Some(folder) = folder {
                check(folder, path, &plan.sweep)?;
            }
            whole(arguments, &plan, folder.as_deref(), shared.json)
        }
    }
}

/// Reads the plan from a file; the command line takes precedence.
fn read(path: &Path, shared: &SharedOptions) -> anyhow::Result<PlanFile> {
    let text = input::read_text(path, input::TABLE_MAX).with_context(|| format!("cannot read the plan {}", path.display()))?;
    let mut plan = Sweep::from_toml(&path.display().to_string(), &text, &shared.set)?;
    let (asked, planned) = (shared.seed, plan.sweep.seed);
    if plan.names_seed {
        // 1 is the option's default.
        ensure!(
            asked == planned || asked == 1,
            "the plan has seed = {planned}: omit --seed, or remove the key from the plan"
        );
    } else {
        plan.sweep.seed = asked;
    }
    Ok(plan)
}

/// Creates the folder of a whole sweep if it does not exist, and checks that it is writable.
fn check(folder: &Path, plan: &Path, sweep: &Sweep) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let read = outputs::files_of(plan.as_os_str(), &sweep.scene);
    results::check(&folder::whole(folder), "json", &["csv", "svg", "png"], read)
}

fn part(arguments: &Arguments, plan: &PlanFile, shard: Shard, folder: &Path) -> anyhow::Result<Verdict> {
    let plan = &folder::begin(folder, plan, shard.count())?;
    let path = folder::shard(folder, shard);
    let results = begun(&plan.sweep, &path, arguments.resume)?;
    // Earlier errors do not belong to this shard, which may be fine or another run's.
    let done = work_off(plan, shard, &path, results);
    folder::note_failure(folder, shard, done.as_ref().err())?;
    done
}

/// Completes a shard.
fn work_off(plan: &PlanFile, shard: Shard, path: &Path, mut results: Results) -> anyhow::Result<Verdict> {
    let run = Run::new(&plan.sweep, shard, plan.expected_frames())?.until(stop());
    let mut report = Report::silent();
    report.begin_at(run.frames_done(&results));
    let place = results::Place::new(path);
    let done = results::advance(
        &run,
        &mut results,
        |results| place.keep(|path| results::write(results, path)),
        |news| report.progress(news).map(|()| true),
    )?;
    Ok(if done { Verdict::Yes } else { Verdict::No })
}

fn whole(arguments: &Arguments, plan: &PlanFile, folder: Option<&Path>, as_json: bool) -> anyhow::Result<Verdict> {
    // A plan that cannot be run leaves no file.
    let run = Run::new(&plan.sweep, Shard::WHOLE, None)?.until(stop());
    let path = folder.map(folder::whole);
    let mut results = match &path {
        Some(path) => begun(&plan.sweep, path, arguments.resume)?,
        None => Results::new(plan.sweep.clone()),
    };
    let place = path.as_deref().map(results::Place::new);
    let mut report = Report::new(&plan.sweep, as_json)?;
    report.begin_at(run.frames_done(&results));
    let done = results::advance(
        &run,
        &mut results,
        |results| match &place {
            Some(place) => place.keep(|path| keep(results, path)),
            None => Ok(()),
        },
        |news| {
            report.progress(news)?;
            // A written file is useful later.
            Ok(path.is_some() || !output::is_unread())
        },
    )?;
    // If the reader has left, the run ends normally.
    let enough = done || path.is_none() && output::is_unread();
    report.end(&results)?;
    Ok(if enough { Verdict::Yes } else { Verdict::No })
}

/// Writes results with a table and a plot.
pub fn keep(results: &Results, path: &Path) -> anyhow::Result<()> {
    results::write_with_table(results, path)?;
    match chart::draw(results)? {
        Some(drawing) => plot::save(&results::stem(path, "json"), &drawing),
        None => Ok(()),
    }
}

/// The results to continue: empty, or of an earlier run.
fn begun(sweep: &Sweep, path: &Path, resume: bool) -> anyhow::Result<Results> {
    let mut results = Results::new(sweep.clone());
    if path.exists() {
        if !resume {
            bail!("{} exists: continue from it with --resume, or give another folder", path.display());
        }
        results::merge(&mut results, path)?;
    }
    // Fail before the work if the file cannot be written.
    results::write(&results, path)?;
    Ok(results)
}
