//! What the application runs on: a clock that goes by frames, a port on the computer's screen, and a camera that takes any exposure.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_semihosting::hprint;
use rx_pipeline::{
    hm01b0::{CameraError, Exposure},
    standalone::{Camera, Clock, Machine, Port},
};

use crate::pico::stack;

/// Ticks of the processor's own timer until it begins again.
const TICKS: u32 = 1 << 24;

/// The board.
pub struct Mps2 {
    /// When the last frame's last line was read out, µs since the start.
    pub now_us: u64,
}

impl Mps2 {
    /// The board, its timer running; once.
    pub fn start() -> Option<Self> {
        let mut timer = cortex_m::Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS - 1);
        timer.clear_current();
        timer.enable_counter();
        Some(Self { now_us: 0 })
    }

    /// Where the timer stands, which counts down.
    pub fn ticks(&self) -> u32 {
        SYST::get_current()
    }

    /// Ticks since it stood there.
    pub fn ticks_since(&self, began: u32) -> u32 {
        began.wrapping_sub(self.ticks()) % TICKS
    }
}

impl Camera for Mps2 {
    fn start(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }

    fn expose(&mut self, _: Exposure) -> Result<(), CameraError> {
        Ok(())
    }
}

/// The film's time: it stands still while a frame is worked on, so that nothing depends on how long that takes.
impl Clock for Mps2 {
    fn micros(&self) -> u64 {
        self.now_us
    }
}

impl Port for Mps2 {
    fn read(&mut self) -> Option<u8> {
        None
    }

    fn write(&mut self, bytes: &[u8]) {
        // The application writes text, whole.
        if let Ok(text) = core::str::from_utf8(bytes) {
            hprint!("{}", text);
        }
    }
}

impl Machine for Mps2 {
    const BOARD: &'static str = "receiver-mps2";
    const FIRMWARE: &'static str = env!("CARGO_PKG_VERSION");

    fn alive(&mut self) {}

    fn lamp(&mut self, _: bool) {}

    fn stack_bytes(&self) -> u32 {
        stack::deepest_bytes()
    }

    fn cut_short(&self) -> u32 {
        0
    }
}
