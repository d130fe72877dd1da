//! `vocc evaluate` and `vocc merge` from a user's view.

mod common;

use std::process::Output;

use common::{folder, json, refused, text, vocc, words};

fn findings(output: &Output) -> serde_json::Value {
    let mut found = json(output);
    found["seconds"] = serde_json::Value::Null;
    found
}

#[test]
fn shards_add_up_to_one_run_bit_for_bit() {
    let folder = folder("shards");
    let path = |name: &str| folder.join(name).to_str().expect("a name").to_string();
    let evaluate = |more: &[&str]| {
        let common = words("evaluate night --json --frames 3000 --random-reflectance --seed 9");
        vocc(&[common.as_slice(), more].concat())
    };
    let whole = evaluate(&[]);
    assert_eq!(whole.status.code(), Some(0), "{}", text(&whole.stderr));
    for (i, threads) in ["1", "2", "1"].into_iter().enumerate() {
        let output = evaluate(&[
            "--shard",
            &format!("{i}/3"),
            "--out",
            &path(&format!("{i}.json")),
            "--threads",
            threads,
        ]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    let [a, b, c] = ["0.json", "1.json", "2.json"].map(path);
    for order in [[&a, &b, &c], [&c, &a, &b]] {
        let merged = vocc(&["merge", "--json", order[0], order[1], order[2]]);
        assert_eq!(findings(&merged), findings(&whole));
    }
    refused(&["merge", &a, &b], &["missing"]);
    refused(&["merge", &a, &b, &c, &a], &["once"]);
    refused(&["merge", &a, &path("none.json")], &["none.json"]);
    let other = path("other.json");
    vocc(&[
        "evaluate",
        "night",
        "--frames",
        "3000",
        "--random-reflectance",
        "--seed",
        "10",
        "--shard",
        "0/3",
        "--out",
        &other,
    ]);
    refused(&["merge", &other, &b, &c], &["another run"]);
    std::fs::write(path("damaged.json"), &std::fs::read(&a).expect("a file")[..200]).expect("a file");
    refused(&["merge", &path("damaged.json")], &["damaged.json"]);
    // A whole run resumes from any of its parts.
    let resumed = evaluate(&["--resume", "--out", &b]);
    assert_eq!(findings(&resumed), findings(&whole));
    let again = evaluate(&["--out", &b]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--resume"));
    refused(&["evaluate", "--shard", "3/3", "--out", &path("x.json")], &["3/3"]);
    refused(&["evaluate", "--shard", "0/3"], &["--out"]);
}

#[test]
fn rare_events_that_reach_no_error_tell_no_rate() {
    let rare = ["evaluate", "paper", "--rare-events", "--frames", "256"];
    let output = vocc(&[&rare[..], &["--set", "effects.noise=on"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let told = text(&output.stdout);
    let ber = told.lines().last().expect("a line");
    assert!(ber.contains("no swarm reached an error"), "{ber}");
    assert!(!ber.contains("0.000e0"), "{ber}");
}

#[test]
fn frames_across_a_change_of_symbols_are_told_apart() {
    let day = ["evaluate", "day", "--frames", "1000"];
    let found = json(&vocc(&[&day[..], &["--json"]].concat()));
    let count = |key: &str| found[key].as_u64().expect("a count");
    let (across, wrong) = (count("frames_across"), count("bit_errors_across"));
    assert!((50..150).contains(&across), "{across}");
    assert!(wrong > across && wrong <= count("bit_errors"));
    let rate = (count("bit_errors") - wrong) as f64 / (count("bits") - 64 * across) as f64;
    assert_eq!(found["ber_one_symbol"].as_f64(), Some(rate));
    let told = text(&vocc(&day).stdout);
    assert!(told.contains(&format!("across     {across} frames")), "{told}");
    assert!(told.contains("elsewhere  BER"), "{told}");
    // Synchronised clocks cause none, and neither does a change that is left out.
    for scene in [&["paper"][..], &["day", "--set", "effects.symbol_change=off"]] {
        let scene = [&["evaluate", "--frames", "256"], scene].concat();
        let found = json(&vocc(&[&scene[..], &["--json"]].concat()));
        assert_eq!(found["frames_across"], 0);
        assert_eq!(found["ber_one_symbol"], found["ber"]);
        assert!(!text(&vocc(&scene).stdout).contains("across"));
    }
}
