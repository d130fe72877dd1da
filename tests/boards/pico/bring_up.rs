//! `vocc device test` with the emulated board: the behaviour of the LEDs names each fault that is planted in the wires.

use std::path::Path;

use link::serial::Request;
use reception::bring_up::{Finding, StepLevels, align, diagnose};
use serde_json::{Value, json};
use vocc_tests::emulator::request;

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::Record;
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// Smallest difference of light that counts, as a share of full luminance.
const VISIBLE: f32 = 1e-4;
const LUX: f64 = 1000.0;

/// The light of each LED in each symbol, as a share of full luminance.
fn levels(record: &Record) -> Vec<Vec<f32>> {
    let levels = record.symbols.iter().map(|symbol| {
        let light = record.pulses_at(symbol.ns).duty() as f32;
        symbol.panel.shares().map(|on| on * light).to_vec()
    });
    levels.collect()
}

/// Tests a board with these options of the emulator; returns the output of `vocc` and the findings from the LEDs' light.
fn tested(programs: &Programs, folder: &Path, options: &[&str]) -> (Value, Vec<Finding>) {
    std::fs::create_dir_all(folder).expect("the folder can be made");
    let mut board = Emulator::power_up_still(programs, folder, options);
    board.light(LUX, Fault::None);
    let mut record = Record::default();
    record.extend(&board.run_ms(500));
    record.extend(&board.real_time(true));
    let terminal = Terminal::open(board.socket());
    let test = ["device", "test", "--camera", "--step", "0.3"];
    let told = vocc(programs, folder, &test, terminal.name()).json();
    record.extend(&board.real_time(false));
    record.extend(&board.run_ms(1_000));
    let aligned = align(&levels(&record)).expect("the test panels were shown");
    let reading = StepLevels::of_levels(&aligned, VISIBLE).expect("64 LEDs");
    assert!(reading.ramp.is_some(), "the record ends before the ramp");
    (told, diagnose(&reading))
}

/// A healthy board has no finding. Two swapped wires, a dead row, a late latch and an inverted output enable are named, alone and two at a
/// time.
pub fn faults_of_the_wires_are_named(programs: &Programs, folder: &Path) {
    let swapped = Finding::LedsSwapped([18, 45]);
    let cases: [(&[&str], &[Finding]); 6] = [
        (&[], &[]),
        (&["--fault", "swap=18,45"], &[swapped]),
        (&["--fault", "dead-row=3"], &[Finding::RowDead(3)]),
        (&["--fault", "late=1"], &[Finding::ChainShifted(1)]),
        (&["--stage", "buffer"], &[Finding::EnableInverted]),
        (&["--fault", "swap=18,45", "--fault", "stuck=0"], &[Finding::LedStuck(0), swapped]),
    ];
    for (number, (options, meant)) in cases.into_iter().enumerate() {
        let (told, findings) = tested(programs, &folder.join(number.to_string()), options);
        assert_eq!(findings, meant, "{options:?}");
        // The sensor and the store are healthy in all cases.
        for key in ["sensor_fault", "store_fault"] {
            assert_eq!(told[key], json!(null), "{told}");
        }
        for key in ["sensor_lx", "sensor_other_range_lx"] {
            let lux = told[key].as_f64().expect("a number");
            assert!((lux / LUX - 1.0).abs() < 0.01, "{told}");
        }
        assert_eq!(told["shown"].as_array().map(Vec::len), Some(18), "{told}");
    }
}

/// If the computer disappears in the middle of a test, nothing stays on: beacons continue at their duty.
pub fn a_test_ends_without_its_computer(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up_still(programs, folder, &[]);
    board.light(LUX, Fault::None);
    let mut record = Record::default();
    record.extend(&board.run_ms(2_500));
    let before = record.last_pulses();
    let test = Request::TestPanel {
        bits: 0xff,
        share: 51,
        time_ms: 400,
    };
    drop(request(board.socket(), 1, &test));
    record.extend(&board.run_ms(300));
    let last = *record.symbols.last().expect("symbols are shown");
    assert_eq!(last.panel.bits(), 0xff);
    let share = record.last_pulses().duty() / before.duty();
    assert!((share - 0.2).abs() < 0.01, "{share}");
    let tested = record.symbols.len();
    record.extend(&board.run_ms(600));
    let after = &record.symbols[tested..];
    let shown = after.iter().filter(|symbol| symbol.panel.bits() == 0xff).count();
    assert!((1..30).contains(&shown) && after.len() > 45, "{shown} of {}", after.len());
    let share = record.last_pulses().duty() / before.duty();
    assert!((share - 1.0).abs() < 0.01, "{share}");
}
