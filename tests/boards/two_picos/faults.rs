//! Faults of the link, after which the receiver continues to read.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use crate::desk;
use crate::image::Programs;
use crate::pair::{Event, Pair};
use crate::talk::{ARRIVES_IN_S, MESSAGE, arrives, reads_on, send, sending, talking};

const WHOLE_FRAMES: &str = "In whole frames";
const IN_A_FLOOD: &str = "In a flood";
/// A line through the panel.
const LOST_LINE: u32 = 55;
/// Of the frames without it, one may have begun before, and one may not have ended yet.
const ONGOING_FRAMES: u64 = 2;
/// Time within which a fault is reported, in s: two tries, a second apart, with a margin.
const SAID_IN_S: u32 = 3;
const NO_FRAMES: &str = "fault: the camera sends no frames";
/// No whole frame for a second is also a fault of the camera.
const CAMERA_FAULT: &str = "fault: the camera";
const NO_CAMERA: &str = "fault: no camera answers";
const WRONG_CAMERA: &str = "fault: the chip at the camera's address says it is 0x0360";
const MISREAD: &str = "fault: register 0x0342 of the camera holds 0x00 after 0x01 was written";
/// Another place, beside the first one by more than the panel's own width of 0.42 m.
const BESIDE: &str = "pose.x_m=0.5";
/// The illuminance falls and rises from 500 lx to these values.
const DIM_LUX: f64 = 100.0;
const BRIGHT_LUX: f64 = 2_000.0;
/// Minimum change of the exposure, if the light changes by factors of 5 and 4: a transmitter exceeds the ambient light by less if there is
/// more of it.
const FOLLOWS: f64 = 2.0;
/// The watchdog's 8 s with a margin, in ms.
const WATCHDOG_MS: u32 = 8_200;
/// The mangled name of a function that panics if it is called twice.
const ONLY_ONCE: &str = "vocc_receiver_pico11application";
const PANICKED: &str = "fault: the program ended before this start: panicked at";
const FAULTED: &str = "fault: the program ended before this start: HardFault at";
/// Garbage, and the time that the serial line takes to carry it at 115 200 baud.
const FLOOD_BYTES: usize = 96 * 1024;
const FLOOD_NS: u64 = FLOOD_BYTES as u64 * 10 * 1_000_000_000 / 115_200;

/// Faults of the camera, the panel's place and the light, one after another: none restarts the receiver, which reads on.
pub fn a_receiver_reads_on_after_faults(programs: &Programs, folder: &Path) {
    let mut pair = sending(programs, folder, &[]);
    a_camera_that_answers_wrongly_is_named(&mut pair);
    frames_that_stop_are_missed(&mut pair, programs, folder);
    a_moved_panel_is_found_again(&mut pair, programs, folder);
    the_exposure_follows_the_light(&mut pair, programs, folder);
    frames_with_a_lost_line_are_left_out(&mut pair, programs, folder);
    assert_eq!(pair.resets_since(0), [""; 0]);
}

/// Cuts of all supplies and ends of the receiver's program, one after another: the receiver reads on.
pub fn a_receiver_reads_on_after_its_ends(programs: &Programs, folder: &Path) {
    let mut pair = talking(programs, folder);
    a_receiver_that_hangs_is_restarted(&mut pair, programs, folder);
    a_panic_is_told_at_the_next_start(&mut pair);
    a_hard_fault_is_told_at_the_next_start(&mut pair);
    a_stack_that_overflows_ends_in_a_restart(&mut pair);
    a_camera_that_holds_the_bus_is_made_to_let_go(&mut pair);
    a_receiver_whose_power_was_cut_reads_on(&mut pair, programs, folder);
    a_camera_whose_power_was_cut_is_set_up_anew(&mut pair, programs, folder);
    a_transmitter_whose_power_was_cut_is_read_on(&mut pair, programs, folder);
}

/// Exposure times gain of the last frame.
fn sensitivity(pair: &Pair) -> f64 {
    pair.frames_since(0).next_back().map(Event::sensitivity).expect("frames")
}

/// Changes the light, waits for the text, and returns the camera's sensitivity then.
fn in_light(pair: &mut Pair, programs: &Programs, folder: &Path, lux: f64, text: &str) -> f64 {
    pair.tell(&json!({ "lux": lux, "scene": [format!("ambient.illuminance_lx={lux}")] }));
    let from = pair.record.len();
    send(pair, programs, folder, text);
    arrives(pair, from, text);
    sensitivity(pair)
}

