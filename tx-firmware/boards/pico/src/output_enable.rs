//! The dimming: pulses on the output-enable line of all registers, and the LEDs' current.

use embassy_rp::{
    Peri,
    gpio::{Level, Output},
    pac,
    peripherals::{PIN_20, PIN_21, PWM_SLICE2},
    pwm::{self, Pwm},
};
use tx_firmware::{
    dimming::Duty,
    drive::{Drive, Pulses},
};

const SLICE: usize = 2;

/// What dims the LEDs. Output enable lights them when low, and a pull-up holds it high while nothing drives it. The current pin
/// gives them the full current when high, and a pull-down holds it low.
pub struct OutputEnable {
    drive: Drive,
    shown: Pulses,
    full_current: Output<'static>,
    _pwm: Pwm<'static>,
}

impl OutputEnable {
    /// Takes the lines over: dark.
    pub fn dark(
        slice: Peri<'static, PWM_SLICE2>,
        output_enable: Peri<'static, PIN_20>,
        full_current: Peri<'static, PIN_21>,
        drive: Drive,
    ) -> Self {
        let mut config = pwm::Config::default();
        config.invert_a = true;
        config.compare_a = 0;
        Self {
            drive,
            shown: Pulses::default(),
            full_current: Output::new(full_current, Level::High),
            _pwm: Pwm::new_output_a(slice, output_enable, config),
        }
    }

    /// Pulses by another rule, from the next duty on.
    pub fn set_drive(&mut self, drive: Drive) {
        self.drive = drive;
    }

    /// Lights On LEDs with this share of full luminance.
    pub fn set(&mut self, duty: Duty) {
        let pulses = self.drive.pulses(duty, self.shown);
        if pulses == self.shown {
            return;
        }
        // At no moment long pulses and full current: they change in the order that dims first.
        if pulses.low_current {
            self.full_current.set_low();
        }
        write(pulses);
        if self.shown.low_current && !pulses.low_current {
            // The pulses take effect when the present period ends.
            cortex_m::asm::delay(self.shown.period.into());
            self.full_current.set_high();
        }
        self.shown = pulses;
    }
}

/// The period first: until the pulse follows, the light errs to the dim side.
fn write(pulses: Pulses) {
    let slice = pac::PWM.ch(SLICE);
    slice.top().write(|w| w.set_top(pulses.period.max(1) - 1));
    slice.cc().write(|w| w.set_a(pulses.lit));
}

/// Dark at once, whatever state the program is in.
pub fn force_dark() {
    const PIN: usize = 20;
    pac::IO_BANK0
        .gpio(PIN)
        .ctrl()
        .modify(|w| w.set_outover(pac::io::vals::Outover::HIGH));
}
