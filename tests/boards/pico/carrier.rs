//! A carrier is set over the serial port, shown quarter by quarter at the latch, restored after a power cut, and received.

use std::path::Path;

use link::panel::LEDS;
use link::waveform::SymbolTiming;
use serde_json::json;
use tx_firmware::schedule::Schedule;
use tx_firmware::symbol_clock::QUARTERS;
use vocc_tests::firmware::say;
use vocc_tests::sensor::Sensor;
use vocc_tests::undersampled::{self, receive_light};

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::{Record, Symbol, carrier_edges, from_message_on};
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// Error from rounding to whole ns.
const ROUNDING_NS: f64 = 1.5;
/// Quarters of the fastest carrier in 2.2 ms, the maximum delay of an interrupt.
const LATE_QUARTERS: usize = 27;
/// Maximum relative error of a carrier's rate, without the crystal's: half a count at 3000 Hz.
const RATE_ERROR_MAX: f64 = 4.9e-5;

const MESSAGE: &str = "Sent by a carrier from the pins of a board";
/// Time for the panels that were prepared before the message was sent.
const READY_MS: u32 = 500;
/// Duration of the film.
const FILMED_MS: u32 = 1_600;
/// A new board's symbols a second, and its cycles a symbol.
const DEFAULT_HZ: f64 = SymbolTiming::CARRIER.rate().millihertz() as f64 / 1e3;
const DEFAULT_CYCLES: usize = SymbolTiming::CARRIER.waveform().cycles() as usize;
/// A typical camera.
const FILM: undersampled::Film = undersampled::Film {
    seed: 1,
    fps: 100.0,
    exposure_s: 0.000_25,
    symbol_rate_hz: DEFAULT_HZ,
    cycles: DEFAULT_CYCLES as u32,
    clock_ppm: 0.0,
    phase: 0.0,
    jitter_s: 0.0,
    line_delay_s: 0.0,
    pitch_px: undersampled::PITCH_PX,
    sensor: Sensor::USUAL,
    frames: 150,
    change: None,
};

/// Number of edges of the latch after the first one at this distance, in s.
fn regular(edges: &[Symbol], tick_s: f64) -> usize {
    let error_ns = RATE_ERROR_MAX * tick_s * 1e9 + ROUNDING_NS;
    let is_regular = |pair: &&[Symbol]| ((pair[1].ns - pair[0].ns) as f64 - tick_s * 1e9).abs() <= error_ns;
    edges.windows(2).take_while(is_regular).count()
}

/// Maximum deviation of edges, in ns.
fn jitter_ns(edges: &[Symbol]) -> f64 {
    let [first, last] = [edges[0].ns, edges[edges.len() - 1].ns].map(|ns| ns as f64);
    let tick_ns = (last - first) / (edges.len() - 1) as f64;
    let strays = edges.iter().zip(0..);
    strays.fold(0.0, |most, (edge, index)| {
        f64::max(most, (edge.ns as f64 - first - f64::from(index) * tick_ns).abs())
    })
}

/// Each symbol is whole cycles: the panel for a quarter, its complement for a half, and the panel for a quarter. No edge is early or late,
/// whatever arrives over the serial port and while the flash is written. From one carrier to the next, no symbol is lost or repeated, and a
/// restart keeps the last carrier.
pub fn a_carrier_is_shown_in_quarters_of_cycles_and_outlives_a_restart(programs: &Programs, folder: &Path) {
    // Symbols a second, and cycles a symbol.
    let told = [(90.0, 16), (27.0, 54), (300.0, 10), (27.0, 0), (100.0, 2)];
    {
        let mut board = Emulator::power_up(programs, folder, &[]);
        let mut record = Record::default();
        record.extend(&board.run_ms(500));
        for (rate_hz, cycles) in told {
            record.extend(&board.real_time(true));
            let terminal = Terminal::open(board.socket());
            let [rate, cycles] = [f64::to_string(&rate_hz), usize::to_string(&cycles)];
            let words = ["device", "rate", &rate, "--carrier-cycles", &cycles];
            vocc(programs, folder, &words, terminal.name()).json();
            record.extend(&board.real_time(false));
            record.extend(&board.run_ms(400));
        }
        let mut edges = record.lit_symbols();
        let mut beacons = Schedule::new();
        let mut beacon = beacons.next_panel();
        for (rate_hz, cycles) in [(DEFAULT_HZ, DEFAULT_CYCLES)].into_iter().chain(told) {
            let ticks = (QUARTERS.len() * cycles).max(1);
            let count = regular(edges, 1.0 / (rate_hz * ticks as f64));
            assert!(count > 4 * ticks, "{count} edges of {ticks} a symbol at {rate_hz} a second");
            for (index, edge) in edges[..=count].iter().enumerate() {
                if index > 0 && index % ticks == 0 {
                    beacon = beacons.next_panel();
                }
                let is_panel = QUARTERS[index % ticks % QUARTERS.len()];
                let shown = if is_panel { beacon.bits() } else { !beacon.bits() };
                assert_eq!(edge.panel.bits(), shown, "edge {index} at {rate_hz} symbols a second");
            }
            if cycles > 0 {
                let jitter_ns = jitter_ns(&edges[..=count]);
                say(&format!(
                    "latch: at most {jitter_ns:.0} ns early or late in {count} quarters of cycles at {} Hz",
                    rate_hz * cycles as f64
                ));
                assert!(jitter_ns <= ROUNDING_NS);
            }
            // A still panel is shown again with its carrier. A panel with a carrier has been shown except for half a cycle; if an interrupt
            // was late, the next panel has just begun and is shown again.
            let quarter = count % ticks;
            if cycles > 0 && quarter + QUARTERS.len() > ticks {
                beacon = beacons.next_panel();
            } else {
                assert!(quarter < LATE_QUARTERS, "{quarter} of {ticks}");
            }
            edges = &edges[count + 1..];
        }
        assert!(edges.is_empty(), "{} edges of another length", edges.len());
    }
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    record.extend(&board.run_ms(300));
    let count = regular(&record.symbols, 1.0 / 800.0);
    assert!(count > 200 && count == record.symbols.len() - 1, "{count}");
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let status = vocc(programs, folder, &["device", "status"], terminal.name()).json();
    assert_eq!(
        (&status["symbol_rate_hz"], &status["carrier_cycles"]),
        (&json!(100.0), &json!(2)),
        "{status}"
    );
}

