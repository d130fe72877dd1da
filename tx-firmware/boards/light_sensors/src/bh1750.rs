//! BH1750: 1 to 54 612 lx, and to 121 000 lx with its shortest measuring time, the cross-check.
//!
//! Sunlight saturates both. A stuck register is full, too, but does not become 0 when it is cleared.
//!
//! A chip that is cleared and then measures nothing reads 0 in both ranges, as in the dark below 1 lx. No answer of the chip distinguishes
//! the two: the panel dims as in the dark, which is safe, and no fault is reported.

use bh1750::{BH1750, Resolution};
use embedded_hal::{delay::DelayNs, i2c::I2c};
use fixed::types::I32F32;
use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};

use crate::Lost;

const USUAL_TIME: u8 = 69;
const SHORT_TIME: u8 = 31;
/// BH1750 datasheet, "Electrical characteristics": the longest measurement at the usual time.
const MEASUREMENT_MS: u64 = 180;
/// Counts a lux at the usual time.
const COUNTS_PER_LUX: f32 = 1.2;

/// A BH1750 at its usual address.
pub struct Sensor<B, D> {
    driver: BH1750<B, D>,
    time: u8,
    /// Whether the register was 0 after it had been cleared, at the latest start.
    was_cleared: bool,
    /// The end of the measurement, counted from the first call of `take` after its start: the bus and interrupts may delay the commands
    /// that start it, but by then they have arrived.
    ready_ms: Option<u64>,
}

impl<B: I2c, D: DelayNs> Sensor<B, D> {
    /// The sensor on a bus.
    pub fn new(bus: B, delay: D) -> Self {
        Self {
            driver: BH1750::new(bus, delay, false),
            time: USUAL_TIME,
            was_cleared: false,
            ready_ms: None,
        }
    }

    fn read_lux(&mut self) -> Result<f32, Lost> {
        self.driver.get_current_measurement(Resolution::High).map_err(|_| Lost)
    }
}

impl<B: I2c, D: DelayNs> LightSensor for Sensor<B, D> {
    type Error = Lost;

