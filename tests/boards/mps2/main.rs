//! The receiver's core on an emulated Cortex-M7, and its verdicts on signed messages on an emulated Cortex-M33: both are the same as on
//! this computer, within the memory and the instructions that `docs/embedded-receiver.md` and `docs/threats.md` state.
//!
//! QEMU emulates the boards. The tests need `qemu-system-arm` and a compiler for the processors; if one of them is missing and cannot be
//! installed, the tests are skipped.

mod board;
#[path = "../../../rx-pipeline/boards/mps2-an505/src/cases.rs"]
mod cases;
mod compare;
mod counts;
mod film;
#[path = "../../../rx-pipeline/boards/mps2-an500/src/film.rs"]
mod format;
mod measure;
mod verdicts;

use std::path::PathBuf;
use std::process::ExitCode;

use vocc_tests::trials::{self, Unready};
use vocc_tests::{firmware, programs, tests};

type Test = fn(&Images);

/// The boards' programs.
pub struct Images {
    /// Reads regions, on the Cortex-M7.
    receiver: PathBuf,
    /// Verifies signatures, on the Cortex-M33.
    verdicts: PathBuf,
}

fn main() -> ExitCode {
    let tests = tests![
        compare::k_means_reads_as_on_this_computer,
        compare::maximum_likelihood_reads_as_on_this_computer,
        compare::the_largest_region_is_read,
        compare::a_lost_panel_is_reported,
        counts::the_detectors_take_what_is_on_file,
        measure::it_is_small,
        verdicts::verdicts_are_those_of_this_computer,
    ];
    trials::run("the receiver's boards", None, tests, provide)
}

/// Provides the emulator and the boards' programs, built as a user would.
fn provide() -> Result<Images, Unready> {
    programs::provide("qemu-system-arm")?;
    let receiver = firmware::build("thumbv7em-none-eabihf", "rx-pipeline/boards/mps2-an500", &[])?;
    let verdicts = firmware::build("thumbv8m.main-none-eabihf", "rx-pipeline/boards/mps2-an505", &[])?;
    Ok(Images {
        receiver: receiver.join("vocc-mps2"),
        verdicts: verdicts.join("vocc-mps2-an505"),
    })
}
