//! Handles fatal errors: the LEDs go dark, and the program restarts.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_rp::pac;

use crate::leds;

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    leds::force_dark();
    #[cfg(feature = "defmt")]
    defmt::error!("panic: {}", defmt::Display2Format(_info));
    restart()
}

/// Handles a processor fault. Otherwise the LEDs would stay lit for 2 s, until the watchdog restarts the program.
#[exception]
#[allow(unsafe_code)]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    leds::force_dark();
    restart()
}

fn restart() -> ! {
    loop {
        pac::WATCHDOG.ctrl().modify(|w| w.set_trigger(true));
    }
}
