//! `vocc optimize` and `vocc table` from a user's view.

mod common;

use std::path::Path;
use std::process::Output;

use common::{command, json, json_lines, paths, refused, says, text, vocc, words};

/// An empty folder of this test.
fn folder(name: &str) -> std::path::PathBuf {
    common::folder(&format!("optimize/{name}"))
}

/// A fast search of two intervals at two distances.
const QUICK: &str = "optimize --json --frames 64 --intervals 0.5,0.8 --distances 60,70 -o";

fn lines(output: &Output) -> Vec<serde_json::Value> {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    json_lines(output)
}

/// The beginning of a table's last line. A table that is changed by hand goes without it.
const CHECKSUM: &str = "# checksum ";

fn own(table: &str) -> String {
    let lines: Vec<&str> = table.lines().filter(|line| !line.starts_with(CHECKSUM)).collect();
    lines.join("\n")
}

#[test]
fn a_table_is_made_and_can_be_used() {
    let path = paths("optimize/made");
    let table = path("table.toml");
    let found = lines(&vocc(&[&words(QUICK)[..], &[&table]].concat()));
    let cells: Vec<_> = found.iter().filter(|line| line.get("distance_m").is_some()).collect();
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
    let shown: serde_json::Value = serde_json::from_slice(&vocc(&["table", "show", &table, "--json"]).stdout).expect("JSON");
    let carried = shown["l2a"][0][1].as_f64().expect("a ratio");
    let mean = found.last().expect("a line")["mean_l2a"].as_f64().expect("a ratio");
    assert!((carried - mean).abs() < 1e-3, "{carried} against {mean}");
    let setting = format!("link.table={table}");
    let planned = vocc(&["plan", "day", "--set", &setting]);
    assert_eq!(planned.status.code(), Some(0), "{}", text(&planned.stderr));
    assert!(text(&vocc(&["table", "show", &table, "--rust"]).stdout).contains("pub const L2A: [f32; 2]"));

    // Existing results are not searched again, and not overwritten without a request.
    refused(&[&words(QUICK)[..], &[&table]].concat(), &["--resume"]);
    let whole = std::fs::read_to_string(&table).expect("a table");
    let half: Vec<String> = whole
        .lines()
        .filter(|line| !line.contains("interval = 0.8,") && !line.starts_with(CHECKSUM))
        .map(|line| match line.strip_suffix("],  # 10000 lx") {
            Some(row) => format!("{}, nan],", row.split(',').next().expect("a ratio")),
            None => line.to_string(),
        })
        .collect();
    std::fs::write(&table, half.join("\n")).expect("a file");
    refused(&["table", "check", &table], &["interval 0.8", "missing", "--resume"]);
    let resumed = lines(&vocc(&[&words(QUICK)[..], &[&table, "--resume"]].concat()));
    assert_eq!(resumed, found);
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), whole);
    refused(
        &[&words(QUICK)[..], &[&table, "--resume", "--seed", "2"]].concat(),
        &["other settings", "seed"],
    );

    // An L2A that differs from the result cannot be resumed.
    let row = whole.lines().find(|line| line.ends_with("],  # 10000 lx")).expect("a row");
    let first = row.trim_start_matches([' ', '[']).split(',').next().expect("a ratio");
    std::fs::write(&table, own(&whole).replacen(row, &row.replacen(first, "3.95", 1), 1)).expect("a file");
    let said = ["table.toml", "interval 0.5 is 3.95", "changed since"];
    refused(&[&words(QUICK)[..], &[&table, "--resume"]].concat(), &said);
    refused(&["merge", &table, "--out", &path("merged.toml")], &said);
    refused(&["table", "check", &table], &said);
}

