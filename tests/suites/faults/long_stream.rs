//! A stream of many frames.

use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::workshop::Workshop;

/// Bytes of a frame.
const FRAME: usize = 320 * 240;
/// Maximum frames in flight: in the pipe, the program's buffers and the receiver.
const ON_THE_WAY: u64 = 64;
/// Timeout for a frame's report.
const PATIENCE: Duration = Duration::from_secs(30);
/// Maximum growth of memory after a tenth of the frames.
const MORE_KB: u64 = 4096;

/// Streams `frames` frames through `receive`.
pub fn run(workshop: &Workshop, frames: u64) {
    let folder = workshop.folder();
    let film = std::fs::read(folder.path().join("film.raw")).expect("a film");
    let mut receive = Command::new(workshop.vocc())
        .args(["receive", "-", "--raw", "320x240", "--symbol-rate", "90", "--bits", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let told = Arc::new(AtomicU64::new(0));
    let lines = BufReader::new(receive.stdout.take().expect("an output")).lines();
    let counter = Arc::clone(&told);
    let reader = std::thread::spawn(move || {
        for line in lines {
            let is_frame = line.expect("text").contains("\"frame\"");
            counter.fetch_add(u64::from(is_frame), Ordering::Relaxed);
        }
    });
    let mut input = receive.stdin.take().expect("an input");
    let settled = frames / 10;
    write(&mut input, &film, 0..settled, &told);
    let before = peak_kb(receive.id());
    write(&mut input, &film, settled..frames, &told);
    let after = peak_kb(receive.id());
    drop(input);
    let status = receive.wait().expect("it ends");
    reader.join().expect("all is read");
    assert!(status.success(), "{status}");
    assert_eq!(told.load(Ordering::Relaxed), frames);
    eprintln!("{frames} frames: {before} kB after a tenth, {after} kB after all");
    assert!(after <= before + MORE_KB, "{before} kB, then {after} kB");
}

fn write(input: &mut ChildStdin, film: &[u8], frames: std::ops::Range<u64>, told: &AtomicU64) {
    let mut pictures = film.chunks_exact(FRAME).cycle();
    for frame in frames {
        let picture = pictures.next().expect("a film has frames");
        input.write_all(picture).expect("it reads on");
        // The counting thread itself may be late.
        let begun = Instant::now();
        while frame.saturating_sub(told.load(Ordering::Relaxed)) > ON_THE_WAY {
            assert!(begun.elapsed() < PATIENCE, "more than {ON_THE_WAY} frames are not told of");
            std::thread::yield_now();
        }
    }
}

/// A process's peak memory so far.
fn peak_kb(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("it lives");
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = peak.and_then(|peak| peak.trim().trim_end_matches(" kB").parse().ok());
    number.expect("a number of kB")
}
