//! Stops that come late: the program ends within a second, whoever reads its output, and says nothing that is not so.
#![cfg(target_os = "linux")]

mod common;

use std::io::{BufRead, Read};
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use common::recording::{filmed, pixels};
use common::{command, folder, text};

/// A second, on a machine that is busy.
const PATIENCE: Duration = Duration::from_secs(20);

/// Asks a command to end as soon as it waits for a reader, and again shortly after; gives its exit status.
fn stopped(run: &mut Child) -> ExitStatus {
    let begun = Instant::now();
    while !waits_for_a_reader(run.id()) {
        assert!(run.try_wait().expect("a child").is_none(), "it has ended");
        assert!(begun.elapsed() < Duration::from_secs(120), "it never waits");
        std::thread::sleep(Duration::from_millis(20));
    }
    let begun = Instant::now();
    for _ in 0..2 {
        common::bounded::signal("-TERM", run.id());
        std::thread::sleep(Duration::from_millis(100));
    }
    loop {
        if let Some(status) = run.try_wait().expect("a child") {
            return status;
        }
        if begun.elapsed() > PATIENCE {
            let _ = run.kill();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Whether a thread stays in a write to a pipe.
fn waits_for_a_reader(process: u32) -> bool {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let calls = threads.map(|thread| thread.path().join("syscall"));
    let is_write = |call: &str| ["1 ", "64 "].iter().any(|number| call.starts_with(number));
    calls.into_iter().any(|path| {
        let call = std::fs::read_to_string(&path).ok().filter(|call| is_write(call));
        let is_same = || {
            std::thread::sleep(Duration::from_millis(200));
            std::fs::read_to_string(&path).ok() == call
        };
        call.is_some() && is_same()
    })
}

/// More frames than a pipe holds lines of.
fn long_film(name: &str) -> std::path::PathBuf {
    let film = filmed(name, 16);
    let raw = film.join("film.raw");
    std::fs::write(&raw, pixels(&film).concat().repeat(25)).expect("room");
    raw
}

fn errors(mut run: Child) -> String {
    let mut said = Vec::new();
    run.stderr.take().expect("a pipe").read_to_end(&mut said).expect("read");
    text(&said)
}

#[test]
fn a_stop_ends_what_waits_for_a_reader_of_its_errors() {
    let place = folder("unread-errors");
    for number in 0..1000 {
        std::fs::write(place.join(format!("{number}.png")), "").expect("room");
    }
    let mut receive = command(&["receive"]);
    receive.arg(&place).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut receive = receive.spawn().expect("vocc runs");
    assert_eq!(stopped(&mut receive).code(), Some(1));
}

#[test]
fn what_was_never_kept_is_not_said_to_stay() {
    let raw = long_film("unread-bits");
    let mut receive = command(&["receive", "-", "--raw", "320x240", "--bits", "--json"]);
    receive.stdin(std::fs::File::open(&raw).expect("a film"));
    let mut receive = receive.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("vocc runs");
    assert_eq!(stopped(&mut receive).code(), Some(1));
    let said = errors(receive);
    assert!(said.contains("interrupted") && !said.contains("kept"), "{said}");
}

#[test]
fn finished_advice_for_still_panels_is_printed_though_carriers_were_not_tried() {
    let small = "--bytes 4 --runs 2 --set camera.width_px=160 --set=camera.height_px=120 --set=camera.exposure_s=0.00025";
    let arguments = format!("plan --camera day --json {small}");
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    // The last code's line comes before carriers are looked for.
    let mut plan = command(&arguments);
    let mut plan = plan.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("vocc runs");
    let _watchdog = common::bounded::Watchdog::of(&plan);
    let mut lines = std::io::BufReader::new(plan.stdout.take().expect("a pipe"))
        .lines()
        .map(|line| line.expect("read"));
    let mut codes = std::collections::HashSet::new();
    while codes.len() < 5 {
        let row: serde_json::Value = serde_json::from_str(&lines.next().expect("a line")).expect("JSON");
        codes.insert(row["code"].to_string());
    }
    common::bounded::signal("-INT", plan.id());
    let last: serde_json::Value = serde_json::from_str(&lines.last().expect("advice")).expect("JSON");
    assert!(last["best"]["net_bit_s"].as_f64().is_some_and(|net| net > 0.0), "{last}");
    assert!(
        last["carrier"].is_null() && last["no_carrier"].as_str().is_some_and(|why| why.contains("stopped")),
        "{last}"
    );
    assert_eq!(plan.wait().expect("a child").code(), Some(1));
    let said = errors(plan);
    assert!(said.contains("without a carrier"), "{said}");
}
