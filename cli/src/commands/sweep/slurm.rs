//! `vocc sweep --slurm`: a sweep as an array job and a dependent merge.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};
use studies::sweep::{MOST_SHARDS, PlanFile};

use super::folder;
use super::time_limit::TimeLimit;
use crate::files;
use crate::options::whole;
use crate::output::{Verdict, line};

/// Options of jobs.
#[derive(clap::Args)]
#[command(next_help_heading = "Slurm")]
pub struct Options {
    /// Write an array job and a merge job into this folder, which all nodes must see.
    #[arg(long = "slurm", value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Submit the jobs to Slurm.
    #[arg(long, requires = "folder")]
    submit: bool,
    /// Number of shards, which are tasks of the array. Many clusters allow 1001 in one array (MaxArraySize of `scontrol show config`).
    #[arg(long, default_value_t = 16, requires = "folder", value_name = "N",
        value_parser = whole(1..=MOST_SHARDS))]
    shards: u64,
    /// The partition. Default: the cluster's.
    #[arg(long, requires = "folder", value_name = "NAME", value_parser = word)]
    partition: Option<String>,
    /// Time limit of a task, in sbatch's format. A task that reaches it saves its work and is queued again.
    #[arg(long, default_value = "01:00:00", requires = "folder", value_name = "TIME")]
    time: TimeLimit,
    /// Memory of a task, in sbatch's format.
    #[arg(long, default_value = "1G", requires = "folder", value_name = "SIZE", value_parser = word)]
    mem: String,
    /// Processors of a task, and its threads.
    #[arg(long, default_value_t = 1, requires = "folder", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    cpus: u16,
    /// Maximum number of tasks that run at once. Default: as many as the cluster allows.
    #[arg(long, requires = "folder", value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    throttle: Option<u32>,
    /// Send a task the signal to end this many seconds before the time limit.
    #[arg(long, default_value_t = 120, requires = "folder", value_name = "S", value_parser = clap::value_parser!(u32).range(5..=65535))]
    notice: u32,
    /// Another option of sbatch for both jobs, such as --sbatch=--account=physics (repeatable).
    #[arg(long, requires = "folder", value_name = "OPTION", value_parser = line_of_text)]
    sbatch: Vec<String>,
}

/// Maximum time by which Slurm's signal comes early.
const EARLIER_S: u64 = 60;

/// Parses a word that needs no quotes.
fn word(text: &str) -> Result<String, String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-.:,+".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        Ok(text.into())
    } else {
        Err("only letters, digits and _ - . : , + are allowed".into())
    }
}

fn line_of_text(text: &str) -> Result<String, String> {
    if text.starts_with('-') && !text.contains(['\n', '\r']) {
        Ok(text.into())
    } else {
        Err("give an option of sbatch on one line, such as --account=physics".into())
    }
}

impl Options {
    /// The folder, if requested.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Checks that a task has time to work before its end signal.
    fn check(&self) -> anyhow::Result<()> {
        let least = u64::from(self.notice) + EARLIER_S;
        ensure!(
            self.time.seconds.is_none_or(|limit| limit > least),
            "--time {} leaves no time to work: with --notice {} a task may get its signal {least} s before its \
             limit; give it more time, or less notice",
            self.time.text,
            self.notice
        );
        Ok(())
    }
}

/// Writes the scripts, and submits them on request.
pub fn run(options: &Options, path: &Path, plan: PlanFile) -> anyhow::Result<Verdict> {
    options.check()?;
    plan.sweep.check()?;
    folder::begin(path, &plan, options.shards)?;
    let path = std::fs::canonicalize(path)?;
    std::fs::create_dir_all(path.join("log"))?;
    let job = Job::new(options, &path)?;
    let (array, merge) = (path.join("array.sbatch"), path.join("merge.sbatch"));
    for (script, text) in [(&array, job.array()), (&merge, job.merge())] {
        files::write(script, text)?;
    }
    if options.submit {
        let tasks = submit(&[], &array)?;
        let after = format!("--dependency=afterok:{tasks}");
        let sum = submit(&[&after, "--kill-on-invalid-dep=yes"], &merge)?;
        line(&format!("array job {tasks}, merge job {sum}"))?;
    } else {
        line(&format!("jobs=$(sbatch --parsable {})", quoted(&array)?))?;
        line(&format!(
            "sbatch --dependency=afterok:$jobs --kill-on-invalid-dep=yes {}",
            quoted(&merge)?
        ))?;
    }
    Ok(Verdict::Yes)
}