/// If the processor is late by more panels than are kept ready, it does not overwrite the one whose cycles are running.
pub fn a_carrier_stays_whole_when_the_ring_runs_empty(programs: &Programs, folder: &Path) {
    const CYCLES: usize = 2;
    const TICKS: usize = QUARTERS.len() * CYCLES;
    {
        let mut board = Emulator::power_up(programs, folder, &[]);
        board.real_time(true);
        let terminal = Terminal::open(board.socket());
        vocc(
            programs,
            folder,
            &["device", "rate", "100", "--carrier-cycles", "2"],
            terminal.name(),
        )
        .json();
    }
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    // Three to five symbols, while three panels are kept ready.
    for late_ms in [32, 35, 38, 45] {
        record.extend(&board.run_ms(203));
        board.hang(true);
        record.extend(&board.run_ms(late_ms));
        board.hang(false);
    }
    record.extend(&board.run_ms(200));
    let dark = record
        .symbols
        .iter()
        .take_while(|edge| edge.panel.bits() == 0 || edge.panel.bits() == u64::MAX)
        .count();
    let edges = &record.symbols[dark..];
    assert!(edges.len() > 100 * TICKS, "{} edges", edges.len());
    for (index, symbol) in edges.chunks_exact(TICKS).enumerate() {
        let bits = symbol[0].panel.bits();
        let is_whole = |(edge, is_panel): (&Symbol, &bool)| edge.panel.bits() == if *is_panel { bits } else { !bits };
        assert!(
            symbol.iter().zip(QUARTERS.iter().cycle()).all(is_whole),
            "symbol {index}: {symbol:?}"
        );
    }
}

/// A new board, to which only a message is sent, shows it by a carrier; a camera exposes the LEDs' light, and a receiver that knows only the
/// frame rate decodes the frames.
pub fn a_message_of_a_new_board_is_received_by_a_camera(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &[]);
    board.light(4_000.0, Fault::None);
    board.run_ms(500);
    board.real_time(true);
    let terminal = Terminal::open(board.socket());
    let mut record = Record::default();
    vocc(programs, folder, &["device", "send", "--message", MESSAGE], terminal.name()).json();
    record.extend(&board.real_time(false));
    record.extend(&board.run_ms(READY_MS + FILMED_MS));
    let edges = from_message_on(&record.symbols, MESSAGE.as_bytes(), carrier_edges);
    let from_ns = edges[0].ns;
    let fate = receive_light(FILM, MESSAGE.as_bytes(), |start_s| {
        let [from, to] = [start_s, start_s + FILM.exposure_s].map(|at_s| from_ns as f64 + 1e9 * at_s);
        let first = edges.partition_point(|edge| edge.ns as f64 <= from) - 1;
        let mut lit_ns = [0.0; LEDS];
        for pair in edges[first..].windows(2).take_while(|pair| (pair[0].ns as f64) < to) {
            let shown_ns = to.min(pair[1].ns as f64) - from.max(pair[0].ns as f64);
            for (led, lit_ns) in lit_ns.iter_mut().enumerate() {
                *lit_ns += if pair[0].panel.led(led) { shown_ns } else { 0.0 };
            }
        }
        lit_ns.map(|lit_ns| (lit_ns / (to - from)) as f32)
    });
    assert!(fate.delivered.is_some() && fate.wrong == 0, "{fate:?}");
}
