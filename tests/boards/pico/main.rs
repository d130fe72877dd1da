//! Tests the flashed image of the Raspberry Pi Pico in an emulator.
//!
//! The emulator is in `tests/boards/emulator` and needs Node; the image needs a compiler for the Pico. If one of them is missing and cannot
//! be installed, the tests are skipped.

mod bring_up;
mod carrier;
mod closed_loop;
mod desk_kit;
mod emulator;
mod image;
mod light;
mod lock;
mod measure;
mod panel;
mod power_cut;
mod program;
mod rate;
mod restart;
mod serial;
mod signing;
mod vocc;

use std::path::Path;
use std::process::ExitCode;

use vocc_tests::{terminal, tests, trials};

use crate::image::Programs;

type Test = fn(&Programs, &Path);

fn main() -> ExitCode {
    let tests = tests![
        serial::boots_and_says_how_it_is,
        serial::a_table_outlives_a_power_cut,
        serial::a_flash_that_held_something_else_is_taken_over_while_symbols_go_on,
        serial::a_power_cut_in_an_update_leaves_one_table_whole,
        rate::a_symbol_rate_changes_at_a_symbol_and_outlives_a_restart,
        rate::a_power_cut_in_a_change_leaves_one_rate,
        carrier::a_carrier_is_shown_in_quarters_of_cycles_and_outlives_a_restart,
        carrier::a_carrier_stays_whole_when_the_ring_runs_empty,
        carrier::a_message_of_a_new_board_is_received_by_a_camera,
        light::the_luminance_follows_the_light_up_and_down,
        light::a_failed_sensor_leads_to_a_safe_luminance,
        light::saturating_light_is_daylight,
        closed_loop::a_message_sent_to_the_board_is_received_by_a_camera,
        signing::a_message_is_signed_on_the_board_and_proven_by_the_public_key,
        signing::a_key_clears_a_full_store_while_symbols_go_on,
        lock::a_locked_board_wants_a_permit_while_symbols_go_on,
        program::names_the_program_that_was_flashed,
        program::symbols_go_on_while_the_program_is_hashed,
        restart::a_program_that_hangs_is_restarted,
        restart::it_is_dark_without_a_program,
        restart::a_panic_is_dark_and_restarts,
        restart::a_hard_fault_is_dark_and_restarts,
        restart::a_sensor_that_holds_the_bus_is_made_to_let_go,
        restart::a_sensor_that_misses_clocks_is_made_to_let_go,
        desk_kit::the_desk_kit_is_read_by_a_camera_on_the_desk,
        desk_kit::the_desk_kit_is_dark_when_it_cannot_go_on,
        bring_up::faults_of_the_wires_are_named,
        bring_up::a_test_ends_without_its_computer,
        measure::it_is_small,
        measure::the_latch_keeps_time_under_serial_load,
        measure::the_duty_follows_a_step_of_the_light,
    ];
    trials::run_in_folders("the Pico's image", tests, Programs::provide)
}
