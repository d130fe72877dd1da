//! The desk kit: a board without a light sensor, and a module with a MAX7219. The test decodes the bits that SPI shifts into the module.

use std::path::Path;

use link::panel::PanelFrame;
use serde_json::json;

use vocc_tests::programs::root;

use crate::closed_loop::Film;
use crate::emulator::{Emulator, Event};
use crate::image::Programs;
use crate::panel::{Symbol, from_message_on};
use crate::restart::PANIC;
use crate::terminal::Terminal;
use crate::vocc::vocc;

const MESSAGE: &str = "Sent from a module on the desk";
/// Luminance of an On LED at the chip's maximum intensity, for the board's typical panel, in cd/m².
const FULL_CD_M2: f64 = 600.0;
/// Reflectance of the LEDs.
const REFLECTANCE: f64 = 0.3;
/// The night limit of `tx_firmware::transmitter`, 4·50 lx·R, as an intensity of the chip: the second of sixteen.
const NIGHT_STEP: u8 = 1;

/// Illuminance of a lit room.
const LUX: f64 = 300.0;
/// A webcam that films the module, which lights each row for an eighth of 1/800 s in turn.
const DESK: &str = "docs/scenes/desk.toml";
/// Time for the panels that were prepared before the flash was written.
const READY_MS: u32 = 2_000;
/// Duration of the film: four repeats of the message.
const FILMED_MS: u32 = 2_500;
/// Time for shifting all registers of the chip, with a margin, in ns.
const SHIFTED_NS: u64 = 100_000;

/// The chip's registers (MAX7219 datasheet, Table 2).
const ROW_0: usize = 0x1;
const DECODE_MODE: usize = 0x9;
const INTENSITY: usize = 0xa;
const SCAN_LIMIT: usize = 0xb;
const SHUTDOWN: usize = 0xc;
const DISPLAY_TEST: usize = 0xf;

/// A module: the contents of its registers, and the panels that its LEDs have shown.
#[derive(Default)]
struct Module {
    registers: [u8; 16],
    symbols: Vec<Symbol>,
}

impl Module {
    /// Adds the emulator's events: registers that change together are one panel.
    fn extend(&mut self, events: &[Event]) {
        for event in events {
            let (Some(register), Some(value)) = (event.register, event.value) else {
                continue;
            };
            self.registers[register] = value;
            let panel = self.panel();
            match self.symbols.last_mut() {
                Some(last) if event.ns - last.ns < SHIFTED_NS => last.panel = panel,
                Some(last) if last.panel == panel => {}
                _ => self.symbols.push(Symbol { ns: event.ns, panel }),
            }
        }
    }

    /// The lit LEDs: segment DP, bit 7, is the left column.
    fn panel(&self) -> PanelFrame {
        if self.step().is_none() {
            return PanelFrame::default();
        }
        let rows = &self.registers[ROW_0..ROW_0 + 8];
        let bits = rows.iter().rev().fold(0, |bits, row| bits << 8 | u64::from(row.reverse_bits()));
        PanelFrame::from_bits(bits)
    }

    /// The intensity; none in shutdown. All other registers must be set for 64 LEDs.
    fn step(&self) -> Option<u8> {
        if self.registers[SHUTDOWN] & 1 == 0 {
            return None;
        }
        let others = [DECODE_MODE, SCAN_LIMIT, DISPLAY_TEST].map(|other| self.registers[other]);
        assert_eq!(others, [0, 7, 0], "{:?}", self.registers);
        Some(self.registers[INTENSITY])
    }

    /// Luminance of an On LED: an intensity of n lights a row for 2n + 1 of 32 parts of its time, at most 31.
    fn luminance_cd_m2(&self) -> f64 {
        self.step().map_or(0.0, |step| FULL_CD_M2 * f64::from(2 * step + 1) / 31.0)
    }
}

/// A kit that has stopped waiting for a light sensor.
fn shining(programs: &Programs, folder: &Path) -> (Emulator, Module) {
    let mut board = Emulator::power_up_kit(programs, folder);
    let mut module = Module::default();
    module.extend(&board.run_ms(1_900));
    assert_eq!(module.step(), None, "dark until it is clear that no light is read");
    module.extend(&board.run_ms(1_200));
    assert_eq!(module.step(), Some(NIGHT_STEP));
    (board, module)
}

/// A message from `vocc` passes through the board, the chip's registers and its scanned rows to a camera's frames, and is received.
pub fn the_desk_kit_is_read_by_a_camera_on_the_desk(programs: &Programs, folder: &Path) {
    let (mut board, mut module) = shining(programs, folder);
    module.extend(&board.real_time(true));
    let terminal = Terminal::open(board.socket());
    let ask = |command: &[&str]| vocc(programs, folder, command, terminal.name()).json();
    let status = ask(&["device", "status"]);
    assert_eq!(status["light"], "lost", "{status}");
    assert_eq!(
        status["faults"],
        json!(["sensor_missing", "no_table", "no_calibration"]),
        "{status}"
    );
    let camera = ["--camera-fps", "30", "--exposure", "0.01"];
    let told = ask(&[&["device", "rate"], &camera[..]].concat());
    assert_eq!(told["symbol_rate_hz"], 23.077);
    ask(&["device", "send", "--message", MESSAGE]);
    module.extend(&board.real_time(false));
    module.extend(&board.run_ms(READY_MS + FILMED_MS));
    let filmed_from_ns = from_message_on(&module.symbols, MESSAGE.as_bytes(), |panel| vec![panel])[0].ns;
    let luminance_cd_m2 = module.luminance_cd_m2();
    let desk = root().join(DESK);
    let desk = desk.to_str().expect("a name");
    let film = Film::new(desk, &["effects.scanning=on"], LUX, REFLECTANCE);
    let messages = film.messages(&module.symbols, |_| luminance_cd_m2, filmed_from_ns);
    assert!(messages.iter().any(|message| message == MESSAGE.as_bytes()), "{messages:?}");
}

/// A panic makes the module dark at once, although the module keeps its last panel; it shines again after the restart.
pub fn the_desk_kit_is_dark_when_it_cannot_go_on(programs: &Programs, folder: &Path) {
    let (mut board, mut module) = shining(programs, folder);
    let _ = board.run_ms(1);
    board.enter(PANIC);
    let events = board.run_ms(80);
    let lit_ms = events.last().map_or(f64::NAN, |event| event.lit_nanos) / 1e6;
    assert!(lit_ms < 0.2, "{lit_ms} ms");
    module.extend(&events);
    assert!(events.iter().any(|event| event.reset.is_some()));
    assert_eq!(module.step(), None);
    module.extend(&board.run_ms(3_000));
    assert_eq!(module.step(), Some(NIGHT_STEP));
}