/// Submits a script with sbatch and returns the job number.
fn submit(options: &[&str], script: &Path) -> anyhow::Result<String> {
    let output = Command::new("sbatch")
        .arg("--parsable")
        .args(options)
        .arg(script)
        .output()
        .with_context(|| {
            format!(
                "cannot run sbatch; the scripts are written: submit {} on a computer with Slurm",
                script.display()
            )
        })?;
    ensure!(
        output.status.success(),
        "sbatch refused {}: {}",
        script.display(),
        String::from_utf8_lossy(&output.stderr).trim()
    );
    let answer = String::from_utf8_lossy(&output.stdout).into_owned();
    // NUMBER or NUMBER;CLUSTER.
    let job = answer.trim().split(';').next().unwrap_or_default();
    ensure!(!job.is_empty(), "sbatch reported no job number: {answer}");
    Ok(job.to_string())
}

/// Quotes a path for a shell.
fn quoted(path: &Path) -> anyhow::Result<String> {
    let text = path
        .to_str()
        .filter(|text| !text.contains('\n'))
        .with_context(|| format!("{} has a name that a script cannot contain", path.display()))?;
    Ok(format!("'{}'", text.replace('\'', r"'\''")))
}

/// Values for the scripts.
struct Job<'a> {
    options: &'a Options,
    vocc: String,
    folder: String,
    /// The folder in a directive, with % escaped.
    log: String,
}

impl<'a> Job<'a> {
    fn new(options: &'a Options, folder: &Path) -> anyhow::Result<Self> {
        let log = folder.join("log");
        let log = log
            .to_str()
            .filter(|text| !text.contains(['\n', '"']))
            .with_context(|| format!("{} has a name that Slurm cannot use", log.display()))?;
        Ok(Self {
            options,
            vocc: quoted(&std::env::current_exe()?)?,
            folder: quoted(folder)?,
            log: log.replace('%', "%%"),
        })
    }

    fn directives(&self, own: &[String]) -> String {
        let partition = self.options.partition.iter();
        let lines = own
            .iter()
            .cloned()
            .chain(partition.map(|name| format!("--partition={name}")))
            .chain([
                format!("--time={}", self.options.time.text),
                format!("--mem={}", self.options.mem),
                "--nodes=1".into(),
                "--ntasks=1".into(),
            ])
            .chain(self.options.sbatch.iter().cloned());
        lines.map(|line| format!("#SBATCH {line}\n")).collect()
    }

    fn array(&self) -> String {
        let Options {
            shards,
            cpus,
            notice,
            throttle,
            ..
        } = self.options;
        let throttle = throttle.map_or(String::new(), |most| format!("%{most}"));
        let directives = self.directives(&[
            "--job-name=vocc-sweep".into(),
            format!("--array=0-{}{throttle}", shards - 1),
            format!("--output=\"{}/shard-%a.log\"", self.log),
            "--open-mode=append".into(),
            format!("--cpus-per-task={cpus}"),
            "--requeue".into(),
            format!("--signal=B:USR1@{notice}"),
        ]);
        let Self { vocc, folder, .. } = self;
        format!(
            r#"#!/bin/bash
# The shards of a sweep, one a task. To do some of them again: sbatch --array=3,7 array.sbatch
{directives}
work=
told=
# The time limit is near: the shard writes what it has and ends.
trap 'told=yes; [ -z "$work" ] || kill -TERM "$work"' USR1

{vocc} sweep {folder}/plan.toml --out {folder} --shard "$SLURM_ARRAY_TASK_ID/{shards}" --resume --threads {cpus} &
work=$!
status=0
wait "$work" || status=$?
if [ -n "$told" ]; then
  # The signal ended the wait and not the work.
  status=0
  wait "$work" || status=$?
  if [ "$status" = 1 ]; then
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
  fi
fi
exit "$status"
"#
        )
    }

    fn merge(&self) -> String {
        let directives = self.directives(&["--job-name=vocc-merge".into(), format!("--output=\"{}/merge.log\"", self.log)]);
        let Self { vocc, folder, .. } = self;
        format!(
            r#"#!/bin/bash
# Adds the shards of a sweep up, once they are all there.
{directives}
exec {vocc} merge {folder} --out {folder}/sweep.json
"#
        )
    }
}
