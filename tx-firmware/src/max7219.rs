//! A row-scanned panel: a cheap 8×8 LED module with a MAX7219 (or MAX7221).
//!
//! ## Wiring
//!
//! ```text
//! SPI MOSI ─▶ DIN      SPI SCK ─▶ CLK, at most 10 MHz, mode 0, most significant bit first
//! chip select ─▶ LOAD  its rising edge takes 16 bits over
//! ```
//!
//! Digit d drives row d, segment DP the left column and segment G the right one, as wired on the modules.
//!
//! ## Limits
//!
//! The chip lights one row at a time, for 1/8 of a scan of 1/800 s (MAX7219 datasheet, "Electrical Characteristics": 500 to 1300
//! scans a second), and dims within each row's time in sixteen steps ("Intensity Register"). Therefore:
//!
//! | | [`ShiftRegisterPanel`](crate::shift_register::ShiftRegisterPanel) | this |
//! |---|---|---|
//! | whole scans in an exposure of 1/1000 s | not scanned | 0.5 to 1.3: **rows miss whole exposures** |
//! | shortest exposure whose light deviates by 5 % at most | 1/6300 s | 20 scans: 1/40 s, [`EXPOSURE_MIN_MS`] at the slowest chip |
//! | the same at 1/100 and 1/200 s, by ⅞ of a scan | | 18 % and 35 % at the slowest chip |
//! | range of luminance | 1:3700 with a low current of 1/8 | 1:31, in [`STEPS`] steps |
//! | error of the luminance at the dim end | 5 % | half a step: 50 % |
//! | change of a panel | all LEDs within 20 ns | row by row, within a scan |
//! | greatest luminance | the LEDs' own | an eighth of it |
//!
//! So it suits a desk, a webcam with exposures of 1/50 to 1/200 s at its full frame rate, and the demonstration that a message arrives:
//! `docs/hardware/desk-kit.md`. It does not suit a road. A panel dimmer than half its first step is dark: the chip's shutdown, in which
//! it keeps its rows.

use embedded_hal::spi::SpiDevice;
use link::panel::{PanelFrame, SIDE};
use thiserror::Error;

use crate::{dimming::Duty, matrix::LedMatrix};

/// Steps of luminance above dark: an intensity of n lights a row for (2n + 1)/32 of its time.
pub const STEPS: u16 = 16;

/// The scans that the slowest chip makes in a second.
pub const SCANS_HZ_MIN: u32 = 500;

/// The shortest exposure whose light deviates by 5 % at most, at the slowest chip, ms: it holds 20 whole scans.
pub const EXPOSURE_MIN_MS: u32 = 20 * 1000 / SCANS_HZ_MIN;

/// The chip's registers (MAX7219 datasheet, Table 2).
mod register {
    pub const DIGIT_0: u8 = 0x1;
    pub const DECODE_MODE: u8 = 0x9;
    pub const INTENSITY: u8 = 0xa;
    pub const SCAN_LIMIT: u8 = 0xb;
    pub const SHUTDOWN: u8 = 0xc;
    pub const DISPLAY_TEST: u8 = 0xf;
}

/// A write on the bus failed, with the error of the HAL's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the SPI bus rejected a register ({0:?}): rows may show two panels; show the next")]
pub struct Max7219Error<S>(pub S);

/// The LED panel of a MAX7219. See the [module](self) for the wiring, and for its limits.
///
/// ```
/// use embedded_hal_mock::eh1::spi::{Mock, Transaction};
/// use tx_firmware::{dimming::Duty, matrix::LedMatrix, max7219::Max7219Panel};
/// # let write = |register, value| {
/// #     let word = Transaction::write_vec(vec![register, value]);
/// #     [Transaction::transaction_start(), word, Transaction::transaction_end()]
/// # };
/// # let dark = [[0xc, 0], [0xf, 0], [0x9, 0], [0xb, 7], [0xa, 0]];
/// # let rows = (1..=8).map(|row| [row, 0]);
/// # let lit = [[0xa, 7], [0xc, 1]];
/// # let events: Vec<_> = dark.into_iter().chain(rows).chain(lit).flat_map(|[register, value]| write(register, value)).collect();
/// # let mut spi = Mock::new(&events);
/// # let bus = spi.clone();
/// let mut panel = Max7219Panel::new(bus)?;
/// panel.set_duty(Duty::lit("0.47"))?; // the eighth of sixteen steps: 15/32 of the time
/// # spi.done();
/// # Ok::<(), tx_firmware::max7219::Max7219Error<embedded_hal::spi::ErrorKind>>(())
/// ```
#[derive(Debug)]
pub struct Max7219Panel<S> {
    spi: S,
    /// Intensity; `None` in shutdown.
    step: Option<u8>,
}

