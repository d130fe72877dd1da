//! Two Picos and nothing between them but light: the images that are flashed, run in emulators. The transmitter's pins drive LEDs, the
//! simulator draws what an HM01B0 sees of them, its pixels are clocked into the receiver's pins, and the text comes out of its UART.
//!
//! The emulator is in `tests/boards/emulator`, and takes Node; the images take a compiler for the Pico. Where one of them is absent and
//! cannot be had, these tests are skipped.

mod desk;
mod faults;
mod film;
mod image;
mod pair;
mod talk;
mod timing;

use std::path::Path;
use std::process::ExitCode;

use libtest_mimic::Arguments;
use vocc_tests::trials;

use crate::image::Programs;

type Test = fn(&Programs, &Path);

const TESTS: &[(&str, Test)] = &[
    (
        "text_goes_from_one_pico_to_the_other_by_light",
        talk::text_goes_from_one_pico_to_the_other_by_light,
    ),
    ("frames_are_done_in_time", timing::frames_are_done_in_time),
    ("a_computer_asks_the_receiver", desk::a_computer_asks_the_receiver),
    ("a_computer_asks_over_usb", desk::a_computer_asks_over_usb),
    (
        "code_words_that_can_hardly_be_decoded_are_done_in_time",
        timing::code_words_that_can_hardly_be_decoded_are_done_in_time,
    ),
    ("the_exposure_follows_the_light", faults::the_exposure_follows_the_light),
    ("a_moved_panel_is_found_again", faults::a_moved_panel_is_found_again),
    ("frames_with_a_lost_line_are_left_out", faults::frames_with_a_lost_line_are_left_out),
    (
        "a_camera_that_answers_wrongly_is_named",
        faults::a_camera_that_answers_wrongly_is_named,
    ),
    ("frames_that_stop_are_missed", faults::frames_that_stop_are_missed),
    (
        "a_receiver_whose_power_was_cut_reads_on",
        faults::a_receiver_whose_power_was_cut_reads_on,
    ),
    (
        "a_transmitter_whose_power_was_cut_is_read_on",
        faults::a_transmitter_whose_power_was_cut_is_read_on,
    ),
    ("a_receiver_that_hangs_is_restarted", faults::a_receiver_that_hangs_is_restarted),
    ("a_panic_is_told_at_the_next_start", faults::a_panic_is_told_at_the_next_start),
    (
        "a_hard_fault_is_told_at_the_next_start",
        faults::a_hard_fault_is_told_at_the_next_start,
    ),
    (
        "a_stack_that_overflows_ends_in_a_restart",
        faults::a_stack_that_overflows_ends_in_a_restart,
    ),
    (
        "a_camera_whose_power_was_cut_is_set_up_anew",
        faults::a_camera_whose_power_was_cut_is_set_up_anew,
    ),
    (
        "a_camera_that_holds_the_bus_is_made_to_let_go",
        faults::a_camera_that_holds_the_bus_is_made_to_let_go,
    ),
    (
        "a_flood_on_the_port_keeps_no_text_away",
        faults::a_flood_on_the_port_keeps_no_text_away,
    ),
];

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let tests = TESTS.iter().copied();
    let in_a_folder = tests.map(|(name, test)| {
        let run = move |programs: &Programs| {
            let folder = tempfile::tempdir().expect("a folder");
            test(programs, folder.path());
        };
        (name, run)
    });
    trials::run(&arguments, "two Picos' images", in_a_folder, Programs::provide)
}