    fn start(&mut self, _: u64, range: SensorRange) -> Result<(), Lost> {
        self.time = match range {
            SensorRange::Operating => USUAL_TIME,
            SensorRange::CrossCheck => SHORT_TIME,
        };
        // No measurement can end between reset and reading, because none runs. Without power a reset has no effect.
        self.driver.power_down().map_err(|_| Lost)?;
        self.driver.power_on().map_err(|_| Lost)?;
        self.driver.reset().map_err(|_| Lost)?;
        self.was_cleared = self.read_lux()? <= 0.0;
        self.driver.set_measurement_time_register(self.time).map_err(|_| Lost)?;
        self.driver.start_continuous_measurement(Resolution::High).map_err(|_| Lost)?;
        self.ready_ms = None;
        Ok(())
    }

    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, Lost> {
        if now_ms < *self.ready_ms.get_or_insert(now_ms + MEASUREMENT_MS) {
            return Ok(None);
        }
        self.ready_ms = Some(now_ms + MEASUREMENT_MS);
        let lux = self.read_lux()?;
        let word = (lux * COUNTS_PER_LUX * f32::from(self.time) / f32::from(USUAL_TIME) + 0.5) as u16;
        Ok(Some(match word {
            u16::MAX if self.was_cleared => LightSample::Saturated,
            u16::MAX => LightSample::Stuck,
            _ => LightSample::Light {
                lux: I32F32::saturating_from_num(lux),
                word,
            },
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated_bus::{Bench, Chip, NoDelay};
    use link::serial::{Faults, Light};
    use tx_firmware::{
        light_sensor::PolledSensor,
        light_watch::{HOLD_MS, LightWatch},
    };

    /// A transfer of three bytes at 400 kHz, and one that the board's limit of 5 ms just lets pass.
    const USUAL_US: u64 = 70;
    const SLOW_US: u64 = 4_900;

    /// The chip, which takes the longest time that the datasheet allows at the usual measuring time.
    struct Simulated {
        lux: f64,
        hangs: bool,
        is_on: bool,
        time: u8,
        register: u16,
        /// The end of the measurement that runs.
        ends_us: Option<u64>,
    }

    impl Simulated {
        fn in_light(lux: f64) -> Self {
            Self {
                lux,
                hangs: false,
                is_on: false,
                time: USUAL_TIME,
                register: 0,
                ends_us: None,
            }
        }

        fn measure(&mut self, now_us: u64) {
            while let Some(end) = self.ends_us.filter(|&end| end <= now_us) {
                if !self.hangs {
                    self.register = (self.lux * f64::from(COUNTS_PER_LUX) * f64::from(self.time) / f64::from(USUAL_TIME)) as u16;
                }
                self.ends_us = Some(end + 1_000 * MEASUREMENT_MS);
            }
        }
    }

    impl Chip for Simulated {
        const ADDRESS: u8 = 0x23;

        fn write(&mut self, now_us: u64, bytes: &[u8]) {
            self.measure(now_us);
            match *bytes {
                [0b0000_0000] => (self.is_on, self.ends_us) = (false, None),
                [0b0000_0001] => self.is_on = true,
                [0b0000_0111] if self.is_on && !self.hangs => self.register = 0,
                [0b0000_0111] => {}
                [0b0001_0000] => (self.is_on, self.ends_us) = (true, Some(now_us + 1_000 * MEASUREMENT_MS)),
                [high] if high >> 3 == 0b01000 => self.time = self.time & 0x1f | high << 5,
                [low] if low >> 5 == 0b011 => self.time = self.time & 0xe0 | low & 0x1f,
                _ => panic!("{bytes:x?} is not a command"),
            }
        }

        fn read(&mut self, now_us: u64, buffer: &mut [u8]) {
            self.measure(now_us);
            buffer.copy_from_slice(&self.register.to_be_bytes());
        }
    }

    #[test]
    fn a_register_that_hangs_at_full_scale_is_stuck() {
        for lux in [0.0, 5_000.0, 70_000.0, 130_000.0] {
            let bench = Bench::new(Simulated::in_light(lux), USUAL_US);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 10_000, |_, _, _| {});
            assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
            let mut chip = bench.chip.borrow_mut();
            (chip.hangs, chip.register) = (true, u16::MAX);
            drop(chip);
            bench.follow(&mut sensor, &mut watch, 11_000 + HOLD_MS, |_, _, _| {});
            assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_STUCK), "{lux} lx");
            bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, _, watch| {
                assert_eq!((watch.light(), watch.faults()), (Light::Lost, Faults::SENSOR_STUCK), "{now_ms} ms");
            });
            bench.chip.borrow_mut().hangs = false;
            bench.follow(&mut sensor, &mut watch, 65_000, |_, _, _| {});
            assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
        }
    }

    #[test]
    fn sunlight_that_fills_both_ranges_is_daylight() {
        let bench = Bench::new(Simulated::in_light(130_000.0), USUAL_US);
        let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
        bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
        bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, sample, watch| {
            assert_eq!(sample, LightSample::Saturated, "{now_ms} ms");
            assert_eq!((watch.light(), watch.faults()), (Light::Daylight, Faults::empty()), "{now_ms} ms");
        });
    }

    /// A measurement from before a change of range would show another illuminance, by the ratio of the times.
    #[test]
    fn no_measurement_is_read_before_its_end() {
        for transfer_us in [USUAL_US, SLOW_US] {
            for lux in [100.0, 5_000.0, 40_000.0, 100_000.0] {
                let bench = Bench::new(Simulated::in_light(lux), transfer_us);
                let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
                bench.follow(&mut sensor, &mut watch, 20_000, |now_ms, sample, _| match sample {
                    LightSample::Light { lux: read, .. } => {
                        assert!((read.to_num::<f64>() / lux - 1.0).abs() < 0.02, "{read} lx of {lux} at {now_ms} ms");
                    }
                    LightSample::Saturated => assert!(lux > 54_612.0, "{now_ms} ms"),
                    LightSample::Stuck | LightSample::Missing => panic!("{sample:?} at {now_ms} ms"),
                });
            }
        }
    }
}