impl<S: SpiDevice> Max7219Panel<S> {
    /// Initialises the chip and blanks it, because it powers up in shutdown with arbitrary rows.
    ///
    /// # Errors
    /// Errors of the bus; the panel may then be in any state.
    pub fn new(spi: S) -> Result<Self, Max7219Error<S::Error>> {
        let mut panel = Self { spi, step: None };
        for [register, value] in controls(None) {
            panel.write(register, value)?;
        }
        panel.show(PanelFrame::default())?;
        Ok(panel)
    }

    /// Returns the bus; the chip continues.
    pub fn release(self) -> S {
        self.spi
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), Max7219Error<S::Error>> {
        self.spi.write(&[register, value]).map_err(Max7219Error)
    }
}

impl<S: SpiDevice> LedMatrix for Max7219Panel<S> {
    type Error = Max7219Error<S::Error>;

    fn show(&mut self, panel: PanelFrame) -> Result<(), Self::Error> {
        for [register, value] in rows(panel) {
            self.write(register, value)?;
        }
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Self::Error> {
        let step = intensity(duty);
        if step == self.step {
            return Ok(());
        }
        match step {
            Some(intensity) => {
                self.write(register::INTENSITY, intensity)?;
                if self.step.is_none() {
                    self.write(register::SHUTDOWN, 1)?;
                }
            }
            None => self.write(register::SHUTDOWN, 0)?,
        }
        self.step = step;
        Ok(())
    }
}

/// The control registers with their values at an intensity of 0 to 15, or in shutdown. In this order a chip in any state goes dark first.
///
/// A board that writes all of them again with each panel, rather than changes alone, restores a module that lost them, for example by a
/// spike on its supply.
pub fn controls(intensity: Option<u8>) -> [[u8; 2]; 5] {
    [
        [register::SHUTDOWN, intensity.is_some().into()],
        [register::DISPLAY_TEST, 0],
        [register::DECODE_MODE, 0],
        [register::SCAN_LIMIT, SIDE as u8 - 1],
        [register::INTENSITY, intensity.unwrap_or(0)],
    ]
}

/// The registers of the rows, with their values for a panel.
pub fn rows(panel: PanelFrame) -> [[u8; 2]; SIDE] {
    let mut rows = [[0; 2]; SIDE];
    let bits = panel.bits().to_le_bytes();
    for ((place, register), row) in rows.iter_mut().zip(register::DIGIT_0..).zip(bits) {
        // Bit 7 is segment DP: the left column.
        *place = [register, row.reverse_bits()];
    }
    rows
}

/// The intensity nearest to a share of the brightest step's light: step n has (2n + 1)/31 of it. `None` below half of the first.
///
/// ```
/// use tx_firmware::{dimming::Duty, max7219::intensity};
/// assert_eq!(intensity(Duty::MAX), Some(15));
/// assert_eq!(intensity(Duty::lit("0.033")), Some(0));
/// assert_eq!(intensity(Duty::lit("0.016")), None);
/// ```
pub fn intensity(duty: Duty) -> Option<u8> {
    const BRIGHTEST: u64 = 2 * STEPS as u64 - 1;
    const HALF: u32 = Duty::FRAC_NBITS - 1;
    let halves = u64::from(duty.to_bits()) * BRIGHTEST;
    // Rounded to the nearest odd number of 31sts: floor(x/2) of x = 31·duty, for values above one half.
    (halves >= 1 << HALF).then(|| ((halves >> Duty::FRAC_NBITS) / 2).min(u64::from(STEPS) - 1) as u8)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use embedded_hal::spi::{self as hal_spi, ErrorKind, Operation};
    use properties::prelude::*;
    use std::{vec, vec::Vec};

    /// A chip with registers that the bus writes until it fails.
    #[derive(Debug, Default)]
    struct Chip {
        registers: [u8; 16],
        writes: Vec<[u8; 2]>,
        fails_after: Option<usize>,
    }

    impl hal_spi::ErrorType for Chip {
        type Error = ErrorKind;
    }

    impl SpiDevice for Chip {
        fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
            if self.fails_after == Some(self.writes.len()) {
                return Err(ErrorKind::ModeFault);
            }
            let [Operation::Write([register, value])] = operations else {
                panic!("a register is written in one piece: {operations:?}");
            };
            self.registers[usize::from(*register)] = *value;
            self.writes.push([*register, *value]);
            Ok(())
        }
    }

