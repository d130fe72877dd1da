//! Handles fatal errors: the LEDs go dark, and the program restarts.

use core::panic::PanicInfo;

use embassy_rp::pac;

use crate::leds;

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    leds::force_dark();
    #[cfg(feature = "defmt")]
    defmt::error!("panic: {}", defmt::Display2Format(_info));
    loop {
        pac::WATCHDOG.ctrl().modify(|w| w.set_trigger(true));
    }
}