#[test]
fn published_tables_agree_with_themselves() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let published = std::fs::read_dir(root.join("docs/optimum")).expect("a folder");
    let paths = published.map(|entry| entry.expect("an entry").path());
    let tables: Vec<_> = paths.filter(|path| path.extension().is_some_and(|kind| kind == "toml")).collect();
    assert!(tables.len() > 5);
    let changed = folder("published").join("changed.toml");
    for table in tables.iter().chain([&root.join("link/shipped_table.toml")]) {
        says(&vocc(&["table", "check", common::name(table)]), 0, &[]);
        let whole = std::fs::read_to_string(table).expect("a table");
        // Two are ratios that nobody searched.
        let is_searched = whole.contains("entries = [");
        assert_eq!(
            whole.lines().last().expect("a line").starts_with(CHECKSUM),
            is_searched,
            "{table:?}"
        );
        if is_searched {
            // A number that no criterion depends on.
            std::fs::write(&changed, whole.replacen("version = \"0", "version = \"1", 1)).expect("a file");
            refused(&["table", "check", common::name(&changed)], &["changed after it was written"]);
        }
    }
}

#[test]
fn senseless_searches_are_refused() {
    for (arguments, words) in [
        (&["--intervals", "0"][..], &["panel.interval", "0.05 to 10"][..]),
        (&["--intervals", "nan"], &["panel.interval", "NaN"]),
        (&["--intervals", "1,1"], &["interval number 1", "sort"]),
        (&["--intervals", "2,1"], &["interval number 1", "sort"]),
        (&["--intervals", "one"], &["--intervals", "one"]),
        (&["--intervals", ""], &["--intervals"]),
        (&["--intervals", "0.5,1,1.5,2,2.5,3,3.5,4,4.5"], &["9 entries", "1 to 8"]),
        (&["--distances", "-30"], &["pose.distance_m", "-30"]),
        (&["--distances", "2000"], &["2000 m", "px apart"]),
        (&["--illuminances", "0"], &["ambient.illuminance_lx"]),
        (&["--yaws", "0,90"], &["pose.yaw_deg", "90"]),
        (&["--criterion", "wizard"], &["b2w, fisher, ber or reach"]),
        (&["--min-cd", "4"], &["--criterion reach"]),
        (&["--criterion", "reach", "--distances", "30"], &["--distances", "omit"]),
        (&["--criterion", "reach", "--yaws", "30"], &["pose.yaw_deg"]),
        (&["--criterion", "reach", "--choose", "any"], &["margin, least-light or best"]),
        (&["--criterion", "reach", "--lamp", "disco"], &["rear-position", "stop"]),
        (&["--criterion", "reach", "--max-cd", "0"], &["--max-cd", "above 0"]),
        (
            &["--criterion", "reach", "--lamp", "stop", "--max-cd", "9"],
            &["--lamp", "--max-cd"],
        ),
        (&["--criterion", "reach", "--message-bytes", "0"], &["message is empty"]),
        (&["--criterion", "reach", "--message-bytes", "1025"], &["1025 bytes"]),
        (&["--criterion", "reach", "--within", "0.1"], &["26 symbols", "more time"]),
        (&["--criterion", "reach", "--within", "-1"], &["-1 s", "more than 0"]),
        (&["--criterion", "reach", "--probability", "1"], &["0.5 to 0.99"]),
        (
            &["--criterion", "reach", "--illuminances", "500,50"],
            &["illuminance in lx number 1", "sort"],
        ),
        (
            &["--criterion", "reach", "--illuminances", "50", "--lamp", "stop"],
            &["at 50 lx", "60 to 260 cd", "they give"],
        ),
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
    let later = common::name(&later);
    refused(&["table", "check", later], &["format = 2", "format 1"]);
    refused(&["optimize", "-o", later, "--resume"], &["format = 2"]);
}

#[test]
fn a_reader_who_leaves_takes_nothing_that_is_kept() {
    let table = folder("closed").join("table.toml");
    let table = common::name(&table);
    let unread = |arguments: &[&str]| common::unread(&mut command(arguments));
    assert_eq!(unread(&[&words(QUICK)[..], &[table]].concat()), Some(0));
    let shown = vocc(&["table", "show", table, "--json"]);
    let l2a = &lines(&shown)[0]["l2a"];
    assert_eq!(l2a[0].as_array().map(Vec::len), Some(2), "{l2a}");
    assert_eq!(unread(&words(QUICK)[..8]), Some(0));
}

/// A fast search by reach of one interval in two lights.
const BY_REACH: &str =
    "optimize night --criterion reach --json --frames 64 --intervals 0.5 --illuminances 50,5000 --message-bytes 8 --within 0.2 -o";

#[test]
fn parts_of_a_table_are_one_table_byte_for_byte() {
    let path = paths("optimize/parts");
    for (name, search) in [("mean", &words(QUICK)[..]), ("reach", &words(BY_REACH)[..])] {
        let file = |part: &str| path(&format!("{name}-{part}.toml"));
        let [whole, first, second, merged] = ["whole", "0", "1", "merged"].map(file);
        lines(&vocc(&[search, &[&whole]].concat()));
        for (part, shard) in [(&first, "0/2"), (&second, "1/2")] {
            lines(&vocc(&[search, &[part, "--shard", shard]].concat()));
        }
        let half = vocc(&["merge", &first, "--out", &merged]);
        says(&half, 1, &["is missing"]);
        let done = vocc(&["merge", &second, &first, "--out", &merged]);
        says(&done, 0, &[]);
        let read = |path: &str| std::fs::read_to_string(path).expect("a table");
        assert_eq!(read(&merged), read(&whole));
        refused(
            &["merge", &first, &first, "--out", &merged],
            &["repeats the entry", "each part once"],
        );
        let other = file("other");
        lines(&vocc(&[search, &[&other, "--seed", "2"]].concat()));
        refused(&["merge", &first, &other, "--out", &merged], &["another search"]);
        refused(&["merge", &first, &second, "--out", &other], &["not a table of these parts"]);
        refused(&["merge", &first, &second, "--out", &first], &["0.toml"]);
        refused(&["merge", &first, &second], &["--out"]);
        assert_eq!(read(&merged), read(&whole));
    }
    refused(&["optimize", "--shard", "0/2"], &["--out"]);
    refused(&["optimize", "--shard", "2/2", "-o", &path("none.toml")], &["2/2"]);
}

#[test]
fn what_a_transmitter_does_not_know_has_its_price() {
    let path = paths("optimize/regret");
    let (table, brighter) = (path("table.toml"), path("brighter.toml"));
    lines(&vocc(&[&words(BY_REACH)[..], &[&table]].concat()));
    let exposed = ["--set", "camera.exposure_bias_ev=1"];
    lines(&vocc(&[&words(BY_REACH)[..], &[&brighter], &exposed].concat()));
    let losses = |arguments: &[&str]| -> Vec<f64> {
        let found = lines(&vocc(&[&["table", "regret", &table, "--json"], arguments].concat()));
        let loss = |line: &serde_json::Value| {
            let reach_m = line["reach_m"].as_f64()?;
            Some(1.0 - reach_m / line["best_reach_m"].as_f64()?)
        };
        let of_table = found.iter().filter(|line| line.get("times").is_some());
        of_table.map(|line| loss(line).unwrap_or(1.0)).collect()
    };
    let [sure, half] = losses(&["--times", "1,0.5"])[..2] else {
        panic!("two factors")
    };
    assert!(sure < 0.02 && half > sure + 0.02, "{sure} and {half}");
    assert_eq!(losses(&["--times", "30"]), [1.0; 2], "nobody looked there");
    let elsewhere = losses(&["--times", "1", "--in", &brighter]);
    assert!(elsewhere[0] > -0.02 && elsewhere[0] < 0.5, "{elsewhere:?}");
    // The table with the least loss in both scenes lies in between, and a transmitter can use it.
    let robust = path("robust.toml");
    let make = ["table", "regret", &table, "--in", &table, "--in", &brighter, "-o", &robust];
    says(&vocc(&make), 0, &[]);
    says(&vocc(&["table", "check", &robust]), 0, &[]);
    let made = std::fs::read_to_string(&robust).expect("a table");
    assert!(made.contains("most_lost") && made.contains("brighter.toml"));
    // This file is not a search's result, and can be made again in a second.
    says(&vocc(&make), 0, &[]);
    assert_eq!(std::fs::read_to_string(&robust).expect("a table"), made);
    let entries = lines(&vocc(&[&make[..], &["--json"]].concat()));
    let entries = entries.iter().filter(|line| line["most_lost"].is_number());
    for entry in entries {
        let ends = entry["no_worse"].as_array().expect("two ratios");
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let ratios = [&ends[0], &entry["l2a"], &ends[1]].map(number);
        assert!(ratios.is_sorted(), "{entry}");
        assert_eq!(entry["reach_m"].as_array().map(Vec::len), Some(2));
    }
    let picture = path("robust.png");
    let shown = vocc(&["table", "show", &robust, "--plot", &picture]);
    says(&shown, 0, &[]);
    assert!(text(&shown.stdout).contains("≤ 1 % more"));
    let other = vocc(&["table", "diff", &table, &robust, "--in", &brighter]);
    says(&other, 1, &[]);
    assert!(text(&other.stdout).contains(" m ("), "{}", text(&other.stdout));
    let worst = |table: &str| -> Vec<f64> {
        let arguments = ["table", "regret", table, "--json", "--times", "1", "--in", &brighter];
        let found = lines(&vocc(&arguments));
        let most = found.iter().filter(|line| line["reach_m"].is_number());
        let number = |line: &serde_json::Value, key: &str| line[key].as_f64().expect("a number");
        most.map(|line| 1.0 - number(line, "reach_m") / number(line, "best_reach_m"))
            .collect()
    };
    for (robust, usual) in worst(&robust).into_iter().zip(worst(&table)) {
        assert!(robust <= usual + 1e-3, "{robust} against {usual}");
    }
    refused(&["table", "regret", &table, "-o", &robust], &["--in"]);
    let searched = path("searched.toml");
    std::fs::copy(&table, &searched).expect("room");
    refused(
        &["table", "regret", &table, "--in", &brighter, "-o", &searched],
        &["searched.toml", "the results of a search"],
    );
    refused(&["table", "regret", &table, "--in", &brighter, "-o", &brighter], &["brighter.toml"]);
    let shown = vocc(&["table", "regret", &table, "--in", &brighter]);
    assert!(text(&shown.stdout).contains("x0.5"), "{}", text(&shown.stderr));
    refused(&["table", "regret", &table, "--times", "0"], &["0.01 to 100"]);
    let plain = path("plain.toml");
    let only = "format = 1\nilluminance_lx = [50]\ninterval = [1]\nl2a = [[2]]\n";
    std::fs::write(&plain, only).expect("a file");
    refused(&["table", "regret", &plain], &["has no reaches", "--criterion reach"]);
}

#[test]
fn both_error_rates_and_what_a_plateau_costs_are_named() {
    let asked = words("optimize night --criterion ber --frames 64 --intervals 0.5 --distances 60,70 --illuminances 50");
    let told = vocc(&asked);
    let told = text(&told.stdout);
    for word in [
        "bit errors are those of kmeans",
        "BER, all",
        "one symbol",
        "no worse (best gains)",
        "least mean BER of one symbol",
    ] {
        assert!(told.contains(word), "{word}: {told}");
    }
    for cell in lines(&vocc(&[&asked[..], &["--json"]].concat())) {
        let (Some(range), Some(l2a)) = (cell["not_worse"].as_array(), cell["l2a"].as_f64()) else {
            continue;
        };
        let [low, high] = [0, 1].map(|end| range[end].as_f64().expect("a ratio"));
        assert!(low < l2a && l2a < high, "{cell}");
        let costs = [0, 1].map(|end| cell["not_worse_loss"][end].as_f64().expect("a factor"));
        for cost in costs {
            let percent = format!("{:.1} %", 100.0 * (cost - 1.0));
            assert!(told.contains(&percent), "{percent}: {told}");
        }
    }
}

#[test]
fn a_table_by_reach_says_what_it_knows() {
    let path = paths("optimize/reach");
    let table = path("table.toml");
    let found = lines(&vocc(&[&words(BY_REACH)[..], &[&table]].concat()));
    let entries: Vec<_> = found.iter().filter(|line| line.get("best_l2a").is_some()).collect();
    assert_eq!(entries.len(), 2);
    for entry in &entries {
        for key in ["illuminance_lx", "interval", "l2a", "reach_m", "best_l2a", "mean_cd", "peak_cd"] {
            assert!(entry[key].is_number(), "{key}: {entry}");
        }
        let number = |key: &str| entry[key].as_f64().expect("a number");
        assert!(number("reach_m") >= 0.98 * number("best_reach_m"), "{entry}");
        assert!((number("peak_cd") / number("mean_cd") - 2.0).abs() < 1e-3);
    }
    assert!(entries[0]["l2a"].as_f64() > entries[1]["l2a"].as_f64(), "darkness asks for more");
    assert_eq!(vocc(&["table", "check", &table]).status.code(), Some(0));
    let picture = path("shown.png");
    let shown = vocc(&["table", "show", &table, "--plot", &picture]);
    assert_eq!(shown.status.code(), Some(0), "{}", text(&shown.stderr));
    for word in ["interval 0.5", "█", "cd", " m ", "2 px apart at 82 m"] {
        assert!(text(&shown.stdout).contains(word), "{word}: {}", text(&shown.stdout));
    }
    assert!(image::open(&picture).expect("a plot").width() > 1000);
    let drawing = std::fs::read_to_string(path("shown.svg")).expect("a plot");
    assert!(drawing.contains("thin: found to"));
    let numbers = json(&vocc(&["table", "show", &table, "--json"]));
    assert_eq!(numbers["found_to_m"][0].as_f64().map(f64::round), Some(82.0));
    assert_eq!(numbers["reach_m"][0][0], entries[0]["reach_m"]);
    refused(&["table", "show", &table, "--plot", "shown.jpg"], &[".png"]);

    // The second entry is found again from the stored results of the first.
    let whole = std::fs::read_to_string(&table).expect("a table");
    let half: Vec<&str> = whole
        .lines()
        .filter(|line| !line.contains("illuminance_lx = 5000.0, ") && !line.starts_with(CHECKSUM))
        .collect();
    let first = half.join("\n").replace(&format!("[{}]", second_ratio(&whole)), "[nan]");
    std::fs::write(&table, first).expect("a file");
    refused(&["table", "check", &table], &["5000 lx", "missing"]);
    let resumed = lines(&vocc(&[&words(BY_REACH)[..], &[&table, "--resume"]].concat()));
    assert_eq!(resumed, found);
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), whole);
    for other in [["--choose", "best"], ["--max-cd", "20"], ["--seed", "2"]] {
        refused(
            &[&words(BY_REACH)[..], &[&table, "--resume"], &other[..]].concat(),
            &["other settings"],
        );
    }
}