    impl Chip {
        fn is_lit(&self, row: usize, column: usize) -> bool {
            self.registers[1 + row] >> (7 - column) & 1 == 1
        }
    }

    fn panel() -> Max7219Panel<Chip> {
        Max7219Panel::new(Chip::default()).unwrap()
    }

    /// The share of the brightest step's light.
    fn light(chip: &Chip) -> f64 {
        f64::from(chip.registers[0xc]) * f64::from(2 * chip.registers[0xa] + 1) / 31.0
    }

    #[test]
    fn it_starts_blank_and_dark() {
        let chip = panel().release();
        assert_eq!(chip.registers, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0]);
        // Shutdown comes first, because the old rows must not show.
        assert_eq!(chip.writes[0], [0xc, 0]);
    }

    #[test]
    fn the_same_duty_is_written_once() {
        let mut panel = panel();
        panel.set_duty(Duty::lit("0.5")).unwrap();
        let writes = panel.spi.writes.len();
        panel.set_duty(Duty::lit("0.51")).unwrap();
        assert_eq!(panel.spi.writes.len(), writes);
    }

    #[test]
    fn a_failing_bus_is_reported_and_the_next_duty_tries_again() {
        for fails_after in 0..13 {
            let chip = Chip {
                fails_after: Some(fails_after),
                ..Chip::default()
            };
            assert_eq!(Max7219Panel::new(chip).map(drop), Err(Max7219Error(ErrorKind::ModeFault)));
        }
        let mut panel = panel();
        panel.spi.fails_after = Some(panel.spi.writes.len() + 1);
        assert_eq!(panel.set_duty(Duty::MAX), Err(Max7219Error(ErrorKind::ModeFault)));
        panel.spi.fails_after = None;
        panel.set_duty(Duty::MAX).unwrap();
        assert_eq!(light(&panel.spi), 1.0);
    }

    #[test]
    fn its_sixteen_steps_are_its_limit() {
        let mut panel = panel();
        let lights: Vec<_> = (0..=u16::MAX)
            .map(|duty| {
                panel.set_duty(Duty::from_bits(u32::from(duty) << 16)).unwrap();
                (light(&panel.spi) * 31.0).round() as u8
            })
            .collect();
        assert!(lights.is_sorted());
        let mut steps = lights.clone();
        steps.dedup();
        let odd: Vec<u8> = core::iter::once(0).chain((1..32).step_by(2)).collect();
        assert_eq!(steps, odd);
        assert_eq!(vec![EXPOSURE_MIN_MS, u32::from(STEPS)], [40, 16]);
    }

    properties! {
        #[test]
        fn every_led_is_where_it_belongs(bits in any::<u64>()) {
            let mut panel = panel();
            let frame = PanelFrame::from_bits(bits);
            panel.show(frame).unwrap();
            for (row, column) in (0..8).flat_map(|row| (0..8).map(move |column| (row, column))) {
                prop_assert_eq!(panel.spi.is_lit(row, column), frame.is_on(row, column));
            }
        }

        #[test]
        fn the_light_is_the_nearest_step(duty in any::<u32>()) {
            let mut panel = panel();
            let duty = Duty::from_bits(duty);
            panel.set_duty(duty).unwrap();
            let error = (light(&panel.spi) - duty.to_num::<f64>()).abs();
            prop_assert!(error <= 1.0 / 31.0 + 1e-9, "{error} at {duty}");
        }
    }
}
