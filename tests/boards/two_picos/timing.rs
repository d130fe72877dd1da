//! The delay of a text, and the receiver's time per frame.

use std::iter;
use std::path::Path;

use link::fec::Code;
use link::framing::Framer;
use rx_pipeline::hm01b0::Mode;
use serde_json::json;
use vocc_tests::driven_panel::CLOCK_HZ;
use vocc_tests::firmware::{say, size};

use crate::desk;
use crate::image::Programs;
use crate::pair::{Event, Pair, Tally};
use crate::signed::{self, VERDICT};
use crate::talk::{ARRIVES_IN_S, MESSAGE, TEXT, reads_on, sending};

/// The mangled name of the function that processes a frame, `Application::frame`.
pub const FRAME: &str = "E5frameNtNt";
const FOLLOWING: &str = "state: following";
const SEARCHING: &str = "state: searching";
/// The size of the stack in the image's memory layout.
const STACK_BYTES: u64 = 96 * 1024;
/// Minimum unused part of it.
const SPARE_BYTES: u64 = 32 * 1024;
/// The share of inverted LEDs at which code words can hardly be decoded, and the duration, in ms.
const SPOILT: f64 = 0.12;
const SPOILT_MS: u32 = 20_000;
/// Maximum time for a frame under these conditions, in s: a few frames are dropped.
const LONGEST_S: f64 = 0.5;
/// A followed frame uses at most one part in this many of its period, on average.
const FOLLOWED_SHARE: u64 = 4;
/// A step that is shorter than a frame period, in ms.
pub const STEP_MS: u32 = 10;
/// Time after the text for which frames are counted, in ms.
const FOLLOWED_MS: u32 = 3_000;
/// The first frame that shows another symbol begins at most one frame period after the text's last one, and is read within another.
const AT_ONCE_FRAMES: f64 = 2.0;

/// Cycles of the processor per frame period.
fn period_cycles() -> u64 {
    (f64::from(Mode::BINNED.camera_mode().period_us()) * CLOCK_HZ / 1e6) as u64
}

/// The times at which the transmitter had shown the last symbol of a repeat of the text, in ns.
fn repeats_end_ns(record: &[Event]) -> Vec<u64> {
    let shown = record.iter().filter_map(|event| {
        let panel = event.panel.as_deref()?;
        Some((event.ns, u64::from_str_radix(panel, 16).ok()?))
    });
    let (ns, bits): (Vec<u64>, Vec<u64>) = shown.unzip();
    let code = Code::for_length(TEXT.len());
    let repeats = [false, true].map(|fresh| {
        let mut framer = Framer::new(TEXT.as_bytes(), code, fresh).expect("a short text");
        let count = framer.panels_per_repeat() as usize;
        let panels = iter::repeat_with(|| framer.next_panel().bits());
        panels.take(count).collect::<Vec<_>>()
    });
    let is_repeat = |from: usize, panels: &[u64]| {
        let seen = bits[from..].iter().zip(panels);
        seen.clone().all(|(seen, panel)| seen == panel) || seen.clone().all(|(seen, panel)| *seen == !panel)
    };
    let length = repeats[0].len();
    let ends = (length..ns.len()).filter(|end| {
        let begins = |panels: &Vec<u64>| is_repeat(end - length, panels);
        repeats.iter().any(begins)
    });
    ends.map(|end| ns[end]).collect()
}

