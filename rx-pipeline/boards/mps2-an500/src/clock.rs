//! The processor's own timer. It counts instructions, because each takes the same time in the emulator.

use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// Ticks until the timer wraps.
const TICKS: u32 = 1 << 24;

/// Starts the timer. Can be called once.
pub fn start() -> Option<()> {
    let mut timer = cortex_m::Peripherals::take()?.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICKS - 1);
    timer.clear_current();
    timer.enable_counter();
    Some(())
}

/// The timer's value; it counts down.
pub fn now() -> u32 {
    SYST::get_current()
}

/// Ticks since the timer had the value `began`.
pub fn since(began: u32) -> u32 {
    began.wrapping_sub(now()) % TICKS
}
