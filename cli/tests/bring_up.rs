//! `vocc device test` with the simulated board, and with the pictures of its camera.

mod common;

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::time::{Duration, Instant};

use common::{command, folder, json, name, says, text, vocc};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

/// A long timeout, because the processor may be shared.
const SOON: Duration = Duration::from_secs(120);

/// A running board.
struct Simulator {
    child: Child,
    port: String,
}

impl Simulator {
    fn start(arguments: &[&str]) -> Self {
        let mut child = command(&["device", "simulate"])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        let mut port = String::new();
        let mut printed = BufReader::new(child.stdout.take().expect("piped"));
        printed.read_line(&mut port).expect("a line");
        let simulator = Self {
            child,
            port: port.trim().to_owned(),
        };
        let begun = Instant::now();
        while json(&simulator.vocc(&["device", "status", "--json"]))["light"] == "unknown" {
            assert!(begun.elapsed() < SOON, "the light stays unknown");
            std::thread::sleep(Duration::from_millis(50));
        }
        simulator
    }

    fn vocc(&self, arguments: &[&str]) -> Output {
        vocc(&[arguments, &["--port", &self.port]].concat())
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_walk_says_what_to_see_and_messages_go_on_behind_it() {
    let place = folder("bring-up-walk");
    let symbols = place.join("symbols.txt");
    let mut board = Simulator::start(&["--light-lx", "1000", "--symbols", name(&symbols)]);
    says(&board.vocc(&["device", "send", "--message", "goes on"]), 0, &[]);
    let walked = board.vocc(&["device", "test", "--step", "0.15"]);
    prints(
        &walked,
        0,
        &["light sensor: 1000.00 lx; in its other range: 1000.00 lx", "store", "duty"],
    );
    let printed = text(&walked.stdout);
    for words in [
        "rows: one whole row",
        "  row 7",
        "columns: one whole",
        "  column 0",
        "  row 7, column 7",
    ] {
        assert!(printed.contains(words), "{words:?} is missing: {printed}");
    }
    let status = json(&board.vocc(&["device", "status", "--json"]));
    assert_eq!((&status["sending"], &status["symbol_rate_hz"]), (&json!(true), &json!(90.0)));
    drop(board.child.stdin.take());
    board.child.wait().expect("it ends");
    let shown = std::fs::read_to_string(&symbols).expect("written");
    let lights: Vec<(u64, f64)> = shown
        .lines()
        .map(|line| {
            let (bits, light) = line.split_once(' ').expect("two words");
            (u64::from_str_radix(bits, 16).expect("bits"), light.parse().expect("a number"))
        })
        .collect();
    // Every row, column and LED was lit with the light of a message, and no test panel was brighter.
    let most = lights.iter().map(|&(_, light)| light).fold(0.0, f64::max);
    let single = (0..64).map(|led| 1_u64 << led);
    let rows = (0..8).map(|row| 0xff_u64 << (8 * row));
    let columns = (0..8).map(|column| 0x0101_0101_0101_0101_u64 << column);
    for panel in single.chain(rows).chain(columns) {
        assert!(lights.contains(&(panel, most)), "{panel:016x} was not shown");
    }
    let ramp = |share: f64| {
        let near = |&(bits, light): &(u64, f64)| bits == 0xaa55_aa55_aa55_aa55 && (light / most - share).abs() < 0.02;
        lights.iter().any(near)
    };
    assert!([0.0, 32.0 / 255.0, 64.0 / 255.0, 128.0 / 255.0, 1.0].into_iter().all(ramp));
}

#[test]
fn a_board_that_lacks_something_is_no() {
    let board = Simulator::start(&["--light-lx", "0.1"]);
    let short = board.vocc(&["device", "test", "--step", "0.1"]);
    says(&short, 2, &["--step 0.1 is too short at 90 symbols a second", "0.11 s"]);
    let dark = board.vocc(&["device", "test", "--step", "0.15"]);
    prints(&dark, 1, &["its duty is 0"]);
    let told: Value = serde_json::from_slice(&board.vocc(&["device", "test", "--json", "--step", "0.15"]).stdout).expect("JSON");
    assert_eq!((&told["shown"], &told["duty"]), (&json!([]), &json!(0.0)));
}

/// What a board does in the middle of a test ends it: one sentence says what happened, and whether a test panel may still be shown.
#[test]
fn a_board_that_fails_during_the_test_ends_it() {
    let still_shown = "may still show its last test panel";
    for (event, meant, is_shown) in [
        ("halt", "its symbols stand still", true),
        ("restart", "it restarted during the test", false),
        ("freeze", "nothing answers after 8 tries", true),
        ("unplug", "the connection broke", true),
    ] {
        let mut board = Simulator::start(&["--light-lx", "1000"]);
        let arguments = ["device", "test", "--step", "0.15", "--timeout", "0.1", "--port", &board.port];
        let mut test = command(&arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("vocc runs");
        let mut printed = BufReader::new(test.stdout.take().expect("piped"))
            .lines()
            .map(|line| line.expect("text"));
        assert!(printed.any(|line| line == "  row 2"), "{event}");
        match event {
            "freeze" => {
                let pid = Pid::from_child(&board.child);
                kill_process(pid, Signal::STOP).expect("it runs");
            }
            "unplug" => board.child.kill().expect("it runs"),
            order => {
                let input = board.child.stdin.as_mut().expect("piped");
                writeln!(input, "{order}").expect("it reads");
            }
        }
        let last = printed.last();
        let ended = test.wait_with_output().expect("it ends");
        says(&ended, 2, &[meant, &board.port]);
        let told = text(&ended.stderr);
        assert_eq!(told.contains(still_shown), is_shown, "{event}: {told}");
        assert_eq!(told.lines().count(), 1, "{event}: {told}");
        assert_ne!(last.as_deref(), Some("  row 7, column 7"), "{event}");
    }
}

/// Asserts an exit status and words on standard output.
fn prints(output: &Output, status: i32, words: &[&str]) {
    says(output, status, &[]);
    let printed = text(&output.stdout);
    for word in words {
        assert!(printed.contains(word), "{word:?} is not in: {printed}");
    }
}

/// A film of the test by a small camera close to the panel, in a folder.
fn filmed(name_of_it: &str, faults: &[&str]) -> PathBuf {
    let place = folder(name_of_it);
    let frames = place.join("frames");
    let camera = [
        "hm01b0",
        "--set=camera.readout_s=0",
        "--set=camera.exposure_bias_ev=-2",
        "--set=pose.distance_m=1.2",
        "--set=pose.yaw_deg=15",
        "--light-lx=1000",
        "--frames",
        name(&frames),
    ];
    let faults = faults.iter().flat_map(|fault| ["--fault", fault]);
    let arguments: Vec<&str> = camera.into_iter().chain(faults).collect();
    let board = Simulator::start(&arguments);
    prints(
        &board.vocc(&["device", "test", "--camera", "--step", "0.4"]),
        0,
        &["for a camera", "duty:"],
    );
    frames
}

fn findings(frames: &Path) -> Vec<Value> {
    let output = vocc(&["device", "test", "--json", "--frames", name(frames)]);
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["found"], json!(true), "{told}");
    assert_eq!(told["duty_seen"], json!(true), "{told}");
    let findings = told["findings"].as_array().expect("a list").clone();
    says(&output, i32::from(!findings.is_empty()), &[]);
    findings
}

#[test]
fn a_film_of_a_healthy_panel_has_no_finding() {
    let frames = filmed("bring-up-healthy", &[]);
    assert_eq!(findings(&frames), Vec::<Value>::new());
    prints(&vocc(&["device", "test", "--frames", name(&frames)]), 0, &["all 64 LEDs"]);

    // Without the end of the film, whose last part is the duty.
    let mut pictures: Vec<PathBuf> = std::fs::read_dir(&frames)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "png"))
        .collect();
    pictures.sort();
    let found = (1..pictures.len()).rev().step_by(5).find_map(|count| {
        let _ = std::fs::remove_file(&pictures[count]);
        for picture in &pictures[count..(count + 5).min(pictures.len())] {
            let _ = std::fs::remove_file(picture);
        }
        let told: Value = serde_json::from_slice(&vocc(&["device", "test", "--json", "--frames", name(&frames)]).stdout).expect("JSON");
        (told["duty_seen"] == json!(false)).then_some(told)
    });
    let told = found.expect("a film without the duty");
    assert_eq!((&told["found"], &told["findings"]), (&json!(true), &json!([])));
    prints(&vocc(&["device", "test", "--frames", name(&frames)]), 0, &["duty: not seen"]);
}

