//! BH1750: 1 to 54 612 lx, and to 121 000 lx with its shortest measuring time, the cross-check.

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
    ready_ms: u64,
}

impl<B: I2c, D: DelayNs> Sensor<B, D> {
    /// The sensor on a bus.
    pub fn new(bus: B, delay: D) -> Self {
        Self {
            driver: BH1750::new(bus, delay, false),
            time: USUAL_TIME,
            ready_ms: u64::MAX,
        }
    }
}

impl<B: I2c, D: DelayNs> LightSensor for Sensor<B, D> {
    type Error = Lost;

    fn start(&mut self, now_ms: u64, range: SensorRange) -> Result<(), Lost> {
        self.time = match range {
            SensorRange::Operating => USUAL_TIME,
            SensorRange::CrossCheck => SHORT_TIME,
        };
        self.driver.set_measurement_time_register(self.time).map_err(|_| Lost)?;
        self.driver.start_continuous_measurement(Resolution::High).map_err(|_| Lost)?;
        self.ready_ms = now_ms + MEASUREMENT_MS;
        Ok(())
    }

    fn take(&mut self, now_ms: u64) -> Result<Option<LightSample>, Lost> {
        if now_ms < self.ready_ms {
            return Ok(None);
        }
        self.ready_ms = now_ms + MEASUREMENT_MS;
        let lux = self.driver.get_current_measurement(Resolution::High).map_err(|_| Lost)?;
        let word = (lux * COUNTS_PER_LUX * f32::from(self.time) / f32::from(USUAL_TIME) + 0.5) as u16;
        Ok(Some(if word == u16::MAX {
            LightSample::Saturated
        } else {
            LightSample::Light {
                lux: I32F32::saturating_from_num(lux),
                word,
            }
        }))
    }
}
