//! OPT3001: 0.01 to 83 865 lx in twelve ranges, selected automatically.
//!
//! The cross-check is the next range, in which the same light gives another register. For the last range it is
//! the range below, which real light overflows.
//!
//! The register contains its range, also in the dark. So a register that keeps another range than the one asked for is stuck, even at 0 lx.

use embedded_hal::i2c::I2c;
use fixed::types::I32F32;
use opt300x::{IntegrationTime, LuxRange, ModeChangeError, Opt300x, SlaveAddr, ic::Opt3001, mode::Continuous};
use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};

use crate::Lost;

const LAST_RANGE: u8 = 11;
const MANTISSA_BITS: u32 = 12;
const FULL_MANTISSA: u16 = (1 << MANTISSA_BITS) - 1;

type Driver<B, MODE> = Opt300x<B, Opt3001, MODE>;

enum Link<B> {
    Asleep(Driver<B, opt300x::mode::OneShot>),
    Measuring(Driver<B, Continuous>),
    /// Only during the switch between the two.
    Between,
}

/// An OPT3001 at its usual address.
pub struct Sensor<B> {
    link: Link<B>,
    range: LuxRange,
    /// The last reading with automatic range.
    usual: (u8, I32F32),
    /// The register since it was of another range than the one asked for.
    hanging: Option<u16>,
}

impl<B: I2c> Sensor<B> {
    /// The sensor on a bus. It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        Self {
            link: Link::Asleep(Opt300x::new_opt3001(bus, SlaveAddr::Default)),
            range: LuxRange::Auto,
            usual: (0, I32F32::ZERO),
            hanging: None,
        }
    }

    /// The driver of a sensor that measures continuously.
    fn driver(&mut self) -> Result<&mut Driver<B, Continuous>, Lost> {
        self.link = match core::mem::replace(&mut self.link, Link::Between) {
            Link::Asleep(driver) => match driver.into_continuous() {
                Ok(driver) => Link::Measuring(driver),
                Err(ModeChangeError::I2C(_, driver)) => Link::Asleep(driver),
            },
            other => other,
        };
        match &mut self.link {
            Link::Measuring(driver) => Ok(driver),
            Link::Asleep(_) | Link::Between => Err(Lost),
        }
    }
}

impl<B: I2c> LightSensor for Sensor<B> {
    type Error = Lost;

    fn start(&mut self, _: u64, range: SensorRange) -> Result<(), Lost> {
        let range = match range {
            SensorRange::Operating => LuxRange::Auto,
            SensorRange::CrossCheck => LuxRange::Manual(neighbour(self.usual.0)),
        };
        self.range = range;
        let driver = self.driver()?;
        driver.set_integration_time(IntegrationTime::Ms100).map_err(|_| Lost)?;
        driver.set_lux_range(range).map_err(|_| Lost)
    }

    fn take(&mut self, _: u64) -> Result<Option<LightSample>, Lost> {
        let range = self.range;
        let (usual_range, usual_lux) = self.usual;
        let driver = self.driver()?;
        let status = driver.read_status().map_err(|_| Lost)?;
        if !status.conversion_ready {
            return Ok(None);
        }
        let (exponent, mantissa) = driver.read_raw().map_err(|_| Lost)?;
        let word = u16::from(exponent) << MANTISSA_BITS | mantissa;
        let is_stuck = self.hanging == Some(word);
        let is_of_another = matches!(range, LuxRange::Manual(asked) if exponent != asked);
        self.hanging = (is_stuck || is_of_another).then_some(word);
        if is_stuck || is_of_another {
            // The first one may be a reading of the previous range.
            return Ok(is_stuck.then_some(LightSample::Stuck));
        }
        let lux = lux(exponent, mantissa);
        let full = status.has_overflown || mantissa == FULL_MANTISSA;
        match range {
            LuxRange::Auto => {
                self.usual = (exponent, lux);
                if full && exponent == LAST_RANGE {
                    return Ok(Some(LightSample::Saturated));
                }
            }
            // An overflow of the range below confirms a reading of the last range, or its saturation.
            LuxRange::Manual(_) if full && usual_range == LAST_RANGE => {
                let too_bright = usual_lux >= self::lux(LAST_RANGE, FULL_MANTISSA);
                return Ok(Some(if too_bright {
                    LightSample::Saturated
                } else {
                    LightSample::Light { lux: usual_lux, word }
                }));
            }
            LuxRange::Manual(_) => {}
        }
        Ok(Some(LightSample::Light { lux, word }))
    }
}

fn neighbour(range: u8) -> u8 {
    if range < LAST_RANGE { range + 1 } else { LAST_RANGE - 1 }
}

