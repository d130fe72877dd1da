//! The LED drivers: the bytes to shift for a panel, and the dimming.

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

use embassy_rp::{
    Peri,
    pac::dma::vals::DataSize,
    peripherals::{PIN_17, PIN_18, PIN_19, SPI0},
    spi::{self, Blocking, Spi},
};

pub use chosen::{Dimmer, FULL_DUTY_LX, IMAGES, Shifter, TRANSFER, TYPICAL, force_dark};

/// Flying leads can carry this, and a MAX7219 accepts 10 MHz; eight registers take 16 µs.
const SHIFT_CLOCK_HZ: u32 = 4_000_000;

/// The drivers' lines.
pub struct Lines {
    /// The shift registers' latch, or a MAX7219's LOAD, also named CS.
    pub latch: Peri<'static, PIN_17>,
    pub spi: Peri<'static, SPI0>,
    pub clock: Peri<'static, PIN_18>,
    pub data: Peri<'static, PIN_19>,
}

/// The controller that shifts the bytes.
type Shift = Spi<'static, SPI0, Blocking>;

fn shift(spi: Peri<'static, SPI0>, clock: Peri<'static, PIN_18>, data: Peri<'static, PIN_19>) -> Shift {
    let mut bus = spi::Config::default();
    bus.frequency = SHIFT_CLOCK_HZ;
    Spi::new_blocking_txonly(spi, clock, data, bus)
}

/// The DMA controller's transfer of a panel's bytes.
pub struct Transfer {
    /// The bytes of a panel, a power of two.
    pub bytes: usize,
    /// The unit of the transfer.
    pub size: DataSize,
    /// The number of units.
    pub count: u32,
}

/// The bytes to shift for a panel.
pub type Entry = [u8; TRANSFER.bytes];
