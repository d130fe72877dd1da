//! The symbol rate is set over the serial port, shown at the latch, and restored after a power cut.

use std::path::Path;

use serde_json::{Value, json};
use tx_firmware::schedule::Schedule;

use crate::emulator::Emulator;
use crate::image::Programs;
use crate::panel::Record;
use crate::power_cut::{at_every_operation, change};
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// Maximum relative error of a symbol's length: half a count of the clock's counter, and the clock's own step.
const LENGTH_ERROR_MAX: f64 = 2e-5;
/// Maximum extension of the first symbol of a rate, in s, because the clock is stopped while the rate is set.
const STOPPED_S: f64 = 4e-6;

/// Reads or sets the rate, with these arguments of `vocc device rate`.
fn rate_hz(board: &mut Emulator, programs: &Programs, folder: &Path, words: &[&str]) -> Value {
    let terminal = Terminal::open(board.socket());
    let told = vocc(programs, folder, &[&["device", "rate"], words].concat(), terminal.name());
    told.json()["symbol_rate_hz"].clone()
}

/// Number of successive symbols with this rate from the beginning on, and the rest.
fn of_rate(lengths_s: &[f64], rate_hz: f64) -> (usize, &[f64]) {
    let is_of_rate = |&(index, length_s): &(usize, &f64)| {
        let longer_s = if index == 0 { STOPPED_S } else { 0.0 };
        (length_s - 1.0 / rate_hz).abs() <= LENGTH_ERROR_MAX / rate_hz + longer_s
    };
    let count = lengths_s.iter().enumerate().take_while(is_of_rate).count();
    (count, &lengths_s[count..])
}

/// The latch switches from one rate to the next between two symbols, no symbol is lost or repeated, and a restart keeps the rate.
pub fn a_symbol_rate_changes_at_a_symbol_and_outlives_a_restart(programs: &Programs, folder: &Path) {
    let rates_hz = [27.0, 216.0, 9.0];
    {
        let mut board = Emulator::power_up_still(programs, folder, &[]);
        let mut record = Record::default();
        record.extend(&board.run_ms(500));
        for (before_hz, told) in [(90.0, "27"), (27.0, "216"), (216.0, "9")] {
            board.real_time(true);
            assert_eq!(rate_hz(&mut board, programs, folder, &[]), json!(before_hz));
            let wanted_hz: f64 = told.parse().expect("a number");
            assert_eq!(rate_hz(&mut board, programs, folder, &[told]), json!(wanted_hz));
            record.extend(&board.real_time(false));
            record.extend(&board.run_ms(600));
        }
        let lengths_s: Vec<f64> = record
            .symbols
            .windows(2)
            .map(|pair| (pair[1].ns - pair[0].ns) as f64 / 1e9)
            .collect();
        let mut rest = &lengths_s[..];
        for rate_hz in [90.0].into_iter().chain(rates_hz) {
            let (count, others) = of_rate(rest, rate_hz);
            assert!(count > 4, "{count} symbols at {rate_hz} a second, then {others:?}");
            rest = others;
        }
        assert_eq!(rest, [0.0; 0], "symbols of another length");
        let mut beacons = Schedule::new();
        let due = std::iter::repeat_with(|| beacons.next_panel());
        let first = record
            .symbols
            .iter()
            .position(|symbol| symbol.panel.bits() != 0)
            .expect("symbols are shown");
        for (symbol, panel) in record.symbols[first..].iter().zip(due) {
            assert_eq!(symbol.panel, panel, "at {} ns", symbol.ns);
        }
    }
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    record.extend(&board.run_ms(1_000));
    assert!(record.symbols.len() >= 8, "{} symbols", record.symbols.len());
    for pair in record.symbols.windows(2) {
        let length_s = (pair[1].ns - pair[0].ns) as f64 / 1e9;
        assert_eq!(of_rate(&[length_s], 9.0).0, 1, "{length_s} s");
    }
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(status["symbol_rate_hz"], json!(9.0), "{status}");
}

/// After a power cut in the flash operations of a change, one of the two rates applies, and the table is intact.
pub fn a_power_cut_in_a_change_leaves_one_rate(programs: &Programs, folder: &Path) {
    change(programs, folder, &["device", "rate", "54"]);
    let slower = ["device", "rate", "27"];
    at_every_operation(programs, folder, &slower, |terminal, operations| {
        let told = vocc(programs, folder, &["device", "rate"], terminal.name()).json();
        let found = &told["symbol_rate_hz"];
        assert!(*found == json!(54.0) || *found == json!(27.0), "after {operations}: {found}");
        *found == json!(27.0)
    });
}
