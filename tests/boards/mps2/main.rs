//! The receiver's core on an emulated Cortex-M7: it reads the same bits as on this computer, within the memory and the instructions that
//! `docs/embedded-receiver.md` states.
//!
//! QEMU emulates the board. The tests need `qemu-system-arm` and a compiler for the Cortex-M7; if one of them is missing and cannot be
//! installed, the tests are skipped.

mod board;
mod compare;
mod counts;
mod film;
#[path = "../../../rx-pipeline/boards/mps2-an500/src/film.rs"]
mod format;
mod measure;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use vocc_tests::trials::{self, Unready};
use vocc_tests::{firmware, programs, tests};

type Test = fn(&Path);

fn main() -> ExitCode {
    let tests = tests![
        compare::k_means_reads_as_on_this_computer,
        compare::maximum_likelihood_reads_as_on_this_computer,
        compare::the_largest_region_is_read,
        compare::a_lost_panel_is_reported,
        counts::the_detectors_take_what_is_on_file,
        measure::it_is_small,
    ];
    trials::run("the receiver's board", None, tests, provide)
}

/// Provides the emulator and the board's program, built as a user would.
fn provide() -> Result<PathBuf, Unready> {
    programs::provide("qemu-system-arm")?;
    let built = firmware::build("thumbv7em-none-eabihf", "rx-pipeline/boards/mps2-an500", &[])?;
    Ok(built.join("vocc-mps2"))
}
