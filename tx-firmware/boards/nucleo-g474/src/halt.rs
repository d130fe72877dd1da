//! Handles fatal errors: the LEDs go dark, and the program restarts.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::leds;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    end()
}

/// Handles a processor fault. Otherwise the LEDs would stay lit for 2 s, until the watchdog restarts the program.
#[exception]
#[allow(unsafe_code)]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    end()
}

fn end() -> ! {
    leds::force_dark();
    SCB::sys_reset();
}