/// The light falls and rises: the exposure follows, and texts arrive.
fn the_exposure_follows_the_light(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let first = sensitivity(pair);
    let dim = in_light(pair, programs, folder, DIM_LUX, "In the dark");
    let bright = in_light(pair, programs, folder, BRIGHT_LUX, "In the light");
    assert!(dim > FOLLOWS * first, "{first} ms at gain 1, {dim} by {DIM_LUX} lx");
    assert!(bright * FOLLOWS < first, "{first} ms at gain 1, {bright} by {BRIGHT_LUX} lx");
}

/// The panel jumps from one frame to the next: it is lost, and found at the new place.
fn a_moved_panel_is_found_again(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let from = pair.record.len();
    pair.tell(&json!({ "scene": [BESIDE] }));
    pair.wait_since(from, "state: searching", ARRIVES_IN_S);
    pair.wait_since(from, "state: following", ARRIVES_IN_S);
    reads_on(pair, programs, folder, "From another place");
}

/// Lines through the panel are lost in every frame for a while.
fn frames_with_a_lost_line_are_left_out(pair: &mut Pair, programs: &Programs, folder: &Path) {
    pair.tell(&json!({ "lost_lines": [LOST_LINE] }));
    let from = pair.record.len();
    send(pair, programs, folder, WHOLE_FRAMES);
    let lost = pair.frames_since(from).count();
    let is_said = |line: &str| pair.record[from..].iter().any(|event| event.says(line));
    assert!(!is_said("message") && is_said(CAMERA_FAULT), "{}", pair.said());
    pair.tell(&json!({ "lost_lines": [] }));
    arrives(pair, from, WHOLE_FRAMES);
    let status = desk::status(pair, programs, folder);
    let cut_short = status["cut_short"].as_u64().expect("a number");
    assert!(
        cut_short.abs_diff(lost as u64) <= ONGOING_FRAMES,
        "{lost} frames without the line, {status}"
    );
}

/// Each fault of the camera on the bus is named, every time, and the camera is used once it is healthy.
fn a_camera_that_answers_wrongly_is_named(pair: &mut Pair) {
    let mut first = json!({ "receiver": "on" });
    for silent in ["missing", "deaf", "hanging"] {
        first["camera"] = "wrong_id".into();
        pair.tell(&first);
        pair.wait_for(WRONG_CAMERA, SAID_IN_S);
        first = json!({});
        pair.tell(&json!({ "camera": silent }));
        pair.wait_for(NO_CAMERA, SAID_IN_S);
    }
    pair.tell(&json!({ "camera": "misread" }));
    pair.wait_for(MISREAD, SAID_IN_S);
    pair.tell(&json!({ "camera": "none" }));
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
}

/// Frames stop in the middle of a message: the receiver reports it, and continues when they return.
fn frames_that_stop_are_missed(pair: &mut Pair, programs: &Programs, folder: &Path) {
    pair.tell(&json!({ "camera": "frozen" }));
    pair.wait_for(NO_FRAMES, SAID_IN_S);
    pair.tell(&json!({ "camera": "none" }));
    reads_on(pair, programs, folder, "After no frames");
}

/// The supply of the receiver and its camera fails for a moment, and for a while.
fn a_receiver_whose_power_was_cut_reads_on(pair: &mut Pair, programs: &Programs, folder: &Path) {
    pair.tell(&json!({ "receiver": "brown-out" }));
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
    pair.tell(&json!({ "receiver": "off" }));
    let from = pair.record.len();
    pair.run_ms(1_000);
    let silent = |event: &Event| event.board != "receiver" || event.reset.is_some();
    assert!(pair.record[from..].iter().all(silent));
    pair.turn_on();
    reads_on(pair, programs, folder, "With power again");
}

/// The supply of the transmitter fails: the panel is lost and found again, and read at the rate that the transmitter has stored.
fn a_transmitter_whose_power_was_cut_is_read_on(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let cut = pair.record.len();
    pair.tell(&json!({ "transmitter": "brown-out" }));
    pair.run_ms(1_000);
    pair.tell(&json!({ "transmitter": "off" }));
    pair.run_ms(2_000);
    pair.wait_since(cut, "state: searching", ARRIVES_IN_S);
    pair.tell(&json!({ "transmitter": "on" }));
    pair.wait_for("state: following", ARRIVES_IN_S);
    reads_on(pair, programs, folder, "Shown again");
}