/// OPT3001 datasheet, Eq. (3): 0.01 lx · 2^exponent · mantissa.
fn lux(exponent: u8, mantissa: u16) -> I32F32 {
    let hundredths = u32::from(mantissa) << exponent.min(LAST_RANGE);
    I32F32::from_num(hundredths) / 100
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
    const TRANSFER_US: u64 = 100;
    const CONVERSION_US: u64 = 100_000;
    const READY: u16 = 1 << 7;
    const OVERFLOW: u16 = 1 << 8;

    /// The chip (OPT3001 datasheet, 7.6). If it hangs, it reports conversions, and its result stays.
    struct Simulated {
        lux: f64,
        hangs: bool,
        pointer: u8,
        configuration: u16,
        result: u16,
        ends_us: u64,
    }

    impl Simulated {
        fn in_light(lux: f64) -> Self {
            Self {
                lux,
                hangs: false,
                pointer: 0,
                configuration: 0xc810,
                result: 0,
                ends_us: u64::MAX,
            }
        }

        fn convert(&mut self, now_us: u64) {
            while self.ends_us <= now_us {
                self.ends_us += CONVERSION_US;
                self.configuration |= READY;
                if self.hangs {
                    continue;
                }
                let counts = |exponent: u16| (self.lux / 0.01 / f64::from(1 << exponent)).round();
                let asked = self.configuration >> 12;
                let exponent = match asked {
                    0..=11 => asked,
                    _ => (0..11).find(|&exponent| counts(exponent) <= 4095.0).unwrap_or(11),
                };
                let overflow = if counts(exponent) > 4095.0 { OVERFLOW } else { 0 };
                self.result = exponent << 12 | counts(exponent).min(4095.0) as u16;
                self.configuration = self.configuration & !OVERFLOW | overflow;
            }
        }
    }

    impl Chip for Simulated {
        const ADDRESS: u8 = 0x44;

        fn write(&mut self, now_us: u64, bytes: &[u8]) {
            self.convert(now_us);
            self.pointer = bytes[0];
            if let [0x01, high, low] = *bytes {
                self.configuration = u16::from_be_bytes([high, low]) & !(READY | OVERFLOW);
                self.ends_us = now_us + CONVERSION_US;
            }
        }

        fn read(&mut self, now_us: u64, buffer: &mut [u8]) {
            self.convert(now_us);
            let value = match self.pointer {
                0 => self.result,
                1 => self.configuration,
                other => panic!("{other} is not a register of this driver"),
            };
            buffer.copy_from_slice(&value.to_be_bytes());
            if self.pointer == 1 {
                self.configuration &= !READY;
            }
        }
    }

    #[test]
    fn a_register_that_hangs_is_stuck_even_in_the_dark() {
        for lux in [0.0, 0.3, 5_000.0, 60_000.0, 100_000.0] {
            let bench = Bench::new(Simulated::in_light(lux), TRANSFER_US);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 10_000, |_, _, _| {});
            assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
            for word in [0, 0x0a12, 0xb123] {
                let mut chip = bench.chip.borrow_mut();
                (chip.hangs, chip.result) = (true, word);
                let now_ms = chip.ends_us / 1_000;
                drop(chip);
                bench.follow(&mut sensor, &mut watch, now_ms + 4_000 + HOLD_MS, |_, _, _| {});
                let stuck = (Light::Lost, Faults::SENSOR_STUCK);
                assert_eq!((watch.light(), watch.faults()), stuck, "{word:#x} at {lux} lx");
                bench.follow(&mut sensor, &mut watch, now_ms + 30_000, |now_ms, _, watch| {
                    assert_eq!((watch.light(), watch.faults()), stuck, "{word:#x} at {lux} lx, {now_ms} ms");
                });
                bench.chip.borrow_mut().hangs = false;
                bench.follow(&mut sensor, &mut watch, now_ms + 35_000, |_, _, _| {});
                assert!(matches!(watch.light(), Light::Measured | Light::Daylight), "{lux} lx");
            }
        }
    }

    #[test]
    fn steady_light_and_the_dark_are_never_stuck() {
        for lux in [0.0, 0.004, 0.01, 0.3, 40.95, 5_000.0, 60_000.0, 83_000.0, 100_000.0] {
            let bench = Bench::new(Simulated::in_light(lux), TRANSFER_US);
            let (mut sensor, mut watch) = (PolledSensor::new(Sensor::new(&bench, NoDelay)), LightWatch::new());
            bench.follow(&mut sensor, &mut watch, 1_000, |_, _, _| {});
            bench.follow(&mut sensor, &mut watch, 60_000, |now_ms, sample, watch| {
                assert_ne!(sample, LightSample::Stuck, "{lux} lx at {now_ms} ms");
                let is_known = matches!(watch.light(), Light::Measured | Light::Daylight);
                assert!(is_known && watch.faults().is_empty(), "{lux} lx at {now_ms} ms");
            });
        }
    }
}
