//! The end of a program in the emulator.

use core::panic::PanicInfo;

use cortex_m_semihosting::debug;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    end(None)
}

/// Ends the emulator: with success if there is an outcome.
pub fn end(outcome: Option<()>) -> ! {
    let status = match outcome {
        Some(()) => debug::EXIT_SUCCESS,
        None => debug::EXIT_FAILURE,
    };
    loop {
        debug::exit(status);
    }
}
