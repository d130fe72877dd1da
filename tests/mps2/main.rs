//! The receiver's core on an emulated Cortex-M7: the same bits and messages as on this computer, in the memory and the instructions that
//! `docs/embedded-receiver.md` states.
//!
//! QEMU emulates the board; it takes `qemu-system-arm`, and a compiler for the Cortex-M7. Where one of them is missing and cannot be had,
//! these tests are shown as ignored, with the reason.

mod board;
mod compare;
mod counts;
mod film;
mod measure;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use libtest_mimic::{Arguments, Trial};
use vocc_tests::{firmware, programs};

type Test = fn(&Path);

const TESTS: &[(&str, Test)] = &[
    (
        "k_means_reads_as_on_this_computer",
        compare::k_means_reads_as_on_this_computer,
    ),
    (
        "maximum_likelihood_reads_as_on_this_computer",
        compare::maximum_likelihood_reads_as_on_this_computer,
    ),
    (
        "the_largest_region_is_read",
        compare::the_largest_region_is_read,
    ),
    (
        "a_lost_panel_is_reported",
        compare::a_lost_panel_is_reported,
    ),
    (
        "the_detectors_take_what_is_on_file",
        counts::the_detectors_take_what_is_on_file,
    ),
    ("it_is_small", measure::it_is_small),
];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let image = if arguments.list {
        Err("only listed".into())
    } else {
        provide()
    };
    if let (Err(missing), false) = (&image, arguments.list) {
        let _ = writeln!(
            std::io::stderr(),
            "The tests of the receiver's board DID NOT RUN: {missing}"
        );
    }
    let trials = TESTS.iter().map(|&(name, test)| match image.clone() {
        Ok(image) => Trial::test(name, move || {
            test(&image);
            Ok(())
        }),
        Err(missing) => {
            Trial::test(name, || Err(missing.into())).with_ignored_flag(!arguments.list)
        }
    });
    libtest_mimic::run(&arguments, trials.collect()).exit_code()
}

/// The board's program, built as a user would, and the emulator.
fn provide() -> Result<PathBuf, String> {
    programs::output(
        Command::new("bash")
            .arg("tests/provide")
            .arg("qemu-system-arm"),
    )?;
    let built = firmware::build("thumbv7em-none-eabihf", "rx-pipeline/boards/mps2-an500")?;
    Ok(built.join("vocc-mps2"))
}
