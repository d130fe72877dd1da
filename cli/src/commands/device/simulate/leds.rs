//! The LEDs of the simulated board: the pulses of a Pico's timer, on the bench's panel with a current switch.

use std::convert::Infallible;

use link::panel::PanelFrame;
use link::serial::Measured;
use link::symbol_rate::SymbolRate;
use link::waveform::SymbolTiming;
use tx_firmware::calibration::{BENCH_FULL_DUTY_LX, SWITCHED};
use tx_firmware::dimming::Duty;
use tx_firmware::drive::{Drive, Pulses};
use tx_firmware::matrix::LedMatrix;

/// The clock of a Pico's timer.
const CLOCK_HZ: u32 = 125_000_000;

/// Pulsed LEDs.
#[derive(Debug)]
pub struct Leds {
    drive: Drive,
    pulses: Pulses,
}

impl Leds {
    /// Dark LEDs, driven according to a calibration.
    pub fn new(calibration: &Measured) -> Self {
        Self {
            drive: Drive::new(calibration, CLOCK_HZ),
            pulses: Pulses::default(),
        }
    }

    /// The light of an On LED relative to full light, independent of the calibration. A pulse that is shorter than the driver's shortest
    /// clean one loses light in proportion to the missing time.
    pub fn light(&self) -> f64 {
        let pulse_ns = f64::from(self.pulses.lit) * 1e9 / f64::from(CLOCK_HZ);
        let whole = (pulse_ns / f64::from(SWITCHED.shortest_pulse_ns)).min(1.0);
        self.pulses.duty(SWITCHED.low_current_share).to_num::<f64>() * whole
    }
}

impl LedMatrix for Leds {
    type Error = Infallible;

    const SHOWS_CARRIER: bool = true;
    /// Nobody looks at simulated LEDs, and a camera reads still panels with any exposure.
    const DEFAULT_TIMING: SymbolTiming = SymbolTiming::still(SymbolRate::DEFAULT);
    const FULL_DUTY_LX: u32 = BENCH_FULL_DUTY_LX;

    fn show(&mut self, _: PanelFrame) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_duty(&mut self, duty: Duty) -> Result<(), Infallible> {
        self.pulses = self.drive.pulses(duty, self.pulses);
        Ok(())
    }

    fn set_calibration(&mut self, measured: &Measured) {
        self.drive = Drive::new(measured, CLOCK_HZ);
    }
}