#[test]
fn a_film_names_each_fault_and_its_wire() {
    for (number, (faults, meant)) in [
        (
            &["swap=18,45", "dead-row=3"][..],
            &[("row_dead", vec![3]), ("leds_swapped", vec![18, 45])][..],
        ),
        (&["late=1"], &[("chain_shifted", vec![])]),
        (&["mirror", "stuck=9"], &[("turned", vec![]), ("led_stuck", vec![14])]),
        (&["enable", "dead=0"], &[("enable_inverted", vec![]), ("led_dead", vec![0])]),
    ]
    .into_iter()
    .enumerate()
    {
        let frames = filmed(&format!("bring-up-faults-{number}"), faults);
        let found: Vec<(String, Value)> = findings(&frames)
            .iter()
            .map(|finding| (finding["finding"].as_str().expect("a name").to_owned(), finding["places"].clone()))
            .collect();
        let meant: Vec<(String, Value)> = meant.iter().map(|(name, places)| ((*name).to_owned(), json!(places))).collect();
        // If light grows while the duty falls, it may be too bright for a camera to show that.
        let found = found
            .into_iter()
            .map(|(name, places)| (name.replace("enable_stuck", "enable_inverted"), places));
        assert_eq!(found.collect::<Vec<_>>(), meant, "{faults:?}");
    }
}

