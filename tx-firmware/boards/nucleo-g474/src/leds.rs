//! Eight shift registers with one LED per output, dimmed by output enable and by the LEDs' current. `docs/hardware/road-kit.md` has the
//! circuit; its gate inverts, so high lights the LEDs.

use embassy_stm32::{
    Peri,
    gpio::{Level, Output, OutputType, Speed},
    pac,
    peripherals::{PA8, PB10, TIM1},
    rcc,
    time::Hertz,
    timer::{
        low_level::CountingMode,
        simple_pwm::{PwmPin, SimplePwm},
    },
};
use link::panel::PanelFrame;
use tx_firmware::{
    calibration::Measured,
    drive::{Dimmer, Drive, PulseOutput},
    shift_register::{LitBy, chain_bytes},
};

/// The typical calibration, until this panel is measured.
pub use tx_firmware::calibration::{BENCH as TYPICAL, BENCH_FULL_DUTY_LX as FULL_DUTY_LX};

/// The bit value that lights an LED.
const LIT_BY: LitBy = if cfg!(feature = "lit-by-0") { LitBy::Zero } else { LitBy::One };

/// Arbitrary, because the first duty replaces it.
const FIRST_FREQUENCY: Hertz = Hertz(20_000);

/// The timer's first channel, on output enable.
const LIT: usize = 0;
/// The pin of output enable, in port A.
const LIT_PIN: usize = 8;

/// The lines that dim the LEDs.
pub struct Lines {
    full_current: Output<'static>,
    _pwm: SimplePwm<'static, TIM1>,
}

/// Takes over the lines, and makes the LEDs dark.
pub fn dark(timer: Peri<'static, TIM1>, lit: Peri<'static, PA8>, full_current: Peri<'static, PB10>, measured: &Measured) -> Dimmer<Lines> {
    let pin = PwmPin::new(lit, OutputType::PushPull);
    // Its compare value is 0 until the first duty.
    let mut pwm = SimplePwm::new(timer, Some(pin), None, None, None, FIRST_FREQUENCY, CountingMode::EdgeAlignedUp);
    pwm.ch1().enable();
    let lines = Lines {
        full_current: Output::new(full_current, Level::High, Speed::Low),
        _pwm: pwm,
    };
    Dimmer::new(lines, drive(measured))
}

/// The rule of the pulses for a panel on this board.
pub fn drive(measured: &Measured) -> Drive {
    Drive::new(measured, rcc::frequency::<TIM1>().0)
}

/// The bytes to shift for a panel.
pub fn entry(panel: PanelFrame) -> [u8; 8] {
    chain_bytes(panel, LIT_BY)
}

impl PulseOutput for Lines {
    fn set_pulses(&mut self, lit: u16, period: u16) {
        // Both take effect at the same end of a period. A timer of one count would stop, and have no period.
        pac::TIM1.cr1().modify(|w| w.set_udis(true));
        pac::TIM1.arr().write(|w| w.set_arr(period.max(2) - 1));
        pac::TIM1.ccr(LIT).write(|w| w.set_ccr(lit));
        pac::TIM1.cr1().modify(|w| w.set_udis(false));
    }

    fn set_full_current(&mut self, full: bool) {
        self.full_current.set_level(full.into());
    }

    fn wait_for_end(&mut self, period: u16) {
        // The timer counts the processor's clock.
        cortex_m::asm::delay(period.into());
    }
}

/// Makes the LEDs dark at once, in any state of the program: the pin becomes a low output.
pub fn force_dark() {
    pac::GPIOA.bsrr().write(|w| w.set_br(LIT_PIN, true));
    pac::GPIOA.moder().modify(|w| w.set_moder(LIT_PIN, pac::gpio::vals::Moder::OUTPUT));
}
