//! A text that is signed on one board and verified on the other.

use std::path::Path;

use link::serial::{Request, Seed};
use link::signing::SecretKey;
use reception::keys::NamedKey;
use vocc_tests::driven_panel::CLOCK_HZ;
use vocc_tests::emulator::request;
use vocc_tests::firmware::say;

use crate::image::Programs;
use crate::pair::{Pair, Tally};
use crate::talk::{ARRIVES_IN_S, arrives, hand_over, reads_on};
use crate::timing::{FRAME, STEP_MS};

/// Part of the mangled name of the function that verifies a text, `Trust::verdict`.
pub const VERDICT: &str = "5Trust7verdict";
const SEED: [u8; 32] = *b"the private key of a transmitter";
const COUNTER: u32 = 41;
const TEXT: &str = "Signed by light";
/// Maximum time for a verdict, in cycles: a quarter of a second.
const VERDICT_MAX: u64 = 31_250_000;
/// Maximum number of frames that are dropped meanwhile; the next one waits in memory.
const DROPPED_MAX: i64 = 2;
/// Time for the key to be stored, in ms.
const STORED_MS: u32 = 1_000;
/// Steps of at least a frame period, and of more than two in which the receiver catches up.
const PERIOD_STEPS: usize = 8;
const CAUGHT_UP_STEPS: usize = 20;

fn key() -> SecretKey {
    SecretKey::from_seed(SEED).expect("a key")
}

/// The lines of the transmitter's public key, as `vocc keys show` prints them.
pub fn trusted() -> String {
    let (name, key) = ("transmitter".into(), key().public());
    NamedKey { name, key }.to_toml().expect("TOML")
}

/// The transmitter gets a key. The receiver proves its next text, drops few frames, and reads on.
pub fn a_text_is_proven_in_time(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let write_key = Request::WriteKey {
        seed: Seed(&SEED),
        counter: COUNTER,
    };
    let line = request(&pair.socket("transmitter"), 1, &write_key);
    pair.run_ms(STORED_MS);
    drop(line);

    pair.count_anew();
    let from = pair.record.len();
    hand_over(pair, programs, folder, TEXT);
    let dropped = dropped_by_a_verdict(pair);
    arrives(pair, from, TEXT);
    let proven = format!("verdict: proven: signed by {}, counter {COUNTER}", key().public().id());
    pair.wait_since(from, &proven, ARRIVES_IN_S);
    let Tally { count, most, .. } = pair.tally(VERDICT);
    say(&format!(
        "RP2040: a verdict on {} bytes takes {most} cycles with interrupts, {:.2} s; {dropped} frames dropped meanwhile",
        TEXT.len(),
        most as f64 / CLOCK_HZ
    ));
    assert!(count == 1 && most <= VERDICT_MAX, "{count} verdicts, {most} cycles");
    assert!((1..=DROPPED_MAX).contains(&dropped), "{dropped} frames dropped");
    reads_on(pair, programs, folder, "Signed again");
}

/// Runs until the receiver has verified a text and caught up; returns how many frames it dropped since before the verdict. Code words
/// before it that can hardly be decoded have dropped frames of their own.
fn dropped_by_a_verdict(pair: &mut Pair) -> i64 {
    let from = pair.record.len();
    let mut unread = vec![];
    let mut step = |pair: &mut Pair| {
        pair.run_ms(STEP_MS);
        unread.push(pair.frames_since(from).count() as i64 - pair.tally(FRAME).count as i64);
        unread.len()
    };
    let verified = (0..ARRIVES_IN_S * 1000 / STEP_MS).find_map(|_| {
        let steps = step(pair);
        (pair.tally(VERDICT).count > 0).then_some(steps)
    });
    let verified = verified.unwrap_or_else(|| panic!("no verdict; {}", pair.said()));
    for _ in 0..CAUGHT_UP_STEPS {
        step(pair);
    }
    let verdict_ms = pair.tally(VERDICT).most as f64 / CLOCK_HZ * 1000.0;
    let begun = verified - 1 - (verdict_ms / f64::from(STEP_MS)).ceil() as usize;
    // One frame or two have begun and not ended yet: within a period the least is one.
    let least = |end: usize| unread[end - PERIOD_STEPS..end].iter().min().expect("a period has steps");
    least(unread.len()) - least(begun)
}