/// Prints the delay of the text after the receiver's power-up and after its last symbol, and checks the latter.
pub fn tell_latency(pair: &Pair, on_ns: u64, arrived: &Event) {
    let ends = repeats_end_ns(&pair.record);
    let end_ns = ends.iter().rfind(|ns| **ns < arrived.ns);
    let latency_ms = (arrived.ns - end_ns.expect("a whole repeat")) as f64 / 1e6;
    let found = pair.record.iter().find(|event| event.says(FOLLOWING));
    let since_on_s = |event: &Event| (event.ns - on_ns) as f64 / 1e9;
    say(&format!(
        "two Picos: the panel was found {:.2} s after the receiver's power; the text came {:.2} s after it, {latency_ms:.0} ms after its last symbol",
        found.map_or(f64::NAN, since_on_s),
        since_on_s(arrived),
    ));
    let period_ms = f64::from(Mode::BINNED.camera_mode().period_us()) / 1e3;
    assert!(latency_ms < AT_ONCE_FRAMES * period_ms, "{latency_ms} ms");
}

/// Runs in small steps until the receiver sends this line, and no further.
fn run_until(pair: &mut Pair, line: &str) {
    for _ in 0..ARRIVES_IN_S * 1000 / STEP_MS {
        let happened = pair.run_ms(STEP_MS);
        if happened.iter().any(|event| event.says(line)) {
            return;
        }
    }
    panic!("no line {line:?}; {}", pair.said());
}

/// Each frame is processed before the next one arrives, while a panel is searched for and while it is followed, and the stack has room.
/// Frames of code words that can hardly be decoded take longer, and so does the frame that completes a signature. At another phase of the
/// symbols the search met such a code word, and took 24.5 million cycles.
pub fn frames_are_done_in_time(programs: &Programs, folder: &Path) {
    let mut pair = sending(programs, folder, &["--time", FRAME, "--time", VERDICT]);
    pair.turn_on();
    run_until(&mut pair, FOLLOWING);
    let searched = pair.tally(FRAME);
    pair.count_anew();
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
    pair.run_ms(FOLLOWED_MS);
    let followed = pair.tally(FRAME);
    let period = period_cycles();
    for (kind, Tally { count, mean, most }) in [("searched", searched), ("followed", followed)] {
        say(&format!(
            "RP2040: {count} frames {kind}, {mean} cycles each on average, {most} at most, of {period}"
        ));
        assert!(count > 0 && most <= period, "{kind}: {most} cycles");
    }
    assert!(followed.mean <= period / FOLLOWED_SHARE, "{followed:?}");
    hard_code_words_are_done_in_time(&mut pair, programs, folder);
    signed::a_text_is_proven_in_time(&mut pair, programs, folder);
    // After it is asked, the receiver writes no text for a while.
    let status = desk::status(&mut pair, programs, folder);
    let stack_bytes = status["stack_bytes"].as_u64().expect("a number");
    let elf = std::fs::read(&programs.receiver).expect("the image is built");
    say(&format!(
        "RP2040: stack {stack_bytes} bytes of {STACK_BYTES}, {} beside it",
        size(&elf).ram
    ));
    assert!(stack_bytes <= STACK_BYTES - SPARE_BYTES);
}

/// A text whose code words can hardly be decoded, or not at all, because LEDs are inverted: a frame takes long, but the panel is not lost,
/// and the watchdog does not trigger. The next text is read.
fn hard_code_words_are_done_in_time(pair: &mut Pair, programs: &Programs, folder: &Path) {
    pair.tell(&json!({ "spoilt": SPOILT }));
    pair.count_anew();
    let from = pair.record.len();
    pair.run_ms(SPOILT_MS);
    let Tally { count, most, .. } = pair.tally(FRAME);
    say(&format!(
        "RP2040: of {count} frames with {SPOILT} of the LEDs wrong the longest takes {most} cycles, {:.2} s",
        most as f64 / CLOCK_HZ
    ));
    assert!(most > period_cycles(), "no code word was hard: {most} cycles");
    assert!((most as f64) < LONGEST_S * CLOCK_HZ, "{most} cycles");
    assert!(!pair.record[from..].iter().any(|event| event.says(SEARCHING)));
    pair.tell(&json!({ "spoilt": 0.0 }));
    reads_on(pair, programs, folder, "Hello again");
    assert_eq!(pair.resets_since(0), [""; 0]);
}
