//! Frees an I2C bus whose data line is held low by a chip that was being read when its controller was reset, or when a disturbance took a
//! clock from it.
//!
//! The chip waits for the clocks of the rest of its byte, and no transfer can begin before. NXP UM10204, 3.1.16: within nine clocks it
//! releases the line.
#![no_std]
#![deny(unsafe_code)]

use core::convert::Infallible;

use embedded_hal::{
    delay::DelayNs,
    digital::{InputPin, OutputPin},
};

/// A byte and its acknowledgement.
const CLOCKS: u32 = 9;
/// Half a clock period at 100 kHz.
const HALF_CLOCK_US: u32 = 5;

/// Frees the bus if its data line is low. The pins are open drain, with pull-ups, and no controller has them.
///
/// Each clock ends with the attempt of a STOP: the data line rises while the clock is high. The chip overrides it as long as it sends a 0
/// or acknowledges, and the first STOP that it does not override ends the transfer. A bus that is still held after nine clocks stays so,
/// and the chip's driver reports the chip as missing.
pub fn free<C, D>(clock: &mut C, data: &mut D, delay: &mut impl DelayNs)
where
    C: OutputPin<Error = Infallible>,
    D: OutputPin<Error = Infallible> + InputPin,
{
    let Ok(()) = clock.set_high();
    let Ok(()) = data.set_high();
    delay.delay_us(HALF_CLOCK_US);
    for _ in 0..CLOCKS {
        let Ok(is_free) = data.is_high();
        if is_free {
            return;
        }
        let Ok(()) = clock.set_low();
        let Ok(()) = data.set_low();
        delay.delay_us(HALF_CLOCK_US);
        let Ok(()) = clock.set_high();
        delay.delay_us(HALF_CLOCK_US);
        let Ok(()) = data.set_high();
        delay.delay_us(HALF_CLOCK_US);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::cell::RefCell;
    use std::vec::Vec;

    use embedded_hal::digital::{ErrorType, PinState};

    use super::*;

    /// A chip's part in a transfer.
    #[derive(Clone, Debug, PartialEq)]
    enum Chip {
        /// It has seen a STOP, or none was needed.
        Idle,
        /// It sends bits, the next ones first; then it listens for an acknowledgement, and sends the byte after it if there is one.
        Sends(Vec<bool>),
        /// It acknowledges a byte that it received.
        Acknowledges,
        /// It waits for this many bits of a byte.
        Receives(u32),
        /// It is broken.
        Shorted,
    }

    /// The lines of the bus, each low if either side pulls it down.
    struct Wires {
        clock: bool,
        data: bool,
        chip: Chip,
        clocks: u32,
        starts: u32,
        time_us: u32,
    }

    impl Wires {
        fn held_by(chip: Chip) -> RefCell<Self> {
            RefCell::new(Self {
                clock: true,
                data: true,
                chip,
                clocks: 0,
                starts: 0,
                time_us: 0,
            })
        }

        fn pulls_down(&self) -> bool {
            match &self.chip {
                Chip::Sends(bits) => bits.first() == Some(&false),
                Chip::Acknowledges | Chip::Shorted => true,
                Chip::Idle | Chip::Receives(_) => false,
            }
        }

        fn level(&self) -> bool {
            self.data && !self.pulls_down()
        }

        fn set_clock(&mut self, high: bool) {
            let acknowledged = !self.level();
            if self.clock && !high {
                self.clocks += 1;
                self.chip = match &self.chip {
                    Chip::Sends(bits) if bits.is_empty() && acknowledged => Chip::Sends(std::vec![false; 8]),
                    Chip::Sends(bits) if bits.is_empty() => Chip::Idle,
                    Chip::Sends(bits) => Chip::Sends(bits[1..].to_vec()),
                    Chip::Acknowledges => Chip::Receives(8),
                    Chip::Receives(1) => Chip::Acknowledges,
                    Chip::Receives(bits) => Chip::Receives(bits - 1),
                    other => other.clone(),
                };
            }
            self.clock = high;
        }

        fn set_data(&mut self, high: bool) {
            let before = self.level();
            self.data = high;
            let after = self.level();
            if self.clock && before != after {
                self.starts += u32::from(before);
                if after && self.chip != Chip::Shorted {
                    self.chip = Chip::Idle;
                }
            }
        }
    }

    struct Clock<'a>(&'a RefCell<Wires>);
    struct Data<'a>(&'a RefCell<Wires>);
    struct Delay<'a>(&'a RefCell<Wires>);

    impl ErrorType for Clock<'_> {
        type Error = Infallible;
    }
    impl ErrorType for Data<'_> {
        type Error = Infallible;
    }

    impl OutputPin for Clock<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.set_state(PinState::Low)
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.set_state(PinState::High)
        }
        fn set_state(&mut self, state: PinState) -> Result<(), Infallible> {
            self.0.borrow_mut().set_clock(state == PinState::High);
            Ok(())
        }
    }

    impl OutputPin for Data<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.set_state(PinState::Low)
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.set_state(PinState::High)
        }
        fn set_state(&mut self, state: PinState) -> Result<(), Infallible> {
            self.0.borrow_mut().set_data(state == PinState::High);
            Ok(())
        }
    }

    impl InputPin for Data<'_> {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0.borrow().level())
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0.borrow().level())
        }
    }

    impl DelayNs for Delay<'_> {
        fn delay_ns(&mut self, ns: u32) {
            self.0.borrow_mut().time_us += ns / 1_000;
        }
    }

    fn freed(chip: Chip) -> Wires {
        let wires = Wires::held_by(chip);
        free(&mut Clock(&wires), &mut Data(&wires), &mut Delay(&wires));
        wires.into_inner()
    }

    #[test]
    fn a_chip_that_sends_any_byte_is_stopped_at_any_bit() {
        for byte in 0..=u8::MAX {
            for left in 1..=8 {
                let bits: Vec<bool> = (0..left).rev().map(|bit| byte >> bit & 1 == 1).collect();
                let held = !bits[0];
                let wires = freed(Chip::Sends(bits));
                assert!(wires.clock && wires.data && wires.level());
                if held {
                    assert_eq!(wires.chip, Chip::Idle, "{left} bits of {byte:#x}");
                    assert!((1..=9).contains(&wires.clocks), "{} clocks", wires.clocks);
                }
            }
        }
    }

    #[test]
    fn a_chip_that_acknowledges_takes_no_further_byte() {
        let wires = freed(Chip::Acknowledges);
        assert_eq!((wires.chip.clone(), wires.clocks), (Chip::Idle, 1));
        assert!(wires.level());
    }

    #[test]
    fn a_free_bus_stays_untouched() {
        let wires = freed(Chip::Idle);
        assert_eq!((wires.clocks, wires.starts), (0, 0));
    }

    #[test]
    fn a_line_that_stays_low_ends_the_attempt_after_nine_clocks() {
        let wires = freed(Chip::Shorted);
        assert_eq!(wires.clocks, 9);
        assert!(wires.clock && wires.data && wires.time_us < 200);
    }

    #[test]
    fn nothing_begins_a_transfer() {
        for bits in 0..=8 {
            let wires = freed(Chip::Sends(std::vec![false; bits]));
            assert_eq!(wires.starts, 0);
        }
    }
}
