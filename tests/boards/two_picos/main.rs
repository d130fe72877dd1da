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
mod talk;
mod timing;

use std::path::Path;
use std::process::ExitCode;

use vocc_tests::{tests, trials};

use crate::image::Programs;

type Test = fn(&Programs, &Path);

fn main() -> ExitCode {
    let tests = tests![
        talk::text_goes_from_one_pico_to_the_other_by_light,
        timing::frames_are_done_in_time,
        desk::a_computer_asks_the_receiver,
        desk::a_computer_asks_over_usb,
        timing::code_words_that_can_hardly_be_decoded_are_done_in_time,
        faults::the_exposure_follows_the_light,
        faults::a_moved_panel_is_found_again,
        faults::frames_with_a_lost_line_are_left_out,
        faults::a_camera_that_answers_wrongly_is_named,
        faults::frames_that_stop_are_missed,
        faults::a_receiver_whose_power_was_cut_reads_on,
        faults::a_transmitter_whose_power_was_cut_is_read_on,
        faults::a_receiver_that_hangs_is_restarted,
        faults::a_panic_is_told_at_the_next_start,
        faults::a_hard_fault_is_told_at_the_next_start,
        faults::a_stack_that_overflows_ends_in_a_restart,
        faults::a_camera_whose_power_was_cut_is_set_up_anew,
        faults::a_camera_that_holds_the_bus_is_made_to_let_go,
        faults::a_flood_on_the_port_keeps_no_text_away,
    ];
    trials::run_in_folders("two Picos' images", tests, Programs::provide)
}
