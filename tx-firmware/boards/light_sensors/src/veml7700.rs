//! VEML7700, at its least gain: to 35 000 lx in 100 ms, and to 140 000 lx in 25 ms, the cross-check.
//!
//! No daylight saturates the cross-check's range: a register that is full there is stuck, or a lamp touches the sensor. Nothing in the
//! datasheet distinguishes these, so the reading is *stuck*, which is safe.
//!
//! A register that is always 0 may also be the dark, below 0.5 lx: it is 0 in both ranges then, and no flag says that a measurement ended.
//! The panel dims as in the dark, which is safe, and no fault is reported.

use embedded_hal::i2c::I2c;
use fixed::types::I32F32;
use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};
use veml6030::{Gain, IntegrationTime, SlaveAddr, Veml6030};

use crate::Lost;

/// Twice the longer integration time, because the datasheet does not say how exact the time is.
const MEASUREMENT_MS: u64 = 200;

/// A VEML7700.
pub struct Sensor<B> {
    driver: Veml6030<B>,
    range: SensorRange,
    /// Whether every reading has been full since the cross-check's range was.
    is_stuck: bool,
    /// The end of the measurement, counted from the first call of `take` after its start: the bus and interrupts may delay the commands
    /// that start it, but by then they have arrived.
    ready_ms: Option<u64>,
}

impl<B: I2c> Sensor<B> {
    /// The sensor on a bus. It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        // The VEML7700 has the default address of its sister, and no other.
        Self {
            driver: Veml6030::new(bus, SlaveAddr::Default),
            range: SensorRange::Operating,
            is_stuck: false,
            ready_ms: None,
        }
    }
}

impl<B: I2c> LightSensor for Sensor<B> {
    type Error = Lost;

    fn start(&mut self, _: u64, range: SensorRange) -> Result<(), Lost> {
        let time = match range {
            SensorRange::Operating => IntegrationTime::Ms100,
            SensorRange::CrossCheck => IntegrationTime::Ms25,
        };
        // Vishay, "Designing the VEML7700 into an application": settings change in shutdown, which also ends the measurement that runs.
        self.driver.disable().map_err(|_| Lost)?;
        self.driver.set_gain(Gain::OneEighth).map_err(|_| Lost)?;
        self.driver.set_integration_time(time).map_err(|_| Lost)?;
        self.driver.enable().map_err(|_| Lost)?;
        (self.range, self.ready_ms) = (range, None);
        Ok(())
    }

    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, Lost> {
        if now_ms < *self.ready_ms.get_or_insert(now_ms + MEASUREMENT_MS) {
            return Ok(None);
        }
        self.ready_ms = Some(now_ms + MEASUREMENT_MS / 2);
        let word = self.driver.read_raw().map_err(|_| Lost)?;
        let is_full = word == u16::MAX;
        self.is_stuck = is_full && (self.is_stuck || self.range == SensorRange::CrossCheck);
        Ok(Some(if self.is_stuck {
            LightSample::Stuck
        } else if is_full {
            LightSample::Saturated
        } else {
            let lux = self.driver.convert_raw_als_to_lux(word);
            LightSample::Light {
                lux: I32F32::saturating_from_num(lux),
                word,
            }
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

    /// A transfer of four bytes at 400 kHz.
    const TRANSFER_US: u64 = 90;
    /// VEML7700 datasheet, "Resolution and maximum detection range": lux a count at gain 1/8 in 100 ms.
    const LUX_PER_COUNT: f64 = 0.5376;
    /// The most daylight that there can be.
    const SUN_LX: f64 = 130_000.0;

    /// The chip. It ends the measurement that runs before it takes another integration time, except after shutdown.
    struct Simulated {
        lux: f64,
        hangs: bool,
        configuration: u16,
        register: u16,
        /// The end of the measurement that runs, and its integration time.
        runs: Option<(u64, u64)>,
    }

    impl Simulated {
        fn in_light(lux: f64) -> Self {
            Self {
                lux,
                hangs: false,
                configuration: 1,
                register: 0,
                runs: None,
            }
        }

        fn integration_ms(&self) -> u64 {
            match self.configuration >> 6 & 0b1111 {
                0b1100 => 25,
                0b1000 => 50,
                0 => 100,
                other => panic!("{other:b} is not an integration time of this driver"),
            }
        }

        fn measure(&mut self, now_us: u64) {
            while let Some((end, integration_ms)) = self.runs.filter(|&(end, _)| end <= now_us) {
                if !self.hangs {
                    self.register = (self.lux / LUX_PER_COUNT * integration_ms as f64 / 100.0) as u16;
                }
                self.runs = Some((end + 1_000 * self.integration_ms(), self.integration_ms()));
            }
        }
    }

    impl Chip for Simulated {
        const ADDRESS: u8 = 0x10;

        fn write(&mut self, now_us: u64, bytes: &[u8]) {
            self.measure(now_us);
            match *bytes {
                [0x00, low, high] => self.configuration = u16::from_le_bytes([low, high]),
                [0x04] => return,
                _ => panic!("{bytes:x?} is not a command"),
            }
            let gain = self.configuration >> 11 & 0b11;
            self.runs = match self.configuration & 1 {
                1 => None,
                _ => self.runs.or(Some((now_us + 1_000 * self.integration_ms(), self.integration_ms()))),
            };
            assert!(self.runs.is_none() || gain == 0b10);
        }

        fn read(&mut self, now_us: u64, buffer: &mut [u8]) {
            self.measure(now_us);
            buffer.copy_from_slice(&self.register.to_le_bytes());
        }
    }

    #[test]
    fn a_register_that_hangs_at_full_scale_is_stuck() {
        for lux in [0.0, 5_000.0, 70_000.0, SUN_LX] {
            let bench = Bench::new(Simulated::in_light(lux), TRANSFER_US);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 10_000, |_, _, _| {});
            assert_eq!(watch.light(), Light::Measured, "{lux} lx");
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
            assert_eq!(watch.light(), Light::Measured, "{lux} lx");
        }
    }

    #[test]
    fn sunlight_is_measured_and_never_stuck() {
        for lux in [20_000.0, 40_000.0, 80_000.0, SUN_LX] {
            let bench = Bench::new(Simulated::in_light(lux), TRANSFER_US);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
            bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, sample, watch| {
                assert_ne!(sample, LightSample::Stuck, "{lux} lx at {now_ms} ms");
                assert_eq!(
                    (watch.light(), watch.faults()),
                    (Light::Measured, Faults::empty()),
                    "{lux} lx at {now_ms} ms"
                );
            });
        }
    }

    /// A measurement from before a change of range would show another illuminance, by the ratio of the times.
    #[test]
    fn no_measurement_is_read_before_its_end() {
        let bench = Bench::new(Simulated::in_light(5_000.0), TRANSFER_US);
        let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
        let mut first = None;
        bench.follow(&mut sensor, &mut watch, 20_000, |now_ms, sample, _| {
            let LightSample::Light { lux, .. } = sample else {
                panic!("{sample:?} at {now_ms} ms");
            };
            let first = f64::from(*first.get_or_insert(lux.to_num::<f32>()));
            assert!(
                (lux.to_num::<f64>() / first - 1.0).abs() < 0.02,
                "{lux} lx of {first} at {now_ms} ms"
            );
        });
    }
}
