//! A transmitter and a receiver on emulated boards, connected by light.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Value, json};

use vocc_tests::emulator::Emulation;

use crate::image::Programs;

/// Time step of a wait, in ms.
const STEP_MS: u32 = 500;

/// An event of the emulator.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Event {
    /// Simulated time since the transmitter's power-up, ns.
    pub ns: u64,
    /// The board: `transmitter` or `receiver`.
    pub board: String,
    /// The panel that the transmitter shows from now on: 16 hexadecimal digits.
    pub panel: Option<String>,
    /// A line of text from the receiver.
    pub text: Option<String>,
    /// A line of text over USB.
    pub usb: Option<String>,
    /// Whether the receiver's lamp is lit from now on.
    pub lamp: Option<bool>,
    /// The number of the frame that begins.
    pub frame: Option<u64>,
    /// The exposure of each line.
    pub exposure_ms: f64,
    /// The camera's gain.
    pub gain: f64,
    /// The warning that the receiver may be too slow for the camera's pixels.
    pub late: Option<String>,
    /// The address at which the processor faulted.
    pub fault_at: Option<u32>,
    /// Why a board was reset.
    pub reset: Option<String>,
    /// The answer to a run: its end time.
    pub ran: Option<u64>,
    /// Cycles by function or interrupt.
    pub cycles: Option<HashMap<String, Tally>>,
    listening: Option<String>,
    real_time: Option<bool>,
    error: Option<String>,
}

impl Event {
    /// Whether the event is a line of text with this beginning.
    pub fn says(&self, beginning: &str) -> bool {
        let text = self.text.as_deref();
        text.is_some_and(|text| text.starts_with(beginning))
    }

    /// The camera's sensitivity: exposure times gain.
    pub fn sensitivity(&self) -> f64 {
        self.exposure_ms * self.gain
    }
}

/// The cycles of a function.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub struct Tally {
    /// The number of calls.
    pub count: u64,
    /// Mean cycles per call.
    pub mean: u64,
    /// Maximum cycles per call.
    pub most: u64,
}

/// Both boards; initially, only the transmitter has power.
pub struct Pair {
    emulation: Emulation<Event>,
    folder: PathBuf,
    /// All events in order of time.
    pub record: Vec<Event>,
}

impl Pair {
    /// Boards whose flash chips are in `folder`, and the camera's scene with these changes; new boards are flashed first.
    pub fn new(programs: &Programs, folder: &Path, scene: &[&str], options: &[&str]) -> Self {
        let options = options.iter().map(OsStr::new);
        let files = [&programs.transmitter, &programs.receiver, folder].map(Path::as_os_str);
        let eye = [OsStr::new("--"), programs.eye.as_os_str(), OsStr::new("hm01b0")];
        let arguments = options.chain(files).chain(eye).chain(scene.iter().map(OsStr::new));
        let mut pair = Self {
            emulation: Emulation::start("two_picos.mjs", arguments),
            folder: folder.to_owned(),
            record: vec![],
        };
        for _ in ["transmitter", "receiver", "receiver_usb"] {
            pair.until(|event| event.listening.is_some());
        }
        pair
    }

    /// The Unix socket that is UART 0 of a board, or `receiver_usb`, the receiver's port over USB.
    pub fn socket(&self, port: &str) -> PathBuf {
        self.folder.join(port)
    }

    /// Runs for this simulated time; returns the events.
    pub fn run_ms(&mut self, milliseconds: u32) -> &[Event] {
        let from = self.record.len();
        self.tell(&json!({ "run_ms": milliseconds }));
        self.until(|event| event.ran.is_some());
        &self.record[from..]
    }

    /// Starts or stops real time.
    pub fn real_time(&mut self, on: bool) {
        self.tell(&json!({ "real_time": on }));
        self.until(|event| event.real_time == Some(on));
    }

    /// Sends a command: `tests/boards/emulator/two_picos.mjs` lists them.
    pub fn tell(&mut self, command: &Value) {
        self.emulation.command(command);
    }

    /// Runs until the receiver sends a line with this beginning; returns the event.
    pub fn wait_for(&mut self, beginning: &str, at_most_s: u32) -> Event {
        for _ in 0..at_most_s * 1000 / STEP_MS {
            let happened = self.run_ms(STEP_MS);
            if let Some(event) = happened.iter().find(|event| event.says(beginning)) {
                return event.clone();
            }
        }
        panic!("no line {beginning:?} within {at_most_s} s; {}", self.said());
    }

    /// Like `wait_for`, but accepts a line since an event, given by its number in the record.
    pub fn wait_since(&mut self, from: usize, beginning: &str, at_most_s: u32) -> Event {
        let already = self.record[from..].iter().find(|event| event.says(beginning));
        match already.cloned() {
            Some(event) => event,
            None => self.wait_for(beginning, at_most_s),
        }
    }

    /// The reasons for the receiver's resets since an event, given by its number in the record.
    pub fn resets_since(&self, from: usize) -> Vec<&str> {
        let happened = self.record[from..].iter();
        happened.filter_map(|event| event.reset.as_deref()).collect()
    }

    /// The receiver's last lines.
    pub fn said(&self) -> String {
        let lines = self.record.iter().filter_map(|event| event.text.as_deref());
        let lines: Vec<&str> = lines.collect();
        let last = lines.len().saturating_sub(20);
        format!("it said: {:#?}", &lines[last..])
    }

    /// Gives the receiver power.
    pub fn turn_on(&mut self) {
        self.tell(&json!({ "receiver": "on" }));
    }

    /// The cycles that a function took until the end of the last run.
    pub fn tally(&self, function: &str) -> Tally {
        let counted = self.record.iter().rev().find_map(|event| event.cycles.as_ref());
        let tally = counted.and_then(|counted| counted.get(function));
        tally.copied().unwrap_or_default()
    }

    /// Forgets the cycles so far.
    pub fn count_anew(&mut self) {
        self.tell(&json!({ "count_anew": true }));
    }

    /// Simulated time of the last event, in ns.
    pub fn now_ns(&self) -> u64 {
        let told = self.record.last();
        told.map_or(0, |event| event.ns.max(event.ran.unwrap_or(0)))
    }

    /// The frames that began from an event on, given by its number in the record.
    pub fn frames_since(&self, from: usize) -> impl DoubleEndedIterator<Item = &Event> {
        self.record[from..].iter().filter(|event| event.frame.is_some())
    }

    fn until(&mut self, last: impl Fn(&Event) -> bool) {
        loop {
            let event = self.emulation.next_event();
            assert_eq!(event.error, None, "at {} ns of {}", event.ns, event.board);
            let done = last(&event);
            self.record.push(event);
            if done {
                return;
            }
        }
    }
}
