//! What happens when the program cannot go on: the LEDs go dark, and it starts anew.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;

use crate::leds;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    leds::force_dark();
    SCB::sys_reset();
}
