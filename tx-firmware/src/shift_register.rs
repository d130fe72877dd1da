//! A statically driven panel: eight 8-bit shift registers with output latches (74HC595, TPIC6B595,
//! TLC5916 and the like), one LED an output.
//!
//! ## Wiring
//!
//! The registers form one chain, row 0 first:
//!
//! ```text
//! SPI MOSI ─▶ row 0 ─▶ row 1 ─▶ … ─▶ row 7        serial out of each into serial in of the next
//! SPI SCK  ─▶ shift clock of all eight
//! latch    ─▶ storage clock of all eight           a rising edge copies the shifted bits to the outputs
//! PWM      ─▶ output enable of all eight           a pull resistor keeps it disabled while the microcontroller starts
//! ```
//!
//! Output QA (Q0) of a register drives column 0, QH (Q7) column 7, as the camera sees the panel. SPI mode 0, most significant bit first.
//! The first bits travel furthest, so the byte of row 7 goes first, and in it column 7.
//!
//! The latch pulse is as short as the HAL can set and clear a pin; a 74HC595 at 3.3 V needs some 40 ns.
//!
//! Shifting does not disturb the outputs: the 64 LEDs change together, at the latch's edge. All are
//! driven all the time, and dimmed together through output enable, so an exposure sees every LED
//! for the same share of its time. The PWM period should be at most a twentieth of the shortest
//! exposure; see [`pwm_period_ns`](crate::calibration::Measured::pwm_period_ns).

use embedded_hal::{digital::OutputPin, pwm::SetDutyCycle, spi::SpiBus};
use link::panel::{PanelFrame, SIDE};
use thiserror::Error;

use crate::{
    dimming::{Duty, duty_cycle},
    matrix::LedMatrix,
};

/// The level of the output-enable line that lights the LEDs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputEnable {
    /// Low lights them, as on the 74HC595 and similar chips.
    ActiveLow,
    /// High lights them, through an inverting driver before the registers.
    ActiveHigh,
}

/// The bit value that lights an LED.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LitBy {
    /// 1, as with a TLC5916, a TPIC6B595, and a 74HC595 whose LEDs go to ground.
    #[default]
    One,
    /// 0, as with a 74HC595 whose LEDs come from the supply: a low output sinks their current.
    Zero,
}

/// The failed line to the LEDs, with the error of the HAL's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ShiftRegisterError<S, L, P> {
    /// Writing the 64 bits to the SPI bus failed.
    #[error("the SPI bus rejected the panel ({0:?}): the LEDs still show the one before; show the next")]
    Spi(S),
    /// Setting the latch line failed.
    #[error("the latch line did not move ({0:?}): the LEDs may show either panel; show the next")]
    Latch(L),
    /// Setting the duty of the output-enable line's PWM failed.
    #[error("the PWM rejected the duty ({0:?}): the LEDs keep their brightness; set the duty again")]
    Pwm(P),
}

/// The LED panel behind `spi`, its latch line and the PWM on its output-enable line. See the
/// [module](self) for the wiring.
///
/// ```
/// use embedded_hal_mock::eh1::{digital, pwm, spi};
/// use link::panel::PanelFrame;
/// use tx_firmware::dimming::Duty;
/// use tx_firmware::matrix::LedMatrix;
/// use tx_firmware::shift_register::{LitBy, OutputEnable, ShiftRegisterPanel};
/// # let mut bus = spi::Mock::new(&[
/// #     spi::Transaction::write_vec(vec![0; 8]), spi::Transaction::flush(),
/// #     spi::Transaction::write_vec(vec![0, 0, 0, 0, 0, 0, 0, 0x0f]), spi::Transaction::flush(),
/// # ]);
/// # let (low, high) = (digital::Transaction::set(digital::State::Low), digital::Transaction::set(digital::State::High));
/// # let mut latch = digital::Mock::new(&[low.clone(), high.clone(), low.clone(), high, low]);
/// # let mut enable = pwm::Mock::new(&[
/// #     pwm::Transaction::max_duty_cycle(255), pwm::Transaction::set_duty_cycle(255),
/// #     pwm::Transaction::max_duty_cycle(255), pwm::Transaction::set_duty_cycle(0),
/// # ]);
///
/// # let (spi, latch_pin, enable_pwm) = (bus.clone(), latch.clone(), enable.clone());
/// let mut panel = ShiftRegisterPanel::new(spi, latch_pin, enable_pwm, OutputEnable::ActiveLow, LitBy::One)?;
/// panel.show(PanelFrame::from_bits(0x0f))?; // the left half of the top row
/// panel.set_duty(Duty::MAX)?;
/// # bus.done(); latch.done(); enable.done();
/// # Ok::<(), tx_firmware::shift_register::ShiftRegisterError<_, _, _>>(())
/// ```
#[derive(Debug)]
pub struct ShiftRegisterPanel<S, L, P> {
    spi: S,
    latch: L,
    pwm: P,
    output_enable: OutputEnable,
    lit_by: LitBy,
}