#[test]
fn sources_without_the_test_panels_are_refused_or_no() {
    let place = folder("bring-up-sources");
    let empty = place.join("empty");
    std::fs::create_dir(&empty).expect("made");
    says(&vocc(&["device", "test", "--frames", name(&empty)]), 2, &["has no PNG"]);
    says(
        &vocc(&["device", "test", "--frames", name(&place.join("none"))]),
        2,
        &["there is no"],
    );
    says(&vocc(&["device", "test"]), 2, &["--port"]);
    says(
        &vocc(&["device", "test", "--frames", name(&empty), "--port", "P"]),
        2,
        &["cannot be used with"],
    );
    says(&vocc(&["device", "test", "--port", "P", "--step", "0.01"]), 2, &["0.1 to 10"]);
    says(&vocc(&["device", "simulate", "--fault", "swap=1"]), 2, &["swap=LED,LED"]);
    let text = place.join("film.txt");
    std::fs::write(&text, "no film").expect("written");
    says(&vocc(&["device", "test", "--frames", name(&text)]), 2, &["neither a picture"]);

    // A film of nothing, and one of messages alone.
    let still = place.join("still.y4m");
    let mut film = b"YUV4MPEG2 W32 H24 F30:1 Ip A1:1 Cmono\n".to_vec();
    for _ in 0..30 {
        film.extend_from_slice(b"FRAME\n");
        film.extend_from_slice(&[90; 32 * 24]);
    }
    std::fs::write(&still, film).expect("written");
    prints(
        &vocc(&["device", "test", "--frames", name(&still)]),
        1,
        &["no panel: nothing changes"],
    );
    let messages = place.join("messages");
    let link = ["link", "hm01b0", "--message", "hi", "--frames", "60", "--save", name(&messages)];
    let _ = vocc(&link);
    prints(
        &vocc(&["device", "test", "--frames", name(&messages)]),
        1,
        &["test panels are not in the frames"],
    );
    let told: Value = serde_json::from_slice(&vocc(&["device", "test", "--json", "--frames", name(&messages)]).stdout).expect("JSON");
    assert_eq!((&told["found"], &told["findings"]), (&json!(false), &json!([])));
}
