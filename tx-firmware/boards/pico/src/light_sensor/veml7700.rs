//! VEML7700, at its least gain: to 60 000 lx in 100 ms, and to 120 000 lx in 50 ms, the cross-check.

use embassy_time::{Duration, Instant};
use fixed::types::I32F32;
use tx_firmware::light_watch::{LightSample, SensorRange};
use veml6030::{Gain, IntegrationTime, SlaveAddr, Veml6030};

use super::Lost;
use pico::bus::Bus;

/// Twice the longer integration time: what is read then began after the range was set.
const MEASUREMENT: Duration = Duration::from_millis(200);

pub struct Sensor {
    driver: Veml6030<Bus>,
    ready_at: Instant,
}

impl Sensor {
    pub fn new(bus: Bus) -> Self {
        // The VEML7700 has the default address of its sister, and no other.
        Self {
            driver: Veml6030::new(bus, SlaveAddr::Default),
            ready_at: Instant::MAX,
        }
    }

    pub fn start(&mut self, range: SensorRange) -> Result<(), Lost> {
        let time = match range {
            SensorRange::Operating => IntegrationTime::Ms100,
            SensorRange::CrossCheck => IntegrationTime::Ms50,
        };
        self.driver.set_gain(Gain::OneEighth).map_err(|_| Lost)?;
        self.driver.set_integration_time(time).map_err(|_| Lost)?;
        self.driver.enable().map_err(|_| Lost)?;
        self.ready_at = Instant::now() + MEASUREMENT;
        Ok(())
    }

    pub fn take(&mut self) -> Result<Option<LightSample>, Lost> {
        if Instant::now() < self.ready_at {
            return Ok(None);
        }
        self.ready_at = Instant::now() + MEASUREMENT / 2;
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
