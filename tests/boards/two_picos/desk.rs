//! A computer at the receiver's port.

use std::path::Path;

use serde_json::{Value, json};

use vocc_tests::terminal::Terminal;
use vocc_tests::vocc::{vocc, vocc_until};

use crate::image::Programs;
use crate::pair::Pair;
use crate::talk::{DISTANCE_M, TEXT, hand_over, talking};

const UART: &str = "receiver";
const USB: &str = "receiver_usb";
const ATTEMPTS: usize = 10;
const ANOTHER_TEXT: &str = "Hello again";
const PICTURE: &str = "frame.png";
/// Pitch of the panel, in m.
const PITCH_M: f64 = 0.06;
/// Maximum relative error of the range: a seventh of a pixel of the 34 from the first LED of a row to the last, with a margin.
const RANGE_ERROR: f64 = 0.01;
/// Minimum number of bright pixels of a panel: some of each of four On LEDs; most panels have eight times as many.
const BRIGHT_PIXELS: u32 = 16;

/// The receiver's `vocc device status`.
pub fn status(pair: &mut Pair, programs: &Programs, folder: &Path) -> Value {
    ask(pair, programs, folder, UART, &["device", "status"])
}

fn ask(pair: &mut Pair, programs: &Programs, folder: &Path, port: &str, words: &[&str]) -> Value {
    pair.real_time(true);
    let terminal = Terminal::open(&pair.socket(port));
    let answer = vocc(&programs.vocc, folder, words, terminal.name()).json();
    pair.real_time(false);
    answer
}

/// `vocc` at the receiver's port: the status and the picture, over the serial line and over USB, and the next text as it arrives.
pub fn a_computer_asks_the_receiver(programs: &Programs, folder: &Path) {
    let mut pair = talking(programs, folder);
    let status = status(&mut pair, programs, folder);
    assert_eq!(status["state"], "following", "{status}");
    assert_eq!(status["message"]["text"], TEXT, "{status}");
    assert_eq!(status["camera"]["size_px"], json!([162, 122]), "{status}");
    assert_pictured(&mut pair, programs, folder, UART, &status);
    asks_over_usb(&mut pair, programs, folder);

    let reading = reading_of_one_symbol(&mut pair, programs, folder);
    let pitches = reading["range_pitches"].as_f64().expect("a number");
    let off = pitches * PITCH_M / DISTANCE_M - 1.0;
    assert!(off.abs() < RANGE_ERROR, "{off} off, {reading}");
    assert!(shown(&pair).contains(&reading["bits"]), "{reading}");

    hand_over(&mut pair, programs, folder, ANOTHER_TEXT);
    pair.real_time(true);
    let terminal = Terminal::open(&pair.socket("receiver"));
    let watch = ["device", "watch", "--interval", "0.5"];
    let is_there = |line: &Value| line["message"]["text"] == ANOTHER_TEXT;
    let lines = vocc_until(&programs.vocc, folder, &watch, terminal.name(), is_there);
    assert!(lines.len() > 1, "it came before it was watched for: {lines:?}");
    let earlier = lines.iter().filter(|line| line["message"]["text"] == TEXT);
    assert!(earlier.count() <= 1, "told twice: {lines:?}");
}

/// Over USB, the receiver answers a computer as over the serial line: with short requests and answers, and with long ones.
fn asks_over_usb(pair: &mut Pair, programs: &Programs, folder: &Path) {
    let status = ask(pair, programs, folder, USB, &["device", "status"]);
    assert_eq!(status["message"]["text"], TEXT, "{status}");
    assert_pictured(pair, programs, folder, USB, &status);
}

/// Checks that the picture has bright pixels on the panel, and none elsewhere.
fn assert_pictured(pair: &mut Pair, programs: &Programs, folder: &Path, port: &str, status: &Value) {
    let snapshot = ["device", "snapshot", "--out", PICTURE];
    let about = ask(pair, programs, folder, port, &snapshot);
    let [inside, outside] = bright_pixels(&folder.join(PICTURE), &about, status);
    assert!(inside >= BRIGHT_PIXELS && outside == 0, "{inside}, {outside} in {about}, {status}");
}

/// The reading of a frame that shows one symbol; one frame in three shows two.
fn reading_of_one_symbol(pair: &mut Pair, programs: &Programs, folder: &Path) -> Value {
    let readings = (0..ATTEMPTS).map(|_| status(pair, programs, folder)["reading"].take());
    let of_one = |reading: &Value| reading["two_symbols"] == false;
    readings.into_iter().find(of_one).expect("a symbol is seen")
}

fn shown(pair: &Pair) -> Vec<Value> {
    let panels = pair.record.iter().filter_map(|event| event.panel.clone());
    panels.map(Value::from).collect()
}

/// Numbers of a picture's bright pixels inside and outside the panel that the status reports.
fn bright_pixels(file: &Path, about: &Value, status: &Value) -> [u32; 2] {
    let picture = image::open(file).expect("a picture").into_luma8();
    let number = |value: &Value| value.as_f64().expect("a number");
    let size = [&about["width"], &about["height"]].map(number);
    assert_eq!(size, [picture.width(), picture.height()].map(f64::from));
    let origin = [0, 1].map(|axis| number(&about["origin"][axis]));
    let step = number(&about["step"]);
    let levels = ["bright_grey", "dark_grey"].map(|level| number(&status["camera"][level]));
    let middle = (levels[0] + levels[1]) / 2.0;
    let outline = outline(status);
    let mut counts = [0; 2];
    for (x, y, _) in picture.enumerate_pixels().filter(|(_, _, grey)| f64::from(grey.0[0]) > middle) {
        let at = [origin[0] + step * f64::from(x), origin[1] + step * f64::from(y)];
        counts[usize::from(!is_inside(at, &outline))] += 1;
    }
    counts
}

/// The panel's outline in the frame, in px: half a pitch outside the corner LEDs.
fn outline(status: &Value) -> [[f64; 2]; 4] {
    let corners = serde_json::from_value(status["corners_px"].clone());
    let corners: [[f64; 2]; 4] = corners.expect("a panel is followed");
    let centre = [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0);
    corners.map(|corner| [0, 1].map(|axis| centre[axis] + (corner[axis] - centre[axis]) * 8.0 / 7.0))
}

/// Whether a point is on the same side of all edges, which are clockwise.
fn is_inside([x, y]: [f64; 2], corners: &[[f64; 2]; 4]) -> bool {
    let next = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(next)
        .all(|(from, to)| (to[0] - from[0]) * (y - from[1]) >= (to[1] - from[1]) * (x - from[0]))
}
