//! The duty follows the light up and down, and sensor faults.

use std::path::Path;

use tx_firmware::ambient::SETTLED_OCTAVES;
use tx_firmware::drive::{FIDELITY_PPM, RIPPLE_MAX_PPM};

use crate::emulator::{Emulator, Fault};
use crate::image::Programs;
use crate::panel::{FULL_CD_M2, LOW_CURRENT_SHARE, REFLECTANCE, Record, l2a};
use crate::terminal::Terminal;
use crate::vocc::vocc;

/// Maximum relative error of the luminance: the rest of the smoothing after it has settled, half a count of an OPT3001's mantissa of at
/// least 2048 counts, and the step of the pulses.
fn error_max() -> f64 {
    let settled = SETTLED_OCTAVES.to_num::<f64>().exp2() - 1.0;
    settled + 0.5 / 2048.0 + f64::from(FIDELITY_PPM - RIPPLE_MAX_PPM) / 1e6
}

/// The night limit, 4·50 lx·R.
const NIGHT_LIMIT_CD_M2: f64 = 4.0 * 50.0 * REFLECTANCE;

/// L* = r·E·R, up to the panel's maximum.
fn wanted_cd_m2(lux: f64) -> f64 {
    (l2a(lux) * lux * REFLECTANCE).min(FULL_CD_M2)
}

/// (c) After the light has changed and settled, the LEDs have the luminance L* = r·E·R, measured at the output-enable line. The calibration
/// has the share of the low current, which dim light needs.
pub fn the_luminance_follows_the_light_up_and_down(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &["--edges"]);
    let mut record = Record::default();
    board.light(50.0, Fault::None);
    record.extend(&board.real_time(true));
    let terminal = Terminal::open(board.socket());
    let calibration = format!(
        "luminance_full_cd_m2 = {FULL_CD_M2:?}\nshortest_pulse_ns = 100\npwm_period_ns = 49000\nreflectance = {REFLECTANCE}\n\
         interval = 1.0\nsensor_gain = 1.0\nlow_current_share = {LOW_CURRENT_SHARE}\n"
    );
    std::fs::write(folder.join("switched.toml"), calibration).expect("the folder can be written");
    vocc(programs, folder, &["device", "calibration", "switched.toml"], terminal.name()).json();
    record.extend(&board.real_time(false));
    let up = [50.0, 120.0, 700.0, 2_500.0, 9_000.0, 16_000.0];
    let down = up.iter().rev().skip(1);
    for &lux in up.iter().chain(down) {
        board.light(lux, Fault::None);
        record.extend(&board.run_ms(12_000));
        let events = board.run_ms(100);
        record.extend(&events);
        let lit_s = events.last().map_or(0.0, |event| event.lit_nanos) / 1e9;
        let current = record.last_pulses().duty() / (record.last_pulses().lit_s / record.last_pulses().period_s);
        let shown_cd_m2 = FULL_CD_M2 * current * lit_s / 0.1;
        let error = shown_cd_m2 / wanted_cd_m2(lux) - 1.0;
        assert!(
            error.abs() <= error_max(),
            "{shown_cd_m2} cd/m2 at {lux} lx: {:+.2} %",
            100.0 * error
        );
        assert!(record.last_pulses().lit_s >= 100e-9, "{:?}", record.last_pulses());
    }
}

/// (c) Whatever the sensor does, the luminance is soon safe: the night limit applies, unless it is known to be day.
pub fn a_failed_sensor_leads_to_a_safe_luminance(programs: &Programs, folder: &Path) {
    for (fault, found_out_ms) in [
        (Fault::Missing, 2_500),
        (Fault::Silent, 3_000),
        (Fault::Hanging, 2_500),
        (Fault::Stuck, 5_500),
    ] {
        let folder = folder.join(format!("{fault:?}"));
        std::fs::create_dir(&folder).expect("the folder can be written");
        let mut board = Emulator::power_up(programs, &folder, &[]);
        let mut record = Record::default();
        board.light(9_000.0, Fault::None);
        record.extend(&board.run_ms(1_000));
        assert!(record.last_pulses().luminance_cd_m2() > 0.95 * wanted_cd_m2(9_000.0), "{fault:?}");
        board.light(9_000.0, fault);
        record.extend(&board.run_ms(found_out_ms));
        let safe = record.last_pulses().luminance_cd_m2();
        assert!(safe > 0.0 && safe <= NIGHT_LIMIT_CD_M2 * 1.001, "{fault:?}: {safe} cd/m2");
        // The board continues: it shows symbols, was not reset, and uses the sensor again.
        board.light(9_000.0, Fault::None);
        let events = board.run_ms(20_000);
        record.extend(&events);
        assert!(events.iter().all(|event| event.reset.is_none()), "{fault:?}");
        let error = record.last_pulses().luminance_cd_m2() / wanted_cd_m2(9_000.0) - 1.0;
        assert!(error.abs() <= error_max(), "{fault:?}: {:+.2} %", 100.0 * error);
    }
}

/// More light than the sensor can measure, confirmed in another range, counts as daylight: the panel keeps its maximum.
pub fn saturating_light_is_daylight(programs: &Programs, folder: &Path) {
    let mut board = Emulator::power_up(programs, folder, &[]);
    let mut record = Record::default();
    board.light(100_000.0, Fault::None);
    record.extend(&board.run_ms(8_000));
    assert_eq!(record.last_pulses().luminance_cd_m2(), FULL_CD_M2);
    // A register that hangs there does not follow the ranges.
    board.light(100_000.0, Fault::Stuck);
    record.extend(&board.run_ms(3_000));
    let safe = record.last_pulses().luminance_cd_m2();
    assert!(safe > 0.0 && safe <= NIGHT_LIMIT_CD_M2 * 1.001, "{safe} cd/m2");
}
