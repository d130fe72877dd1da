//! VEML7700, at its least gain: to 60 000 lx in 100 ms, and to 120 000 lx in 50 ms, the cross-check.

use embedded_hal::i2c::I2c;
use fixed::types::I32F32;
use tx_firmware::{
    light_sensor::LightSensor,
    light_watch::{LightSample, SensorRange},
};
use veml6030::{Gain, IntegrationTime, SlaveAddr, Veml6030};

use crate::Lost;

/// Twice the longer integration time: what is read then began after the range was set.
const MEASUREMENT_MS: u64 = 200;

/// A VEML7700.
pub struct Sensor<B> {
    driver: Veml6030<B>,
    ready_ms: u64,
}

impl<B: I2c> Sensor<B> {
    /// The sensor on a bus. It needs no delay.
    pub fn new<D>(bus: B, _: D) -> Self {
        // The VEML7700 has the default address of its sister, and no other.
        Self {
            driver: Veml6030::new(bus, SlaveAddr::Default),
            ready_ms: u64::MAX,
        }
    }
}

impl<B: I2c> LightSensor for Sensor<B> {
    type Error = Lost;

    fn start(&mut self, now_ms: u64, range: SensorRange) -> Result<(), Lost> {
        let time = match range {
            SensorRange::Operating => IntegrationTime::Ms100,
            SensorRange::CrossCheck => IntegrationTime::Ms50,
        };
        self.driver.set_gain(Gain::OneEighth).map_err(|_| Lost)?;
        self.driver.set_integration_time(time).map_err(|_| Lost)?;
        self.driver.enable().map_err(|_| Lost)?;
        self.ready_ms = now_ms + MEASUREMENT_MS;
        Ok(())
    }

    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, Lost> {
        if now_ms < self.ready_ms {
            return Ok(None);
        }
        self.ready_ms = now_ms + MEASUREMENT_MS / 2;
        let word = self.driver.read_raw().map_err(|_| Lost)?;
        Ok(Some(if word == u16::MAX {
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
