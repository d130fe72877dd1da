//! A module with a MAX7219. Its LOAD is the chip select of the SPI controller, which rises after each 16 bits by itself.
//!
//! Each symbol writes all registers of the chip. A module that was plugged in late, or lost its registers to a spike, therefore shows the
//! panel with the next symbol. The intensity is stored with the rows: a new one is written into all waiting panels.

use embassy_rp::{
    Peri,
    gpio::{Level, Output},
    pac::{self, dma::vals::DataSize},
    peripherals::PWM_SLICE0,
    pwm::{self, Pwm},
};
use fixed::types::{U1F31, U12F20, U32F32};
use link::{l2a_table::Interval, panel::PanelFrame};
use tx_firmware::{
    calibration::Measured,
    dimming::Duty,
    max7219::{controls, intensity, rows},
};

use super::{Entry, Lines, Shift, Transfer, shift};
use crate::symbols::{self, Symbols};

const LOAD: usize = 17;
/// The function number that connects a pin to the SPI controller.
const SPI_FUNCTION: u8 = 1;

/// Thirteen registers of sixteen bits, and three times "no operation", which is 0.
pub const TRANSFER: Transfer = Transfer {
    bytes: 32,
    size: DataSize::SIZE_HALFWORD,
    count: 16,
};

/// One image, because the module shows no carrier.
pub const IMAGES: usize = 1;

/// A module of 3 mm LEDs, until this module is measured: `docs/hardware/desk-kit.md`. The shortest pulse and the period are the first of
/// the chip's steps.
pub const TYPICAL: Measured = Measured {
    luminance_full_cd_m2: U32F32::lit("600"),
    shortest_pulse_ns: 40_323,
    pwm_period_ns: 1_250_000,
    reflectance: U1F31::lit("0.3"),
    interval: Interval::lit("0.5"),
    sensor_gain: U12F20::lit("1"),
    low_current_share: U1F31::lit("1"),
};

/// Four times the duty of the typical module.
pub const FULL_DUTY_LX: u32 = 125;

/// Owns the shifting hardware while it exists.
pub struct Shifter {
    _clock: Pwm<'static>,
    _shift: Shift,
    _load: Output<'static>,
}

impl Lines {
    /// Takes over the lines and makes the chip dark, because it may still show its last panel. The symbol clock has no output.
    pub fn connect(self, slice: Peri<'static, PWM_SLICE0>, clock: pwm::Config) -> Shifter {
        let load = Output::new(self.latch, Level::High);
        let shift = shift(self.spi, self.clock, self.data);
        pac::SPI0.cr1().modify(|w| w.set_sse(false));
        pac::SPI0.cr0().modify(|w| w.set_dss(15));
        pac::SPI0.cr1().modify(|w| w.set_sse(true));
        pac::IO_BANK0.gpio(LOAD).ctrl().modify(|w| w.set_funcsel(SPI_FUNCTION));
        shift_dark();
        Shifter {
            _clock: Pwm::new_free(slice, clock),
            _shift: shift,
            _load: load,
        }
    }
}

/// Dims the LEDs with the chip's own steps.
#[derive(Default)]
pub struct Dimmer {
    /// The intensity; none in shutdown.
    step: Option<u8>,
}

impl Dimmer {
    /// The chip's steps are fixed, so a measurement has no effect.
    pub fn set_calibration(&mut self, _: &Measured) {}

    /// Lights On LEDs with this share of full luminance, from the next symbol on.
    pub fn set(&mut self, duty: Duty, symbols: &Symbols) {
        let step = intensity(duty);
        if step != self.step {
            self.step = step;
            symbols.amend(|entry| put(entry, &controls(step)));
        }
    }

    /// The bytes to shift for a panel.
    pub fn entry(&self, panel: PanelFrame) -> Entry {
        let mut entry = Entry::default();
        let controls = controls(self.step);
        put(&mut entry, &controls);
        put(&mut entry[2 * controls.len()..], &rows(panel));
        entry
    }
}

/// Stores registers and values as the DMA controller reads them: the register is the upper byte of a word, whose lower byte comes first in
/// memory.
fn put(entry: &mut [u8], registers: &[[u8; 2]]) {
    for (place, &[register, value]) in entry.chunks_exact_mut(2).zip(registers) {
        place.copy_from_slice(&[value, register]);
    }
}

/// Makes the LEDs dark at once, in any state of the program.
pub fn force_dark() {
    symbols::force_stop();
    shift_dark();
}

/// Shifts the chip's shutdown command after the present transfer.
fn shift_dark() {
    let spi = pac::SPI0;
    for [register, value] in controls(None) {
        while !spi.sr().read().tnf() {}
        spi.dr().write(|w| w.set_data(u16::from_be_bytes([register, value])));
    }
    while spi.sr().read().bsy() {}
}