/// The L2A for the most light, as written in the file.
fn second_ratio(table: &str) -> &str {
    let row = table.lines().find(|line| line.ends_with("# 5000 lx")).expect("a row");
    row.trim_start().trim_start_matches('[').split(']').next().expect("a ratio")
}

#[test]
fn light_is_kept_within_bounds() {
    let found = lines(&vocc(&[&words(BY_REACH)[..15], &["--max-cd", "30"]].concat()));
    let entry = found.last().expect("a line");
    assert!(entry["mean_cd"].as_f64().expect("a number") <= 30.0, "{entry}");
    assert_eq!(entry["illuminance_lx"], 5000.0);
    let lowest = found
        .iter()
        .filter(|line| line["illuminance_lx"] == 5000.0 && line.get("best_l2a").is_none());
    let highest = lowest.map(|point| point["l2a"].as_f64().expect("a ratio")).fold(0.0, f64::max);
    // 30 cd of 64 LEDs of 30 mm, On half of the time, at 5000 lx.
    assert!((highest - 0.6631).abs() < 1e-3, "{highest}");
}

#[test]
fn a_search_that_says_nothing_makes_no_table() {
    let folder = folder("nothing");
    let table = folder.join("table.toml");
    let table = common::name(&table);
    let run = vocc(&[
        "optimize",
        "day",
        "--criterion",
        "ber",
        "--rule",
        "least-ber",
        "--frames",
        "64",
        "--intervals",
        "2",
        "--distances",
        "25",
        "-o",
        table,
    ]);
    assert_eq!(run.status.code(), Some(1), "{}", text(&run.stderr));
    for word in ["any ratio from 0.2 to 4", "--criterion reach"] {
        assert!(text(&run.stderr).contains(word), "{}", text(&run.stderr));
    }
    refused(&["table", "check", table], &["missing"]);
}

