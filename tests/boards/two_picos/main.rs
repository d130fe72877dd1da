//! Two Picos that are connected by light alone: the flashed images run in emulators. The transmitter's pins drive LEDs, the simulator draws
//! the view of an HM01B0, the pixels are clocked into the receiver's pins, and the text leaves its UART.
//!
//! The emulator is in `tests/boards/emulator` and needs Node; the images need a compiler for the Pico. If one of them is missing and cannot
//! be installed, the tests are skipped.

mod desk;
mod faults;
mod film;
mod image;
mod pair;
mod signed;
mod talk;
mod timing;

use std::path::Path;
use std::process::ExitCode;

use vocc_tests::{tests, trials};

use crate::image::Programs;

type Test = fn(&Programs, &Path);

fn main() -> ExitCode {
    let tests = tests![
        faults::a_receiver_reads_on_after_faults,
        faults::a_receiver_reads_on_after_its_ends,
        faults::a_flood_on_the_port_keeps_no_text_away,
        timing::frames_are_done_in_time,
        desk::a_computer_asks_the_receiver,
        talk::text_goes_from_one_pico_to_the_other_by_light,
    ];
    trials::run_in_folders("two Picos' images", tests, Programs::provide)
}
