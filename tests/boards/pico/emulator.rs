//! A transmitter's image on an emulated board: power, light, and the pins.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use link::serial::Request;
use link::symbol_rate::SymbolRate;
use serde::Deserialize;
use serde_json::{Value, json};

use vocc_tests::emulator::{self, Emulation};

use crate::image::Programs;

pub use vocc_tests::driven_panel::CLOCK_HZ;

/// An event of the emulator.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Event {
    /// Simulated time since power-up, ns.
    pub ns: u64,
    /// The LEDs at an edge of the latch: 16 hexadecimal digits.
    pub panel: Option<String>,
    /// The pulse of the dimming, in cycles.
    pub lit_cycles: Option<u32>,
    /// The period of the dimming, in cycles.
    pub period_cycles: Option<u32>,
    /// Whether the LEDs' low current was switched on.
    pub low_current: Option<bool>,
    /// A register of a MAX7219 that has changed.
    pub register: Option<usize>,
    /// The register's new value.
    pub value: Option<u8>,
    /// Why the board was reset.
    pub reset: Option<String>,
    /// The answer to a run: its end time.
    pub ran: Option<u64>,
    /// Time for which the output-enable line lit the LEDs during a run.
    pub lit_nanos: f64,
    /// Cycles by function or interrupt.
    pub cycles: Option<Value>,
    listening: Option<String>,
    real_time: Option<bool>,
    error: Option<String>,
}

/// A fault of the light sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    None,
    Missing,
    Stuck,
    Silent,
    Hanging,
    /// It holds the data line, as if it had missed clocks, and at the next start, as if a reset had come while it was being read.
    Holding,
}

/// A powered board.
pub struct Emulator {
    emulation: Emulation<Event>,
    socket: PathBuf,
}

impl Emulator {
    /// Powers up a board whose flash is in `folder`; a new one is flashed first.
    pub fn power_up(programs: &Programs, folder: &Path, options: &[&str]) -> Self {
        Self::power_up_with(&programs.image, folder, options)
    }

    /// Powers up a board that has stored still panels; a new one is flashed first, and stores them.
    pub fn power_up_still(programs: &Programs, folder: &Path, options: &[&str]) -> Self {
        {
            let mut board = Self::power_up(programs, folder, &[]);
            board.run_ms(100);
            board.store_still(1, 200);
        }
        Self::power_up(programs, folder, options)
    }

    /// Powers up the desk kit: a board without a light sensor, and a module with a MAX7219.
    pub fn power_up_kit(programs: &Programs, folder: &Path) -> Self {
        Self::power_up_with(&programs.kit, folder, &["--max7219"])
    }

    /// Powers up a board with this image, without options.
    pub fn power_up_image(image: &Path, folder: &Path) -> Self {
        Self::power_up_with(image, folder, &[])
    }

    fn power_up_with(image: &Path, folder: &Path, options: &[&str]) -> Self {
        let socket = folder.join("uart0");
        let flash = folder.join("flash.bin");
        let files = [image, &flash, &socket].map(Path::as_os_str);
        let arguments = files.into_iter().chain(options.iter().map(OsStr::new));
        let emulation = Emulation::start("emulator.mjs", arguments);
        let mut emulator = Self { emulation, socket };
        emulator.until(|event| event.listening.is_some());
        emulator
    }

    /// The Unix socket of UART 0.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Runs for this simulated time and returns the events; the last one marks the end.
    pub fn run_ms(&mut self, milliseconds: u32) -> Vec<Event> {
        self.emulation.command(&json!({ "run_ms": milliseconds }));
        self.until(|event| event.ran.is_some())
    }

    /// The events in some time after a request.
    pub fn ask(&mut self, sequence: u32, request: &Request<'_>, milliseconds: u32) -> Vec<Event> {
        let _line = emulator::request(self.socket(), sequence, request);
        self.run_ms(milliseconds)
    }

    /// Stores still panels, and runs for some time.
    pub fn store_still(&mut self, sequence: u32, milliseconds: u32) -> Vec<Event> {
        let still = Request::WriteCarrier {
            millihertz: SymbolRate::DEFAULT.millihertz(),
            cycles: 0,
        };
        self.ask(sequence, &still, milliseconds)
    }

    /// Starts or stops real time; returns the events before.
    pub fn real_time(&mut self, on: bool) -> Vec<Event> {
        self.emulation.command(&json!({ "real_time": on }));
        self.until(|event| event.real_time == Some(on))
    }

    /// Sets the light on the sensor.
    pub fn light(&mut self, lux: f64, fault: Fault) {
        let fault = format!("{fault:?}").to_lowercase();
        self.emulation.command(&json!({ "lux": lux, "fault": fault }));
    }

    /// Cuts the power halfway through a flash operation, after this many more.
    pub fn cut_power_after(&mut self, operations: u32) {
        self.emulation.command(&json!({ "cut_after": operations }));
    }

    /// Stops only the processor, or lets it continue.
    pub fn hang(&mut self, on: bool) {
        self.emulation.command(&json!({ "hang": on }));
    }

    /// Restarts the chip in its boot loader, where it runs no program.
    pub fn enter_boot_loader(&mut self) {
        self.emulation.command(&json!({ "boot_loader": true }));
    }

    /// Removes the Pico's power; what it does not feed keeps its own supply.
    pub fn lose_power(&mut self) {
        self.emulation.command(&json!({ "power": false }));
    }

    /// Breaks the wire from the dimming's pin to the gate.
    pub fn break_wire(&mut self) {
        self.emulation.command(&json!({ "wire": false }));
    }

    /// Removes the LEDs' supply, which feeds all that the Pico does not feed.
    pub fn cut_supply(&mut self) {
        self.emulation.command(&json!({ "supply": false }));
    }

    /// Continues in the function with this name.
    pub fn enter(&mut self, function: &str) {
        self.emulation.command(&json!({ "enter": function }));
    }

    /// Makes the processor fault.
    pub fn hard_fault(&mut self) {
        self.emulation.command(&json!({ "hard_fault": true }));
    }

    /// Whether the power is off.
    pub fn is_off(&mut self) -> bool {
        self.emulation.is_over()
    }

    fn until(&mut self, last: impl Fn(&Event) -> bool) -> Vec<Event> {
        let mut events = vec![];
        loop {
            let event = self.emulation.next_event();
            assert_eq!(event.error, None, "at {} ns", event.ns);
            let done = last(&event);
            events.push(event);
            if done {
                return events;
            }
        }
    }
}
