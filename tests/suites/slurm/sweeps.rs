//! Compares sweeps on a cluster with the same sweep in one process.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::{Duration, SystemTime};

use serde_json::Value;

use crate::Setting;
use crate::cluster::Cluster;

/// Exceeds the time of one test's jobs on a busy computer.
const PATIENCE: Duration = Duration::from_secs(240);

/// A sweep in its own folder.
struct Case<'a> {
    setting: &'a Setting,
    cluster: &'a Cluster,
    folder: PathBuf,
}

/// The numbers of the submitted jobs.
struct Jobs {
    array: String,
    merge: String,
}

impl<'a> Case<'a> {
    /// A sweep in which some cells soon have enough errors, and others never.
    fn new(setting: &'a Setting, cluster: &'a Cluster, name: &str, frames: u64) -> Self {
        let folder = cluster.folder().join(name);
        std::fs::create_dir(&folder).expect("a folder");
        let plan = format!(
            "frames = {frames}
detectors = [\"kmeans\", \"otsu\"]
seed = 3
[stop]
errors = 4000
[set]
effects.noise = \"on\"
ambient.illuminance_lx = 200
[grid]
pose.distance_m = [45, 70]
"
        );
        std::fs::write(folder.join("plan.toml"), plan).expect("a plan");
        Self { setting, cluster, folder }
    }

    fn vocc(&self, arguments: &[&str]) -> Output {
        self.cluster
            .command("timeout")
            .arg(PATIENCE.as_secs().to_string())
            .arg(&self.setting.vocc)
            .current_dir(&self.folder)
            .args(arguments)
            .output()
            .expect("vocc runs")
    }

    fn jobs(&self) -> PathBuf {
        self.folder.join("jobs")
    }

    fn submit(&self, shards: u64) -> Jobs {
        let submit = format!("sweep plan.toml --slurm jobs --submit --shards {shards} --time 00:05:00 --mem 500M --partition all");
        let output = self.vocc(&submit.split(' ').collect::<Vec<_>>());
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        let words: Vec<&str> = text.split([' ', ',', '\n']).collect();
        let after = |word: &str| {
            let place = words.iter().position(|there| *there == word)?;
            Some((*words.get(place + 2)?).to_string())
        };
        match (after("array"), after("merge")) {
            (Some(array), Some(merge)) => Jobs { array, merge },
            _ => panic!("no jobs: {text}{errors}"),
        }
    }

    fn wait(&self, what: &str, holds: impl FnMut() -> bool) {
        self.cluster.wait(what, PATIENCE, holds);
    }

    fn wait_for_merge(&self, job: &str) {
        self.wait("the shards are merged", || {
            let state = self.cluster.of_job(job, "JobState");
            assert!(!["FAILED", "CANCELLED"].contains(&&*state), "merge {state}: {}", self.logs());
            state == "COMPLETED"
        });
    }

    /// Each shard's state, from `vocc sweep --status`.
    fn status(&self) -> Vec<Value> {
        let output = self.vocc(&["sweep", "--status", "jobs", "--json"]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let lines = text.lines().map(|line| serde_json::from_str(line).expect("JSON"));
        lines.collect()
    }

    /// The merged shards equal the result of one process, byte for byte.
    fn assert_is_one_run(&self) {
        let alone = self.vocc(&["sweep", "plan.toml", "--out", "alone"]);
        assert_eq!(alone.status.code(), Some(0));
        for name in ["sweep.json", "sweep.csv"] {
            let read = |folder: &str| std::fs::read_to_string(self.folder.join(folder).join(name)).expect(name);
            let (alone, merged) = (read("alone"), read("jobs"));
            assert!(alone.len() > 300, "{alone}");
            assert!(alone == merged, "{name} differs:\n{alone}\n{merged}");
        }
    }

    fn logs(&self) -> String {
        let entries = std::fs::read_dir(self.jobs().join("log"));
        let paths = entries.into_iter().flatten().flatten();
        paths
            .map(|entry| std::fs::read_to_string(entry.path()).unwrap_or_default())
            .collect()
    }
}

pub fn shards_on_a_cluster_are_one_run_byte_for_byte(setting: &Setting) {
    let case = Case::new(setting, &setting.cluster, "whole", 6000);
    let jobs = case.submit(6);
    case.wait_for_merge(&jobs.merge);
    case.assert_is_one_run();
    assert!(case.status().iter().all(|shard| shard["state"] == "done"));
    assert_eq!(case.status().len(), 6);
}

pub fn a_shard_that_failed_is_done_again_alone(setting: &Setting) {
    let case = Case::new(setting, &setting.cluster, "failed", 3000);
    // Something else occupies the path of the shard's file.
    let shard = |index: u64| case.jobs().join(format!("shard-{index:06}-of-000004.json"));
    std::fs::create_dir_all(shard(2).join("in the way")).expect("a folder");
    let jobs = case.submit(4);
    case.wait("the merge is given up", || {
        case.cluster.of_job(&jobs.merge, "JobState") == "CANCELLED"
    });
    case.wait("the other shards are done", || {
        let done = case.status();
        done.iter().filter(|shard| shard["state"] == "done").count() == 3
    });
    let failed = &case.status()[2];
    assert_eq!(failed["state"], "failed", "{failed}");
    assert!(failed["why"].as_str().is_some_and(|why| why.contains("shard-000002")));
    assert!(!case.jobs().join("sweep.json").exists());
    std::fs::remove_dir_all(shard(2)).expect("a folder");
    let written = || [0, 1, 3].map(|index| modified(&shard(index)));
    let before = written();
    let again = |arguments: &[&str], script: &str| {
        let script = case.jobs().join(script);
        let arguments = [&["--parsable"], arguments, &[script.to_str().expect("a name")]].concat();
        let job = case.cluster.ask("sbatch", &arguments).trim().to_string();
        assert!(!job.is_empty(), "sbatch takes {arguments:?}");
        job
    };
    let array = again(&["--array=2"], "array.sbatch");
    let merge = again(&[&format!("--dependency=afterok:{array}")], "merge.sbatch");
    case.wait_for_merge(&merge);
    assert_eq!(written(), before, "the others were left alone");
    case.assert_is_one_run();
}

pub fn a_task_that_is_told_to_end_keeps_what_it_has_and_goes_on_later(setting: &Setting) {
    let case = Case::new(setting, &setting.cluster, "told", 60_000);
    let jobs = case.submit(1);
    let task = format!("{}_0", jobs.array);
    let file = case.jobs().join("shard-000000-of-000001.json");
    case.wait("the task works", || file.exists());
    std::thread::sleep(Duration::from_millis(1500));
    // Slurm sends this shortly before the time limit.
    case.cluster.ask("scancel", &["--batch", "--signal=USR1", &task]);
    case.wait("the task is queued again", || case.cluster.of_job(&task, "Restarts") == "1");
    let status = &case.status()[0];
    assert_eq!(status["state"], "unfinished", "{status}{}", case.logs());
    assert!(status["done"].as_f64().is_some_and(|done| done > 0.0 && done < 1.0));
    case.wait_for_merge(&jobs.merge);
    case.assert_is_one_run();
}

pub fn a_node_that_dies_in_mid_shard_changes_nothing(setting: &Setting) {
    let mut cluster = Cluster::provide().expect("another cluster");
    let folder = cluster.folder().to_owned();
    let jobs = {
        let case = Case::new(setting, &cluster, "node", 100_000);
        let jobs = case.submit(2);
        case.wait("both nodes work", || {
            (0..2).all(|index| {
                let task = format!("{}_{index}", jobs.array);
                cluster.of_job(&task, "JobState") == "RUNNING"
            })
        });
        jobs
    };
    std::thread::sleep(Duration::from_secs(2));
    cluster.kill_node("n1");
    let case = Case {
        setting,
        cluster: &cluster,
        folder: folder.join("node"),
    };
    case.wait_for_merge(&jobs.merge);
    let restarts = (0..2).map(|index| {
        let restarts = cluster.of_job(&format!("{}_{index}", jobs.array), "Restarts");
        restarts.parse::<u32>().expect("a number")
    });
    assert_eq!(restarts.sum::<u32>(), 1, "one task was queued again");
    case.assert_is_one_run();
}

fn modified(path: &Path) -> SystemTime {
    let about = std::fs::metadata(path).expect("a file");
    about.modified().expect("a time")
}
