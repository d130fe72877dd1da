//! The whole path of a text: `vocc device send`, the transmitter's pins, light, the camera, the receiver's UART.

use std::path::Path;

use serde_json::json;

use vocc_tests::terminal::Terminal;
use vocc_tests::vocc::vocc;

use crate::film;
use crate::image::Programs;
use crate::pair::{Event, Pair};
use crate::timing::tell_latency;

/// The text that is sent.
pub const TEXT: &str = "Hello by light";
/// The receiver's output of the text.
pub const MESSAGE: &str = "message: Hello by light";
/// Simulated time within which a text must arrive, in s: for finding the panel, setting the exposure, and three repeats.
pub const ARRIVES_IN_S: u32 = 30;

/// Illuminance at the boards.
const LUX: f64 = 500.0;
/// The panel is 1.5 m in front of the camera, so that LEDs are 4.8 px apart.
pub const SCENE: [&str; 2] = ["pose.distance_m=1.5", "ambient.illuminance_lx=500"];
pub const DISTANCE_M: f64 = 1.5;
/// Symbols and frames a second: the transmitter's minimum, and the receiver's setting of its camera.
const SYMBOL_RATE: &str = "9";
const SYMBOLS_PER_FRAME: f32 = 0.68;

/// Time for the panels that were prepared before.
const READY_MS: u32 = 4_500;

/// A pair whose transmitter shows the text, and whose receiver has no power yet.
pub fn sending(programs: &Programs, folder: &Path, options: &[&str]) -> Pair {
    let mut pair = Pair::new(programs, folder, &SCENE, options);
    pair.tell(&json!({ "lux": LUX }));
    pair.run_ms(500);
    store_still(&mut pair, programs, folder);
    tell_transmitter(&mut pair, programs, folder, &["device", "rate", SYMBOL_RATE]);
    send(&mut pair, programs, folder, TEXT);
    pair
}

/// Makes the transmitter one that has started with still panels: a new one shows a carrier, which the receiver does not read.
fn store_still(pair: &mut Pair, programs: &Programs, folder: &Path) {
    tell_transmitter(pair, programs, folder, &["device", "rate", "90", "--carrier-cycles", "0"]);
    pair.tell(&json!({ "transmitter": "off" }));
    pair.run_ms(200);
    pair.tell(&json!({ "transmitter": "on" }));
    pair.run_ms(500);
}

/// Gives the transmitter another text and waits until it shows it.
pub fn send(pair: &mut Pair, programs: &Programs, folder: &Path, text: &str) {
    hand_over(pair, programs, folder, text);
    pair.run_ms(READY_MS);
}

/// Gives the transmitter another text.
pub fn hand_over(pair: &mut Pair, programs: &Programs, folder: &Path, text: &str) {
    tell_transmitter(pair, programs, folder, &["device", "send", "--message", text]);
}

/// Sends a new text, because a repeated one is output once, and waits for its arrival.
pub fn reads_on(pair: &mut Pair, programs: &Programs, folder: &Path, text: &str) {
    let from = pair.record.len();
    send(pair, programs, folder, text);
    arrives(pair, from, text);
}

/// Waits for a text, unless it has arrived since an event, given by its number in the record.
pub fn arrives(pair: &mut Pair, from: usize, text: &str) -> Event {
    pair.wait_since(from, &format!("message: {text}"), ARRIVES_IN_S)
}

fn tell_transmitter(pair: &mut Pair, programs: &Programs, folder: &Path, words: &[&str]) {
    pair.real_time(true);
    let terminal = Terminal::open(&pair.socket("transmitter"));
    vocc(&programs.vocc, folder, words, terminal.name()).json();
    pair.real_time(false);
    pair.run_ms(200);
}

/// Maximum changes of the lamp per second while it blinks slowly or flashes.
const QUICKLY: usize = 4;

/// A pair whose receiver has read the text once.
pub fn talking(programs: &Programs, folder: &Path) -> Pair {
    let mut pair = sending(programs, folder, &[]);
    pair.turn_on();
    pair.wait_for(MESSAGE, ARRIVES_IN_S);
    pair
}

/// Only light connects the boards; the second one outputs the text.
pub fn text_goes_from_one_pico_to_the_other_by_light(programs: &Programs, folder: &Path) {
    let mut pair = sending(programs, folder, &[]);
    let film = folder.join("film.pgm");
    pair.tell(&json!({ "film_to": film, "receiver": "on" }));
    let on_ns = pair.now_ns();
    let mut arrived = None;
    for _ in 0..ARRIVES_IN_S {
        let happened = pair.run_ms(1_000);
        arrived = happened.iter().find(|event| is_text(event)).cloned();
        if arrived.is_some() {
            break;
        }
    }
    let Some(arrived) = arrived else {
        let seen = film::texts(&film, SYMBOLS_PER_FRAME);
        panic!("no text arrived; a computer reads {seen:?} in the same frames; {}", pair.said());
    };
    assert!(
        pair.record.iter().any(|event| event.usb.as_deref() == Some(MESSAGE)),
        "the text is on USB too"
    );
    let late = pair.record.iter().find_map(|event| event.late.as_deref());
    assert_eq!(late, None, "pixels may be lost on a chip");
    tell_latency(&pair, on_ns, &arrived);
    assert!(lamp_changes(&pair.record) > 0, "it flashes while it searches");
    assert!(lamp_changes(pair.run_ms(1_000)) > QUICKLY, "it blinks after a message");
}

/// Number of changes of the lamp.
fn lamp_changes(events: &[Event]) -> usize {
    let lit: Vec<bool> = events.iter().filter_map(|event| event.lamp).collect();
    lit.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

fn is_text(event: &Event) -> bool {
    event.text.as_deref() == Some(MESSAGE)
}