impl<S: SpiBus, L: OutputPin, P: SetDutyCycle> ShiftRegisterPanel<S, L, P> {
    /// Initialises the lines and blanks the panel, because registers power up with arbitrary bits.
    ///
    /// # Errors
    /// The first line that fails; the panel may then be in any state.
    pub fn new(spi: S, latch: L, pwm: P, output_enable: OutputEnable, lit_by: LitBy) -> Result<Self, <Self as LedMatrix>::Error> {
        let mut panel = Self {
            spi,
            latch,
            pwm,
            output_enable,
            lit_by,
        };
        panel.set_duty(Duty::ZERO)?;
        panel.latch.set_low().map_err(ShiftRegisterError::Latch)?;
        panel.show(PanelFrame::default())?;
        Ok(panel)
    }

    /// Returns the lines in their current state.
    pub fn release(self) -> (S, L, P) {
        (self.spi, self.latch, self.pwm)
    }
}

impl<S: SpiBus, L: OutputPin, P: SetDutyCycle> LedMatrix for ShiftRegisterPanel<S, L, P> {
    type Error = ShiftRegisterError<S::Error, L::Error, P::Error>;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
        self.spi.write(&chain_bytes(panel, self.lit_by)).map_err(ShiftRegisterError::Spi)?;
        self.spi.flush().map_err(ShiftRegisterError::Spi)?;
        self.latch.set_high().map_err(ShiftRegisterError::Latch)?;
        self.latch.set_low().map_err(ShiftRegisterError::Latch)
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
        let max = self.pwm.max_duty_cycle();
        let lit = duty_cycle(duty, max);
        let high = match self.output_enable {
            OutputEnable::ActiveHigh => lit,
            OutputEnable::ActiveLow => max - lit,
        };
        self.pwm.set_duty_cycle(high).map_err(ShiftRegisterError::Pwm)
    }
}

