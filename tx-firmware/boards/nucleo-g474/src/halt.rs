//! What happens when the program cannot go on: the LEDs go dark, and it starts anew.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::leds;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    end()
}

/// A fault of the processor. Otherwise the LEDs would shine until the watchdog restarts the program, for 2 s.
#[exception]
#[allow(unsafe_code)]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    end()
}

fn end() -> ! {
    leds::force_dark();
    SCB::sys_reset();
}
