//! `vocc sweep` from a user's view: tables, shards, interruptions, scripts for Slurm, and bad input.

mod common;

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use common::text;
use serde_json::Value;

const PLAN: &str = "
frames = 1500
detectors = [\"otsu\", \"kmeans\"]
[stop]
errors = 1000
[set]
effects.noise = \"on\"
pose.distance_m = 70
[grid]
ambient.illuminance_lx = [50, 500]
";

/// A test's own folder, with a plan in it.
struct Place(PathBuf);

impl Place {
    fn new(name: &str, plan: &str) -> Self {
        let folder = common::folder(&format!("sweep/{name}"));
        std::fs::write(folder.join("plan.toml"), plan).expect("a plan");
        Self(folder)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = common::command(arguments);
        command.current_dir(&self.0);
        command
    }

    fn vocc(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("vocc runs")
    }

    fn ok(&self, arguments: &[&str]) -> String {
        let output = self.vocc(arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
        text(&output.stdout)
    }

    /// Asserts exit status 2, nothing on standard output, and all of `words` in the error.
    fn refused(&self, arguments: &[&str], words: &[&str]) {
        let output = self.vocc(arguments);
        assert_eq!(text(&output.stdout), "", "{arguments:?}");
        common::says(&output, 2, words);
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn assert_same(&self, one: &str, other: &str) {
        assert!(self.read(one) == self.read(other), "{one} and {other} differ");
    }

    fn assert_nothing_half_written(&self, folder: &str) {
        let names = std::fs::read_dir(self.0.join(folder)).expect("a folder");
        let names = names.map(|entry| entry.expect("an entry").file_name());
        let half = names.filter(|name| name.to_string_lossy().starts_with('.'));
        assert_eq!(half.count(), 0);
    }
}

#[test]
fn shards_interruptions_and_one_run_leave_the_same_bytes() {
    let place = Place::new("same", PLAN);
    let lines = place.ok(&["sweep", "plan.toml", "--out", "whole", "--json"]);
    let cells: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(cells.len(), 4);
    for cell in &cells {
        assert!(cell["ambient.illuminance_lx"].is_number(), "{cell}");
        assert_eq!(cell["finished"], true);
        assert_eq!(cell["bits"].as_u64(), cell["frames"].as_u64().map(|n| 64 * n));
    }
    let table = text(&place.read("whole/sweep.csv"));
    let columns = |line: &str| line.split(',').count();
    assert_eq!(table.lines().count(), 5);
    assert!(table.lines().all(|line| columns(line) == columns(table.lines().next().unwrap())));
    assert!(place.read("whole/sweep.png").starts_with(b"\x89PNG"));
    for shard in ["2/3", "0/3", "1/3"] {
        place.ok(&["sweep", "plan.toml", "--out", "parts", "--shard", shard]);
    }
    place.ok(&["merge", "parts", "--out", "parts/sweep.json"]);
    place.assert_same("whole/sweep.json", "parts/sweep.json");
    place.assert_same("whole/sweep.csv", "parts/sweep.csv");
    // Repetition changes nothing.
    place.ok(&["sweep", "plan.toml", "--out", "parts", "--shard", "1/3", "--resume"]);
    place.ok(&["sweep", "plan.toml", "--out", "whole", "--resume"]);
    let status = place.ok(&["sweep", "--status", "whole"]);
    assert_eq!(status.lines().count(), 5, "{status}");
    place.assert_same("whole/sweep.json", "parts/sweep.json");
    place.refused(&["sweep", "plan.toml", "--out", "whole"], &["--resume"]);
    place.assert_nothing_half_written("parts");
}

#[test]
fn a_run_that_is_told_to_end_keeps_what_it_has() {
    let plan = PLAN.replace("1500", "1000000").replace("1000\n", "100000000\n");
    let place = Place::new("interrupted", &plan);
    // Each turn is longer than the one before, so that a busy machine also finishes something eventually.
    let mut pause = Duration::from_millis(400);
    loop {
        let mut run = place
            .command(&["sweep", "plan.toml", "--out", "out", "--resume"])
            .stdout(Stdio::null())
            .spawn()
            .expect("vocc runs");
        std::thread::sleep(pause);
        let told = Command::new("kill").arg(run.id().to_string()).status();
        assert!(told.is_ok_and(|status| status.success()));
        let status = run.wait().expect("vocc ends");
        let kept = std::fs::read(place.0.join("out/sweep.json")).unwrap_or_default();
        let kept: Value = serde_json::from_slice(&kept).unwrap_or_default();
        if kept["cells"].as_array().is_some_and(|cells| !cells.is_empty()) {
            assert_eq!(status.code(), Some(1), "ended, and not finished");
            break;
        }
        pause *= 2;
        assert!(pause < Duration::from_secs(120), "nothing was kept");
    }
    let table = text(&place.read("out/sweep.csv"));
    assert!(table.contains("false"), "{table}");
    place.refused(&["merge", "out/sweep.json"], &["missing", "--resume"]);
}

#[test]
fn status_says_what_is_there_and_what_is_not() {
    let place = Place::new("status", PLAN);
    place.ok(&["sweep", "plan.toml", "--out", "out", "--shard", "0/3"]);
    place.ok(&["sweep", "plan.toml", "--out", "out", "--shard", "2/3"]);
    let third = place.0.join("out/shard-000002-of-000003.json");
    let whole = std::fs::read(&third).expect("a shard");
    std::fs::write(&third, &whole[..whole.len() / 2]).expect("a shard");
    let status = place.vocc(&["sweep", "--status", "out", "--json"]);
    assert_eq!(status.status.code(), Some(1));
    let states = common::json_lines(&status);
    let states: Vec<&Value> = states.iter().map(|shard| &shard["state"]).collect();
    assert_eq!(states, ["done", "missing", "failed"]);
    place.refused(&["merge", "out"], &["shard-000002", "not whole results"]);
    // A damaged shard is not resumed; after its removal, it is computed again.
    let again = ["sweep", "plan.toml", "--out", "out", "--shard", "2/3", "--resume"];
    place.refused(&again, &["not whole results"]);
    let words = place.vocc(&["sweep", "--status", "out"]);
    assert!(text(&words.stdout).contains("--array=1,2"), "{words:?}");
    std::fs::remove_file(&third).expect("a shard");
    place.ok(&again);
    assert_eq!(std::fs::read(&third).expect("a shard"), whole);
    place.refused(&["merge", "out"], &["missing"]);
    place.ok(&["sweep", "plan.toml", "--out", "out", "--shard", "1/3"]);
    place.ok(&["sweep", "--status", "out"]);
    place.ok(&["merge", "out"]);
}

#[test]
fn bad_plans_and_foreign_shards_are_refused() {
    let place = Place::new("bad", PLAN);
    let with = |name: &str, text: &str| {
        std::fs::write(place.0.join(name), text).expect("a plan");
    };
    with("unknown.toml", &PLAN.replace("frames", "framse"));
    place.refused(&["sweep", "unknown.toml"], &["unknown.toml", "framse", "line 2"]);
    with("key.toml", &PLAN.replace("illuminance_lx", "lux"));
    place.refused(&["sweep", "key.toml"], &["lux", "illuminance_lx"]);
    with("empty.toml", &PLAN.replace("ambient.illuminance_lx = [50, 500]", ""));
    place.refused(&["sweep", "empty.toml"], &["grid is empty"]);
    with("axis.toml", &PLAN.replace("[50, 500]", "[]"));
    place.refused(&["sweep", "axis.toml"], &["no values"]);
    with("far.toml", &PLAN.replace("[50, 500]", "[50, -1]"));
    place.refused(&["sweep", "far.toml", "--out", "far"], &["cell 2", "illuminance_lx"]);
    assert!(!place.0.join("far/sweep.json").exists(), "a plan that cannot be run leaves a file");
    with("seeded.toml", &format!("seed = 5{PLAN}"));
    place.refused(&["sweep", "seeded.toml", "--seed", "6"], &["seed = 5"]);
    place.refused(&["sweep", "none.toml"], &["none.toml"]);
    place.refused(&["sweep"], &["PLAN.toml"]);
    place.refused(&["sweep", "plan.toml", "--shard", "0/2"], &["--out"]);
    place.refused(&["sweep", "--status", "."], &["[division]"]);
    let rare = ["evaluate", "paper", "--rare-events"];
    place.refused(&rare, &["no noise", "effects.noise=on"]);
    for (seed, out) in [("1", "one"), ("2", "two")] {
        let shard = if seed == "1" { "0/2" } else { "1/2" };
        place.ok(&["sweep", "plan.toml", "--seed", seed, "--out", out, "--shard", shard]);
    }
    place.refused(&["merge", "one", "two"], &["another run", "seed"]);
    let other = ["sweep", "plan.toml", "--seed", "9", "--out", "one", "--shard", "1/2"];
    place.refused(&other, &["another plan"]);
    let shard = "one/shard-000000-of-000002.json";
    let old = text(&place.read(shard)).replacen("\"format\":3", "\"format\":1", 1);
    with("old.json", &old);
    place.refused(&["merge", "old.json"], &["old.json", "format 1"]);
}

#[test]
fn a_full_disk_loses_nothing_that_was_kept() {
    let place = Place::new("full", PLAN);
    let evaluate = |more: &str| format!("{} evaluate night --frames 2048 --out kept.json {more}", env!("CARGO_BIN_EXE_vocc"));
    let bash = |script: &str| {
        let output = Command::new("bash").current_dir(&place.0).args(["-c", script]).output();
        output.expect("bash runs")
    };
    let half = bash(&evaluate("--shard 0/2"));
    assert_eq!(half.status.code(), Some(0), "{half:?}");
    let before = place.read("kept.json");
    assert!(before.len() < 4096, "{} bytes", before.len());
    // No file may grow beyond 4 KiB: a write beyond that fails as on a full disk.
    let full = bash(&format!("trap '' XFSZ; ulimit -f 4; {}", evaluate("--resume")));
    let error = text(&full.stderr);
    assert_eq!(full.status.code(), Some(2), "{error}");
    assert!(error.contains("cannot write kept.json"), "{error}");
    // Results that could not be stored are still printed.
    assert!(text(&full.stdout).contains("frames     2048"), "{full:?}");
    assert_eq!(place.read("kept.json"), before);
    place.assert_nothing_half_written(".");
    let room = bash(&evaluate("--resume"));
    assert_eq!(room.status.code(), Some(0), "{room:?}");
    assert!(place.read("kept.json").len() > 4096);
}

#[test]
fn scripts_for_slurm_are_ordinary_ones() {
    let place = Place::new("a b'c", PLAN);
    let slurm = ["sweep", "plan.toml", "--slurm", "jobs", "--shards", "5"];
    let options = ["--partition", "short", "--time", "02:00:00", "--mem", "2G", "--throttle", "3"];
    let more = ["--sbatch=--account=physics"];
    let told = place.ok(&[&slurm[..], &options, &more].concat());
    let [array, merge] = ["jobs=$(sbatch --parsable ", "sbatch --dependency=afterok:$jobs "];
    let starts: Vec<bool> = told
        .lines()
        .zip([array, merge])
        .map(|(line, start)| line.starts_with(start))
        .collect();
    assert_eq!(starts, [true; 2], "{told}");
    let array = text(&place.read("jobs/array.sbatch"));
    for line in [
        "#SBATCH --array=0-4%3",
        "#SBATCH --partition=short",
        "#SBATCH --time=02:00:00",
        "#SBATCH --mem=2G",
        "#SBATCH --requeue",
        "#SBATCH --signal=B:USR1@120",
        "#SBATCH --account=physics",
    ] {
        assert!(array.lines().any(|there| there == line), "{line}: {array}");
    }
    assert!(array.contains("$SLURM_ARRAY_TASK_ID/5"), "{array}");
    // The scripts also run without Slurm.
    for task in 0..5 {
        let run = Command::new("bash")
            .arg(place.0.join("jobs/array.sbatch"))
            .env("SLURM_ARRAY_TASK_ID", task.to_string())
            .output()
            .expect("bash runs");
        assert_eq!(run.status.code(), Some(0), "{run:?}");
    }
    let merge = Command::new("bash").arg(place.0.join("jobs/merge.sbatch")).output();
    let merge = merge.expect("bash runs");
    assert_eq!(merge.status.code(), Some(0), "{merge:?}");
    place.ok(&["sweep", "plan.toml", "--out", "alone"]);
    place.assert_same("alone/sweep.json", "jobs/sweep.json");
    place.refused(&[&slurm[..], &["--partition", "a\nb"]].concat(), &["--partition"]);
    place.refused(&[&slurm[..], &["--time", "soon"]].concat(), &["--time"]);
    place.refused(&[&slurm[..], &["--time", "3"]].concat(), &["--time 3", "180 s", "--notice"]);
    place.refused(&[&slurm[..5], &["0"]].concat(), &["--shards"]);
    place.refused(&[&slurm[..5], &["6"]].concat(), &["5 shards"]);
    let submit = place.command(&[&slurm[..], &["--submit"]].concat()).env("PATH", "").output();
    let submit = submit.expect("vocc runs");
    assert_eq!(submit.status.code(), Some(2));
    assert!(text(&submit.stderr).contains("cannot run sbatch"), "{submit:?}");
}

#[test]
fn results_and_the_table_beside_them_have_names_of_their_own() {
    let place = Place::new("names", PLAN);
    let exists = |name: &str| place.0.join(name).exists();
    let night = ["evaluate", "night", "--frames", "256", "--out"];
    for out in ["run.csv", "run.svg", "run.png"] {
        place.refused(&[&night[..], &[out]].concat(), &[out, "run.json"]);
        assert!(!exists(out), "{out}");
    }
    for (out, table) in [
        ("night.50m", "night.50m.csv"),
        ("night.70m", "night.70m.csv"),
        ("run.json", "run.csv"),
    ] {
        place.ok(&[&night[..], &[out]].concat());
        place.ok(&[&night[..], &[out, "--resume"]].concat());
        assert!(exists(table), "{table}");
    }
    assert!(!exists("night.csv"));
    for shard in ["0/2", "1/2"] {
        place.ok(&["sweep", "plan.toml", "--out", "parts", "--shard", shard]);
    }
    for out in ["sum.csv", "sum.svg", "sum.png"] {
        place.refused(&["merge", "parts", "--out", out], &[out, "sum.json"]);
        assert!(!exists(out), "{out}");
    }
    place.ok(&["merge", "parts", "--out", "sum.1"]);
    for name in ["sum.1", "sum.1.csv", "sum.1.svg", "sum.1.png"] {
        assert!(exists(name), "{name}");
    }
}

#[test]
fn only_shards_that_were_begun_fail() {
    let place = Place::new("refused", PLAN);
    let other = PLAN.replace("1500", "1400");
    std::fs::write(place.0.join("other.toml"), other).expect("a plan");
    let shard = |plan, shard| ["sweep", plan, "--out", "out", "--shard", shard];
    place.ok(&shard("plan.toml", "0/2"));
    place.refused(&shard("plan.toml", "0/2"), &["--resume"]);
    place.refused(&shard("other.toml", "1/2"), &["another plan"]);
    let status = place.vocc(&["sweep", "--status", "out"]);
    assert!(text(&status.stdout).contains("1 is missing"), "{status:?}");
    let names = std::fs::read_dir(place.0.join("out")).expect("a folder");
    let names = names.map(|entry| entry.expect("an entry").file_name());
    let notes = names.filter(|name| name.to_string_lossy().ends_with(".failed"));
    assert_eq!(notes.count(), 0);
    // Without noise, errors are unreachable, which the first swarm shows.
    let silent = "frames = 512\nrare_events = true\n[grid]\npose.distance_m = [50, 70]";
    std::fs::write(place.0.join("silent.toml"), silent).expect("a plan");
    let fails = ["sweep", "silent.toml", "--out", "silent", "--shard", "0/2"];
    place.refused(&fails, &["no noise"]);
    let status = place.vocc(&["sweep", "--status", "silent"]);
    assert!(text(&status.stdout).contains("0 failed"), "{status:?}");
    assert!(text(&status.stdout).contains("no noise"), "{status:?}");
}

#[test]
fn a_reader_who_leaves_ends_no_sweep_that_is_kept() {
    let place = Place::new("closed", &PLAN.replace("[stop]\nerrors = 1000\n", ""));
    let unread = |more: &[&str]| {
        let sweep = ["sweep", "plan.toml", "--threads", "1"];
        common::unread(&mut place.command(&[&sweep[..], more].concat()))
    };
    assert_eq!(unread(&["--out", "table"]), Some(0));
    place.ok(&["sweep", "--status", "table"]);
    assert_eq!(unread(&["--out", "lines", "--json"]), Some(0));
    place.ok(&["sweep", "--status", "lines"]);
    // The remaining results are neither stored nor read.
    assert_eq!(unread(&["--json"]), Some(0));
}

#[test]
fn detectors_are_compared_by_frames_of_one_symbol() {
    let plan = "scene = \"day\"\ndetectors = [\"ml\"]\nframes = 1000\n[grid]\npose.distance_m = [50, 60]\n";
    let place = Place::new("one-symbol", plan);
    let told = place.ok(&["sweep", "plan.toml", "--out", "out"]);
    assert!(told.contains("one symbol"), "{told}");
    let table = text(&place.read("out/sweep.csv"));
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (names, values) = (lines.next().expect("names"), lines.next().expect("values"));
    let value = |name: &str| -> f64 {
        let column = names.iter().position(|&column| column == name);
        let column = column.unwrap_or_else(|| panic!("no {name} in {names:?}"));
        values[column].parse().expect("a number")
    };
    let [frames, across] = ["frames", "frames_across"].map(value);
    assert!(0.0 < across && across < frames, "{across} of {frames}");
    let errors = value("bit_errors") - value("bit_errors_across");
    let rate = errors / (64.0 * (frames - across));
    assert!((value("ber_one_symbol") - rate).abs() < 1e-9, "{rate}: {table}");
    assert!(value("ber") > value("ber_one_symbol"), "{table}");
}