/// The bytes in the order of shifting: row 7 first, column 7 the most significant bit.
///
/// ```
/// use link::panel::PanelFrame;
/// use tx_firmware::shift_register::{LitBy, chain_bytes};
/// let left_of_the_top_row = PanelFrame::from_bits(0x0f);
/// assert_eq!(chain_bytes(left_of_the_top_row, LitBy::One), [0, 0, 0, 0, 0, 0, 0, 0x0f]);
/// assert_eq!(chain_bytes(left_of_the_top_row, LitBy::Zero), [255, 255, 255, 255, 255, 255, 255, 0xf0]);
/// ```
pub fn chain_bytes(panel: PanelFrame, lit_by: LitBy) -> [u8; SIDE] {
    let ones = match lit_by {
        LitBy::One => panel.bits(),
        LitBy::Zero => !panel.bits(),
    };
    ones.to_be_bytes()
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use embedded_hal::spi::{self as hal_spi, ErrorKind};
    use embedded_hal_mock::eh1::{
        MockError,
        digital::{Mock as Pin, State, Transaction as PinEvent},
        pwm::{Mock as Pwm, Transaction as PwmEvent},
        spi::{Mock as Spi, Transaction as SpiEvent},
    };
    use properties::prelude::*;
    use std::{io, vec, vec::Vec};

    const PWM_MAX: u16 = 2500;

    fn shifted(bytes: [u8; 8]) -> [SpiEvent<u8>; 2] {
        [SpiEvent::write_vec(bytes.to_vec()), SpiEvent::flush()]
    }

    fn pulse() -> [PinEvent; 2] {
        [PinEvent::set(State::High), PinEvent::set(State::Low)]
    }

    fn dimmed(high: u16) -> [PwmEvent; 2] {
        [PwmEvent::max_duty_cycle(PWM_MAX), PwmEvent::set_duty_cycle(high)]
    }

    /// A bus that expects a blank panel and then `panels`.
    fn bus(panels: &[[u8; 8]]) -> Spi<u8> {
        let events: Vec<_> = core::iter::once(&[0; 8]).chain(panels).copied().flat_map(shifted).collect();
        Spi::new(&events)
    }

    /// A latch line that expects its initialisation and `panels` latch pulses.
    fn latch(panels: usize) -> Pin {
        let events: Vec<_> = core::iter::once(PinEvent::set(State::Low))
            .chain((0..panels).flat_map(|_| pulse()))
            .collect();
        Pin::new(&events)
    }

    /// A PWM that expects these numbers of steps with a high output, one after the other.
    fn pwm(highs: &[u16]) -> Pwm {
        let events: Vec<_> = highs.iter().copied().flat_map(dimmed).collect();
        Pwm::new(&events)
    }

    fn done((mut spi, mut latch, mut pwm): (Spi<u8>, Pin, Pwm)) {
        spi.done();
        latch.done();
        pwm.done();
    }

    #[test]
    fn it_starts_blank_and_dark() {
        for (output_enable, dark) in [(OutputEnable::ActiveLow, PWM_MAX), (OutputEnable::ActiveHigh, 0)] {
            let panel = ShiftRegisterPanel::new(bus(&[]), latch(1), pwm(&[dark]), output_enable, LitBy::One);
            done(panel.unwrap().release());
        }
    }

    #[test]
    fn outputs_that_light_with_a_0_are_blank_with_ones() {
        let shifts = [shifted([0xff; 8]), shifted([0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfe])];
        let bus = Spi::new(&shifts.concat());
        let mut panel = ShiftRegisterPanel::new(bus, latch(2), pwm(&[PWM_MAX]), OutputEnable::ActiveLow, LitBy::Zero).unwrap();
        panel.show(PanelFrame::from_bits(1)).unwrap();
        done(panel.release());
    }

    #[test]
    fn the_top_left_led_is_the_last_bit_shifted_and_the_bottom_right_the_first() {
        let bus = bus(&[[0, 0, 0, 0, 0, 0, 0, 1], [0x80, 0, 0, 0, 0, 0, 0, 0]]);
        let mut panel = ShiftRegisterPanel::new(bus, latch(3), pwm(&[0]), OutputEnable::ActiveHigh, LitBy::One).unwrap();
        panel.show(PanelFrame::from_bits(1)).unwrap();
        panel.show(PanelFrame::from_bits(1 << 63)).unwrap();
        done(panel.release());
    }

    #[test]
    fn the_duty_is_the_lit_share_whichever_level_lights() {
        for (output_enable, highs) in [
            (OutputEnable::ActiveLow, [2500, 2500, 1875, 0]),
            (OutputEnable::ActiveHigh, [0, 0, 625, 2500]),
        ] {
            let mut panel = ShiftRegisterPanel::new(bus(&[]), latch(1), pwm(&highs), output_enable, LitBy::One).unwrap();
            for duty in [Duty::ZERO, Duty::MAX / 4, Duty::MAX] {
                panel.set_duty(duty).unwrap();
            }
            done(panel.release());
        }
    }

    properties! {
        #[test]
        fn every_led_reaches_its_register_and_output(bits in any::<u64>()) {
            let panel = PanelFrame::from_bits(bits);
            // A register chain, simulated: each clock shifts every bit by one output.
            let mut outputs = [false; 64];
            for byte in chain_bytes(panel, LitBy::One) {
                for bit in (0..8).rev() {
                    outputs.rotate_right(1);
                    outputs[0] = byte >> bit & 1 == 1;
                }
            }
            for (index, output) in outputs.into_iter().enumerate() {
                prop_assert_eq!(output, panel.is_on(index / 8, index % 8));
            }
        }
    }

    #[test]
    fn a_failing_latch_is_reported() {
        let broken = || MockError::Io(io::ErrorKind::NotConnected);
        let low = || PinEvent::set(State::Low);
        for events in [
            vec![low().with_error(broken())],
            vec![low(), PinEvent::set(State::High).with_error(broken())],
            vec![low(), PinEvent::set(State::High), low().with_error(broken())],
        ] {
            let spi = if events.len() > 1 {
                Spi::new(&shifted([0; 8]))
            } else {
                Spi::new(&[])
            };
            let lines = (spi, Pin::new(&events), Pwm::new(&dimmed(0)));
            let (spi, latch, pwm) = lines.clone();
            let refused = ShiftRegisterPanel::new(spi, latch, pwm, OutputEnable::ActiveHigh, LitBy::One).unwrap_err();
            assert_eq!(refused, ShiftRegisterError::Latch(broken()));
            done(lines);
        }
    }

    #[test]
    fn a_failing_pwm_is_reported() {
        let broken = || MockError::Io(io::ErrorKind::NotConnected);
        let pwm = Pwm::new(&[
            PwmEvent::max_duty_cycle(PWM_MAX),
            PwmEvent::set_duty_cycle(0),
            PwmEvent::max_duty_cycle(PWM_MAX),
            PwmEvent::set_duty_cycle(PWM_MAX).with_error(broken()),
        ]);
        let mut panel = ShiftRegisterPanel::new(bus(&[]), latch(1), pwm, OutputEnable::ActiveHigh, LitBy::One).unwrap();
        assert_eq!(panel.set_duty(Duty::MAX), Err(ShiftRegisterError::Pwm(broken())));
        done(panel.release());
    }

    /// A bus that accepts some writes and flushes and then fails, which the mock's own cannot.
    struct FailingSpi {
        good_calls: u32,
    }

    impl FailingSpi {
        fn call(&mut self) -> Result<(), ErrorKind> {
            self.good_calls = self.good_calls.checked_sub(1).ok_or(ErrorKind::ModeFault)?;
            Ok(())
        }
    }

    impl hal_spi::ErrorType for FailingSpi {
        type Error = ErrorKind;
    }

    impl SpiBus for FailingSpi {
        fn read(&mut self, _: &mut [u8]) -> Result<(), ErrorKind> {
            self.call()
        }

        fn write(&mut self, _: &[u8]) -> Result<(), ErrorKind> {
            self.call()
        }

        fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), ErrorKind> {
            self.call()
        }

        fn transfer_in_place(&mut self, _: &mut [u8]) -> Result<(), ErrorKind> {
            self.call()
        }

        fn flush(&mut self) -> Result<(), ErrorKind> {
            self.call()
        }
    }

    #[test]
    fn a_failing_bus_is_reported_and_nothing_is_latched() {
        for good_calls in [2, 3] {
            let (mut latch, mut pwm) = (latch(1), pwm(&[0]));
            let failing = FailingSpi { good_calls };
            let mut panel = ShiftRegisterPanel::new(failing, latch.clone(), pwm.clone(), OutputEnable::ActiveHigh, LitBy::One).unwrap();
            assert_eq!(
                panel.show(PanelFrame::from_bits(1)),
                Err(ShiftRegisterError::Spi(ErrorKind::ModeFault))
            );
            latch.done();
            pwm.done();
        }
    }
}