#[test]
fn tables_are_compared() {
    let folder = folder("compared");
    let write = |name: &str, ratio: f64| {
        let path = folder.join(name);
        let file = format!("illuminance_lx = [50, 5000]\ninterval = [1]\nl2a = [[2.0], [{ratio}]]\n");
        std::fs::write(&path, file).expect("a file");
        common::name(&path).to_string()
    };
    let (old, new) = (write("old.toml", 1.5), write("new.toml", 1.8));
    assert_eq!(vocc(&["table", "diff", &old, &old]).status.code(), Some(0));
    let compared = vocc(&["table", "diff", &old, &new]);
    assert_eq!(compared.status.code(), Some(1));
    assert!(text(&compared.stdout).contains("+20.0 %"), "{}", text(&compared.stdout));
    let by_reach = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/optimum/kmeans.toml");
    let by_reach = common::name(&by_reach);
    let known = json_lines(&vocc(&["table", "diff", &old, by_reach, "--json"]));
    assert!(known.iter().any(|line| line["new_reach_m"].is_number()));
    refused(&["table", "diff", &old, "none.toml"], &["none.toml"]);
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
    let source = vocc(&["table", "show", common::name(&file), "--rust"]);
    let built = std::fs::read_to_string(link.join("src/shipped_table.rs")).expect("the source");
    assert_eq!(text(&source.stdout), built);
}

#[test]
fn a_panel_with_a_carrier_has_a_table_by_reach_that_notes_it() {
    let path = paths("optimize/carrier");
    let table = path("table.toml");
    let day = "optimize day --set link.carrier_cycles=16 --set camera.exposure_s=0.00025 --intervals 1";
    let short = "--json --frames 64 --tolerance 1 --message-bytes 8 --within 0.4 -o";
    let search = [&words(day)[..], &words(short), &[&table]].concat();
    let found = lines(&vocc(&search));
    let reach_m = found.last().expect("a line")["reach_m"].as_f64().expect("a reach");
    assert!((30.0..150.0).contains(&reach_m), "{found:?}");
    let file = std::fs::read_to_string(&table).expect("a table");
    assert!(file.contains("\ncarrier_cycles = 16\n"), "{file}");
    let checked = vocc(&["table", "check", &table, "--carrier-cycles", "16"]);
    assert_eq!((checked.status.code(), text(&checked.stderr)), (Some(0), String::new()));
    // Single frames do not have their sign.
    refused(
        &[&words(day)[..], &words("--criterion b2w --frames 64")].concat(),
        &["carrier_cycles = 16", "reach"],
    );
}
