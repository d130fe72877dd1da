//! The LEDs' drivers: what is shifted for a panel, and what dims it.

#[cfg(all(feature = "max7219", feature = "lit-by-0"))]
compile_error!("a MAX7219 lights LEDs with a 1: leave the feature lit-by-0 out");

#[cfg(feature = "max7219")]
mod max7219;
#[cfg(not(feature = "max7219"))]
mod shift_registers;

#[cfg(feature = "max7219")]
use self::max7219 as chosen;
#[cfg(not(feature = "max7219"))]
use self::shift_registers as chosen;

use embassy_rp::pac::dma::vals::DataSize;

pub use chosen::{Dimmer, Lines, Shifter, TRANSFER, TYPICAL, force_dark};

/// How the DMA controller moves a panel's bytes.
pub struct Transfer {
    /// The bytes of a panel, a power of two.
    pub bytes: usize,
    /// How many go at once.
    pub size: DataSize,
    /// How often.
    pub count: u32,
}

/// What is shifted for a panel.
pub type Entry = [u8; TRANSFER.bytes];
