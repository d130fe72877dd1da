//! Shift registers with output latches: the symbol clock is the latch, pulses on their output-enable line dim, and so does the LEDs'
//! current. `docs/hardware/road-kit.md` has the gate that drives that line.

use embassy_rp::{
    Peri,
    clocks::clk_sys_freq,
    gpio::{Level, Output},
    pac::{self, dma::vals::DataSize},
    peripherals::{PIN_20, PIN_21, PWM_SLICE0, PWM_SLICE2},
    pwm::{self, Pwm},
};
use link::panel::PanelFrame;
use tx_firmware::{
    calibration::Measured,
    dimming::Duty,
    drive::{self, Drive, PulseOutput},
    shift_register::{LitBy, chain_bytes},
};

use super::{Entry, Lines, Shift, Transfer, shift};
use crate::symbols::Symbols;

/// The PWM slice of the dimming.
const SLICE: usize = 2;

/// The bit value that lights an LED.
const LIT_BY: LitBy = if cfg!(feature = "lit-by-0") { LitBy::Zero } else { LitBy::One };

/// Eight registers of eight bits.
pub const TRANSFER: Transfer = Transfer {
    bytes: 8,
    size: DataSize::SIZE_BYTE,
    count: 8,
};

/// A panel and its complement, between which a carrier alternates.
pub const IMAGES: usize = 2;

/// The typical calibration, until this panel is measured.
pub use tx_firmware::calibration::{BENCH as TYPICAL, BENCH_FULL_DUTY_LX as FULL_DUTY_LX};

/// Owns the shifting and latching hardware while it exists.
pub struct Shifter {
    _latch: Pwm<'static>,
    _shift: Shift,
}

impl Lines {
    /// Takes over the lines. The symbol clock's output is the latch.
    pub fn connect(self, slice: Peri<'static, PWM_SLICE0>, clock: pwm::Config) -> Shifter {
        Shifter {
            _latch: Pwm::new_output_b(slice, self.latch, clock),
            _shift: shift(self.spi, self.clock, self.data),
        }
    }
}

/// The dimming hardware.
pub struct Dimmer(drive::Dimmer<Lit>);

impl Dimmer {
    /// Takes over the lines, and makes the LEDs dark.
    pub fn dark(
        slice: Peri<'static, PWM_SLICE2>,
        lit: Peri<'static, PIN_20>,
        full_current: Peri<'static, PIN_21>,
        measured: &Measured,
    ) -> Self {
        let mut config = pwm::Config::default();
        config.compare_a = 0;
        let lit = Lit {
            full_current: Output::new(full_current, Level::High),
            _pwm: Pwm::new_output_a(slice, lit, config),
        };
        Self(drive::Dimmer::new(lit, drive_of(measured)))
    }

    /// Uses the rule for this panel, from the next duty on.
    pub fn set_calibration(&mut self, measured: &Measured) {
        self.0.set_drive(drive_of(measured));
    }

    /// Lights On LEDs with this share of full luminance.
    pub fn set(&mut self, duty: Duty, _: &Symbols) {
        self.0.set(duty);
    }

    /// The bytes to shift for a panel.
    pub fn entry(&self, panel: PanelFrame) -> Entry {
        chain_bytes(panel, LIT_BY)
    }
}

/// The dimming lines. High lights the LEDs: an inverting gate drives output enable, and a pull-down keeps them dark while nothing
/// drives the pin. The current pin gives them the full current when high, and a pull-down holds it low.
struct Lit {
    full_current: Output<'static>,
    _pwm: Pwm<'static>,
}

impl PulseOutput for Lit {
    /// The period first: until the pulse follows, the light is dimmer.
    fn set_pulses(&mut self, lit: u16, period: u16) {
        let slice = pac::PWM.ch(SLICE);
        slice.top().write(|w| w.set_top(period.max(1) - 1));
        slice.cc().write(|w| w.set_a(lit));
    }

    fn set_full_current(&mut self, full: bool) {
        self.full_current.set_level(full.into());
    }

    fn wait_for_end(&mut self, period: u16) {
        cortex_m::asm::delay(period.into());
    }
}

/// The rule of the pulses for a panel on this board.
fn drive_of(measured: &Measured) -> Drive {
    Drive::new(measured, clk_sys_freq())
}

/// Makes the LEDs dark at once, in any state of the program.
pub fn force_dark() {
    const PIN: usize = 20;
    pac::IO_BANK0
        .gpio(PIN)
        .ctrl()
        .modify(|w| w.set_outover(pac::io::vals::Outover::LOW));
}
