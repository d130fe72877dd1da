//! The Pico 2's receiver on an emulated Cortex-M33: a film of the simulated HM01B0 is read as on this computer, in the instructions and the
//! stack that `docs/hardware.md` states.
//!
//! QEMU emulates the board; it takes `qemu-system-arm`, and a compiler for the Cortex-M33. Where one of them is absent and cannot be had,
//! these tests are skipped.

mod board;
mod film;
mod here;
mod measure;

use std::path::PathBuf;
use std::process::ExitCode;

use libtest_mimic::Arguments;
use vocc_tests::trials::{self, Unready};
use vocc_tests::{firmware, programs};

/// What the tests run, and hold it against.
pub struct Images {
    /// The emulated board's program.
    board: PathBuf,
    /// The Pico 2's.
    pico: PathBuf,
}

type Test = fn(&Images);

const TESTS: &[(&str, Test)] = &[
    (
        "a_panel_at_rest_is_read_as_on_this_computer",
        measure::a_panel_at_rest_is_read_as_on_this_computer,
    ),
    (
        "a_large_panel_is_read_as_on_this_computer",
        measure::a_large_panel_is_read_as_on_this_computer,
    ),
    (
        "a_moving_panel_is_read_as_on_this_computer",
        measure::a_moving_panel_is_read_as_on_this_computer,
    ),
    (
        "a_long_text_is_read_as_on_this_computer",
        measure::a_long_text_is_read_as_on_this_computer,
    ),
    (
        "a_far_panel_is_read_within_four_seconds",
        measure::a_far_panel_is_read_within_four_seconds,
    ),
];

const M33: &str = "thumbv8m.main-none-eabihf";
const PICO_2: [&str; 3] = ["--no-default-features", "--features", "rp2350"];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let tests = TESTS.iter().copied();
    trials::run(&arguments, "the Pico 2's reader", tests, provide)
}

fn provide() -> Result<Images, Unready> {
    programs::provide("qemu-system-arm")?;
    let board = firmware::build(M33, "rx-pipeline/boards/mps2-an505", &[])?;
    let pico = firmware::build(M33, "rx-pipeline/boards/pico", &PICO_2)?;
    Ok(Images {
        board: board.join("vocc-mps2-an505"),
        pico: pico.join("vocc-receiver-pico"),
    })
}