/// The program hangs: the watchdog restarts it, and it reports the restart and continues to read.
fn a_receiver_that_hangs_is_restarted(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let from = pair.record.len();
    pair.tell(&json!({ "hang": true }));
    pair.run_ms(WATCHDOG_MS);
    assert_eq!(pair.resets_since(from), ["timed out"]);
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
    let status = desk::status(pair, programs, folder);
    assert_eq!(status["was_reset"], true, "{status}");
}

/// After a panic, the program restarts, reports the reason and continues to read.
fn a_panic_is_told_at_the_next_start(pair: &mut Pair) {
    ends_and_begins(pair, &json!({ "enter": ONLY_ONCE }), PANICKED);
}

/// After a fault of the processor, the program restarts, reports its address and continues to read.
fn a_hard_fault_is_told_at_the_next_start(pair: &mut Pair) {
    let from = pair.record.len();
    let words = ends_and_begins(pair, &json!({ "fault": true }), FAULTED);
    let at = pair.record[from..].iter().find_map(|event| event.fault_at);
    let told = format!("{FAULTED} {:#010x}, called from 0x", at.expect("a fault"));
    assert!(words.says(&told), "{words:?}, not {told:?}");
}

/// Ends the program, which must restart at once, report the reason and continue to read.
fn ends_and_begins(pair: &mut Pair, end: &Value, last_words: &str) -> Event {
    let from = pair.record.len();
    pair.tell(end);
    let words = pair.wait_for(last_words, SAID_IN_S);
    assert_eq!(pair.resets_since(from), ["forced"]);
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
    words
}

/// The stack overflows: the processor locks up, and the watchdog restarts the program.
fn a_stack_that_overflows_ends_in_a_restart(pair: &mut Pair) {
    let from = pair.record.len();
    pair.tell(&json!({ "stack": "full", "enter": ONLY_ONCE }));
    pair.run_ms(WATCHDOG_MS);
    assert_eq!(pair.resets_since(from), ["timed out"]);
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
}

/// Only the camera's supply fails for a moment: its registers are as after power-up, and no frames arrive.
fn a_camera_whose_power_was_cut_is_set_up_anew(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let from = pair.record.len();
    pair.tell(&json!({ "camera": "brown-out" }));
    pair.wait_for(NO_FRAMES, SAID_IN_S);
    reads_on(pair, programs, folder, "Set up anew");
    assert_eq!(pair.resets_since(from), [""; 0]);
}

/// The program ends while it reads the camera, which then holds the bus: the receiver clocks it free, and it answers at the first try.
fn a_camera_that_holds_the_bus_is_made_to_let_go(pair: &mut Pair) {
    pair.tell(&json!({ "camera": "holding" }));
    let from = pair.record.len();
    ends_and_begins(pair, &json!({ "enter": ONLY_ONCE }), PANICKED);
    let is_missed = |event: &Event| event.says(NO_CAMERA);
    assert!(!pair.record[from..].iter().any(is_missed), "{}", pair.said());
}

/// Garbage arrives over the serial line without end while a text arrives.
pub fn a_flood_on_the_port_keeps_no_text_away(programs: &Programs, folder: &Path) {
    let mut pair = talking(programs, folder);
    let mut line = UnixStream::connect(pair.socket("receiver")).expect("the emulator listens");
    let mut garbage = vec![0; FLOOD_BYTES];
    ChaCha8Rng::seed_from_u64(1).fill(&mut garbage[..]);
    line.write_all(&garbage).expect("the emulator listens");
    let from = pair.record.len();
    let end_ns = pair.now_ns() + FLOOD_NS;
    send(&mut pair, programs, folder, IN_A_FLOOD);
    let arrived = arrives(&mut pair, from, IN_A_FLOOD);
    assert!(arrived.ns < end_ns, "the flood had ended: {arrived:?}");
    while pair.now_ns() < end_ns {
        pair.run_ms(1_000);
    }
    drop(line);
    let status = desk::status(&mut pair, programs, folder);
    assert!(status["bad_frames"].as_u64() > Some(0), "{status}");
    assert_eq!(pair.resets_since(0), [""; 0]);
}
