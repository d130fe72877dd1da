//! Start and restart: the LEDs are dark while the state is unknown, and the board never hangs.

use std::path::Path;

use serde_json::{Value, json};

use crate::emulator::{Emulator, Event, Fault};
use crate::image::Programs;
use crate::panel::{REFLECTANCE, Record, l2a};
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// The function that every panic ends in.
pub const PANIC: &str = "rust_begin_unwind";

/// Time for which the LEDs were lit during a finished run, in ms.
fn lit_ms(events: &[Event]) -> f64 {
    events.last().map_or(f64::NAN, |event| event.lit_nanos) / 1e6
}

/// A board that shows its panel in daylight.
fn shining(programs: &Programs, folder: &Path) -> Emulator {
    shining_kit(programs, folder, &[])
}

/// The same in a kit with these options of the emulator.
fn shining_kit(programs: &Programs, folder: &Path, kit: &[&str]) -> Emulator {
    let mut board = Emulator::power_up(programs, folder, &[&["--edges"], kit].concat());
    board.light(9_000.0, Fault::None);
    let dark = board.run_ms(90);
    assert!(lit_ms(&dark) == 0.0, "dark until the first reading: {} ms", lit_ms(&dark));
    let lit = board.run_ms(500);
    assert!(lit_ms(&lit) > 50.0, "{} ms", lit_ms(&lit));
    board
}

/// A kit by the emulator's options. Without any, gate and registers have the LEDs' supply.
type Kit = &'static [&'static str];

/// The same, with gate and registers fed by the Pico.
const FED_BY_PICO: Kit = &["--at-3v3", "gate", "--at-3v3", "registers"];

/// How the board enters a state, and kits that lack what keeps the panel dark in it.
type DarkState = (fn(&mut Emulator), &'static [Kit]);

/// The states in which no program reaches the LEDs.
const DARK_STATES: [DarkState; 4] = [
    (Emulator::enter_boot_loader, &[&["--stage", "buffer"]]),
    (Emulator::lose_power, &[&["--stage", "buffer"], &["--at-3v3", "gate"]]),
    (Emulator::break_wire, &[&["--stage", "no-resistor"]]),
    (Emulator::cut_supply, &[&["--direct"]]),
];

/// Without a program, no state lights the LEDs, whatever the registers hold. In a kit that lacks the part that keeps them dark, each may.
pub fn it_is_dark_without_a_program(programs: &Programs, folder: &Path) {
    for (number, (enter, faulty)) in DARK_STATES.into_iter().enumerate() {
        for kit in [&[], FED_BY_PICO] {
            let mut board = shining_kit(programs, folder, kit);
            enter(&mut board);
            let dark = board.run_ms(200);
            assert!(lit_ms(&dark) == 0.0, "state {number}, kit {kit:?}: {} ms", lit_ms(&dark));
        }
        for kit in faulty {
            let mut board = Emulator::power_up(programs, folder, &[&["--edges"], *kit].concat());
            board.run_ms(90);
            enter(&mut board);
            let lit = board.run_ms(200);
            assert!(lit_ms(&lit) > 199.0, "state {number}, kit {kit:?}: {} ms", lit_ms(&lit));
        }
    }
}

fn resets(events: &[Event]) -> Vec<&str> {
    events.iter().filter_map(|event| event.reset.as_deref()).collect()
}

/// After a restart, the panel shines again, and the status says what happened.
fn is_back(board: &mut Emulator, programs: &Programs, folder: &Path) {
    let mut record = Record::default();
    record.extend(&board.run_ms(500));
    assert!(record.last_pulses().luminance_cd_m2() > 1_000.0, "{:?}", record.last_pulses());
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    let faults = status["faults"].as_array().expect("a list");
    assert!(faults.contains(&Value::from("watchdog")), "{status}");
}

/// The watchdog restarts a program that hangs.
pub fn a_program_that_hangs_is_restarted(programs: &Programs, folder: &Path) {
    let mut board = shining(programs, folder);
    board.hang(true);
    let events = board.run_ms(2_050);
    assert_eq!(resets(&events), ["timed out"]);
    is_back(&mut board, programs, folder);
}

/// A reset comes while the light sensor is being read, and the sensor then holds the bus: the board frees it, and measures at once.
pub fn a_sensor_that_holds_the_bus_is_made_to_let_go(programs: &Programs, folder: &Path) {
    let mut board = shining(programs, folder);
    board.light(9_000.0, Fault::Holding);
    board.enter(PANIC);
    assert_eq!(resets(&board.run_ms(80)), ["forced"]);
    is_back(&mut board, programs, folder);
}

/// The sensor misses clocks while it is being read, holds the bus then, and the light changes: the board frees the bus without a restart,
/// and follows the light.
pub fn a_sensor_that_misses_clocks_is_made_to_let_go(programs: &Programs, folder: &Path) {
    let mut board = shining(programs, folder);
    board.light(900.0, Fault::Holding);
    let mut record = Record::default();
    let events = board.run_ms(3_500);
    record.extend(&events);
    assert!(resets(&events).is_empty());
    let given = record.last_pulses().luminance_cd_m2();
    let wanted = l2a(900.0) * 900.0 * REFLECTANCE;
    assert!((given / wanted - 1.0).abs() < 0.1, "{given} instead of {wanted} cd/m²");
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(
        (&status["light"], &status["faults"]),
        (&json!("measured"), &json!(["no_table", "no_calibration"])),
        "{status}"
    );
}

/// A panic makes the LEDs dark at once and restarts.
pub fn a_panic_is_dark_and_restarts(programs: &Programs, folder: &Path) {
    ends_dark_and_restarts(programs, folder, |board| board.enter(PANIC));
}

/// So does a fault of the processor.
pub fn a_hard_fault_is_dark_and_restarts(programs: &Programs, folder: &Path) {
    ends_dark_and_restarts(programs, folder, Emulator::hard_fault);
}

fn ends_dark_and_restarts(programs: &Programs, folder: &Path, end: impl Fn(&mut Emulator)) {
    let mut board = shining(programs, folder);
    end(&mut board);
    let events = board.run_ms(80);
    assert_eq!(resets(&events), ["forced"]);
    assert!(lit_ms(&events) < 0.001, "{} ms", lit_ms(&events));
    is_back(&mut board, programs, folder);
}
