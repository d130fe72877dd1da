//! OPT3001: 0.01 to 83 865 lx in twelve ranges, selected automatically.
//!
//! The cross-check is the next range, in which the same light gives another register. For the last range it is
//! the range below, which real light overflows.

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
}

impl<B: I2c> Sensor<B> {
    /// The sensor on a bus. It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        Self {
            link: Link::Asleep(Opt300x::new_opt3001(bus, SlaveAddr::Default)),
            range: LuxRange::Auto,
            usual: (0, I32F32::ZERO),
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
        if let LuxRange::Manual(asked) = range
            && exponent != asked
        {
            // A reading of the previous range, or a stuck register.
            return Ok(None);
        }
        let word = u16::from(exponent) << MANTISSA_BITS | mantissa;
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
