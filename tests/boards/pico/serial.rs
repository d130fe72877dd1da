//! Boot, greeting, status, tables and power cuts, with the real `vocc` at a terminal.

use std::path::Path;

use link::l2a_table::L2aTable;
use serde_json::{Value, json};
use sim::l2a::table_file;
use tx_firmware::schedule::Schedule;

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::{FULL_CD_M2, REFLECTANCE, Record, carrier_edges, l2a};
use crate::power_cut::{at_every_operation, change};
use crate::terminal::Terminal;
use crate::vocc::vocc;

const NIGHT: &str = "night.toml";

/// A table of one L2A that differs from the built-in one.
fn write_table(folder: &Path, name: &str, l2a: f32) -> L2aTable {
    let table = L2aTable::new(&[50.0, 16_000.0], &[1.0], &[l2a; 2]).expect("a table");
    std::fs::write(folder.join(name), table_file(&table)).expect("the folder can be written");
    table
}

fn close(value: &Value, expected: f64) -> bool {
    (value.as_f64().expect("a number") / expected - 1.0).abs() < 0.005
}

/// A table's CRC in the format of `vocc`.
fn crc(table: &L2aTable) -> Value {
    json!(format!("{:08x}", table.crc()))
}

/// (a) The board starts and reports its identity and status.
pub fn boots_and_says_how_it_is(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &[]);
    board.light(1000.0, Fault::None);
    // One second of the firmware's time, which begins after its start.
    board.run_ms(1100);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert!(close(&status["illuminance_lx"], 1000.0), "{status}");
    let l2a = l2a(1000.0);
    assert!(close(&status["l2a"], l2a), "{status}");
    assert!(close(&status["luminance_cd_m2"], l2a * 1000.0 * REFLECTANCE), "{status}");
    assert!(close(&status["duty"], l2a * 1000.0 * REFLECTANCE / FULL_CD_M2), "{status}");
    assert_eq!(status["faults"], json!(["no_table", "no_calibration"]), "{status}");
    assert_eq!(status["table_crc"], crc(&L2aTable::default()), "{status}");
    assert!(status["uptime_s"].as_u64() >= Some(1), "{status}");
    assert_eq!(
        (&status["symbol_rate_hz"], &status["carrier_cycles"]),
        (&json!(90.2), &json!(16)),
        "{status}"
    );
}

/// (b) A table that was sent survives a power cut and is read back byte for byte.
pub fn a_table_outlives_a_power_cut(programs: &Programs, folder: &Path) {
    let table = write_table(folder, NIGHT, 1.25);
    {
        let mut board = Emulator::power_up(programs, folder, &[]);
        board.light(1000.0, Fault::None);
        board.run_ms(500);
        board.real_time(true);
        let terminal = Terminal::open(board.socket());
        vocc(programs, folder, &["table", "push", NIGHT], terminal.name()).json();
    }
    let mut board = Emulator::power_up(programs, folder, &[]);
    board.light(1000.0, Fault::None);
    board.run_ms(500);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(status["table_crc"], crc(&table), "{status}");
    assert_eq!(status["faults"], json!(["no_calibration"]), "{status}");
    assert!(close(&status["luminance_cd_m2"], 1.25 * 1000.0 * REFLECTANCE), "{status}");
    vocc(programs, folder, &["table", "pull", "back.toml"], terminal.name()).json();
    vocc(programs, folder, &["table", "verify", "back.toml"], terminal.name()).json();
}

/// A store's area with foreign contents, in the slowest flash: symbols keep their clock, and nothing is reset.
pub fn a_flash_that_held_something_else_is_taken_over_while_symbols_go_on(programs: &Programs, folder: &Path) {
    let table = write_table(folder, NIGHT, 1.25);
    fill_store(programs, folder);
    let mut board = Emulator::power_up(programs, folder, &["--slow-flash"]);
    let mut record = Record::default();
    record.extend(&board.run_ms(500));
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let before = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(before["faults"], json!(["store", "no_table", "no_calibration"]), "{before}");
    vocc(programs, folder, &["table", "push", NIGHT], terminal.name()).json();
    vocc(programs, folder, &["device", "rate", "90.2"], terminal.name()).json();
    let mut events = board.real_time(false);
    events.extend(board.run_ms(500));
    assert!(events.iter().all(|event| event.reset.is_none()));
    record.extend(&events);
    assert_beacons(&record);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(status["table_crc"], crc(&table), "{status}");
}

/// Flashes a board whose store has foreign contents in every byte.
pub fn fill_store(programs: &Programs, folder: &Path) {
    const STORE_BYTES: usize = 64 * 1024;
    drop(Emulator::power_up(programs, folder, &[]));
    let flashed = folder.join("flash.bin");
    let mut bytes = std::fs::read(&flashed).expect("the flash is a file");
    let place = bytes.len() - STORE_BYTES;
    bytes[place..].fill(0x5a);
    std::fs::write(&flashed, &bytes).expect("the flash is a file");
}

/// Checks that there are a new board's beacons from the first panel that is not dark, without a gap.
pub fn assert_beacons(record: &Record) {
    let mut beacons = Schedule::new();
    let due = std::iter::repeat_with(|| carrier_edges(beacons.next_panel())).flatten();
    for (edge, panel) in record.lit_symbols().iter().zip(due) {
        assert_eq!(edge.panel, panel, "at {} ns", edge.ns);
    }
}

/// After a power cut in the flash operations of an update, one of the two tables is intact.
pub fn a_power_cut_in_an_update_leaves_one_table_whole(programs: &Programs, folder: &Path) {
    let [old, new] = [write_table(folder, "old.toml", 1.5), write_table(folder, "new.toml", 2.5)];
    change(programs, folder, &["table", "push", "old.toml"]);
    let push = ["table", "push", "new.toml"];
    let cuts = at_every_operation(programs, folder, &push, |terminal, operations| {
        let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
        let found = &status["table_crc"];
        assert!(*found == crc(&old) || *found == crc(&new), "after {operations}: {status}");
        assert_eq!(status["faults"], json!(["no_calibration"]), "after {operations}");
        *found == crc(&new)
    });
    assert!(cuts > 2, "{cuts}");
}
