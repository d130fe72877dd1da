//! `vocc optimize` and `vocc table` as their users meet them.

mod common;

use std::path::Path;
use std::process::{Output, Stdio};

use common::{command, refused, text, vocc};

/// A folder of this test's own, empty.
fn folder(name: &str) -> std::path::PathBuf {
    common::folder(&format!("optimize/{name}"))
}

/// A search of two intervals at two distances, quickly done.
const QUICK: [&str; 9] = [
    "optimize",
    "--json",
    "--frames",
    "64",
    "--intervals",
    "0.5,0.8",
    "--distances",
    "60,70",
    "-o",
];

fn lines(output: &Output) -> Vec<serde_json::Value> {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let line = |line: &str| serde_json::from_str(line).expect("JSON");
    text(&output.stdout).lines().map(line).collect()
}

#[test]
fn a_table_is_made_and_can_be_used() {
    let folder = folder("made");
    let path = |name: &str| folder.join(name).to_str().expect("a name").to_string();
    let table = path("table.toml");
    let found = lines(&vocc(&[&QUICK[..], &[&table]].concat()));
    let cells: Vec<_> = found
        .iter()
        .filter(|line| line.get("distance_m").is_some())
        .collect();
    assert_eq!((found.len(), cells.len()), (6, 4));
    for cell in cells {
        for key in ["interval", "distance_m", "illuminance_lx", "l2a", "b2w"] {
            assert!(cell[key].is_number(), "{key}: {cell}");
        }
        assert_eq!(cell["l2a_95"].as_array().map(Vec::len), Some(2));
        assert_eq!(cell["illuminance_lx"], 10_000.0);
    }
    let drawing = std::fs::read_to_string(path("table.svg")).expect("a plot");
    assert!(drawing.contains("<svg"));
    let plot = image::open(path("table.png")).expect("a plot");
    assert!(plot.width() > 1000);

    assert_eq!(vocc(&["table", "check", &table]).status.code(), Some(0));
    let shown: serde_json::Value =
        serde_json::from_slice(&vocc(&["table", "show", &table, "--json"]).stdout).expect("JSON");
    let carried = shown["l2a"][0][1].as_f64().expect("a ratio");
    let mean = found.last().expect("a line")["mean_l2a"]
        .as_f64()
        .expect("a ratio");
    assert!((carried - mean).abs() < 1e-3, "{carried} against {mean}");
    let setting = format!("link.table={table}");
    let planned = vocc(&["plan", "day", "--set", &setting]);
    assert_eq!(planned.status.code(), Some(0), "{}", text(&planned.stderr));
    assert!(
        text(&vocc(&["table", "show", &table, "--rust"]).stdout)
            .contains("pub const L2A: [f32; 2]")
    );

    // What is there is not searched again, and not overwritten unasked.
    refused(&[&QUICK[..], &[&table]].concat(), &["--resume"]);
    let whole = std::fs::read_to_string(&table).expect("a table");
    let half: Vec<String> = whole
        .lines()
        .filter(|line| !line.contains("interval = 0.8,"))
        .map(|line| match line.strip_suffix("],  # 10000 lx") {
            Some(row) => format!("{}, nan],", row.split(',').next().expect("a ratio")),
            None => line.to_string(),
        })
        .collect();
    std::fs::write(&table, half.join("\n")).expect("a file");
    refused(
        &["table", "check", &table],
        &["interval 0.8", "missing", "--resume"],
    );
    let resumed = lines(&vocc(&[&QUICK[..], &[&table, "--resume"]].concat()));
    assert_eq!(resumed, found);
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), whole);
    refused(
        &[&QUICK[..], &[&table, "--resume", "--seed", "2"]].concat(),
        &["other settings", "seed"],
    );
}

#[test]
fn senseless_searches_are_refused() {
    for (arguments, words) in [
        (
            &["--intervals", "0"][..],
            &["panel.interval", "0.05 to 10"][..],
        ),
        (&["--intervals", "nan"], &["panel.interval", "NaN"]),
        (&["--intervals", "1,1"], &["interval number 1", "sort"]),
        (&["--intervals", "2,1"], &["interval number 1", "sort"]),
        (&["--intervals", "one"], &["--intervals", "one"]),
        (&["--intervals", ""], &["--intervals"]),
        (
            &["--intervals", "0.5,1,1.5,2,2.5,3,3.5,4,4.5"],
            &["9 entries", "1 to 8"],
        ),
        (&["--distances", "-30"], &["pose.distance_m", "-30"]),
        (&["--distances", "2000"], &["2000 m", "px apart"]),
        (&["--illuminances", "0"], &["ambient.illuminance_lx"]),
        (&["--yaws", "0,90"], &["pose.yaw_deg", "90"]),
        (&["--criterion", "wizard"], &["b2w, fisher or ber"]),
        (&["--rule", "median"], &["mean or least-ber"]),
        (&["--detector", "wizard"], &["kmeans"]),
        (&["--frames", "0"], &["--frames"]),
        (&["--frames", "63"], &["63 frames", "at least 64"]),
        (&["--frames", "100000001"], &["--frames", "100000000"]),
        (&["--tolerance", "-1"], &["tolerance", "-1"]),
        (&["--tolerance", "nan"], &["tolerance", "NaN"]),
        (&["--range", "4,0.2"], &["4 to 0.2"]),
        (&["--range", "0.2,11"], &["0.01 to 10"]),
        (&["--range", "1"], &["--range"]),
        (&["--resume"], &["--out"]),
        (&["-o", "no/such/folder/table.toml"], &["no/such/folder"]),
        (&["-o", "table.svg"], &["table.svg", "table.toml"]),
        (&["no-such-scene"], &["paper-18mm"]),
    ] {
        refused(&[&["optimize"], arguments].concat(), words);
    }
    refused(&["table", "check", "none.toml"], &["none.toml"]);
    refused(&["table", "show", "none.toml"], &["none.toml"]);
    let later = folder("later").join("table.toml");
    std::fs::write(&later, "format = 2\n").expect("a file");
    let later = later.to_str().expect("a name");
    refused(&["table", "check", later], &["format = 2", "format 1"]);
    refused(&["optimize", "-o", later, "--resume"], &["format = 2"]);
}

#[test]
fn a_reader_who_leaves_takes_nothing_that_is_kept() {
    let table = folder("closed").join("table.toml");
    let table = table.to_str().expect("a name");
    let unread = |arguments: &[&str]| {
        let mut run = command(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        drop(run.stdout.take());
        run.wait().expect("vocc ends").code()
    };
    assert_eq!(unread(&[&QUICK[..], &[table]].concat()), Some(0));
    let shown = vocc(&["table", "show", table, "--json"]);
    let l2a = &lines(&shown)[0]["l2a"];
    assert_eq!(l2a[0].as_array().map(Vec::len), Some(2), "{l2a}");
    assert_eq!(unread(&QUICK[..8]), Some(0));
}

#[test]
fn the_shipped_table_can_be_shown() {
    let shown = vocc(&["table", "show"]);
    assert_eq!(shown.status.code(), Some(0));
    assert!(text(&shown.stdout).lines().count() > 1);
}

#[test]
fn the_shipped_source_is_what_its_file_gives() {
    let link = Path::new(env!("CARGO_MANIFEST_DIR")).join("../link");
    let file = link.join("shipped_table.toml");
    let source = vocc(&["table", "show", file.to_str().expect("a name"), "--rust"]);
    let built = std::fs::read_to_string(link.join("src/shipped_table.rs")).expect("the source");
    assert_eq!(text(&source.stdout), built);
}
