//! BH1750: 1 to 54 612 lx, and to 121 000 lx with its shortest measuring time, the cross-check.

use bh1750::{BH1750, Resolution};
use embassy_time::{Delay, Duration, Instant};
use fixed::types::I32F32;
use tx_firmware::light_watch::{LightSample, SensorRange};

use super::Lost;
use pico::bus::Bus;

const USUAL_TIME: u8 = 69;
const SHORT_TIME: u8 = 31;
/// BH1750 datasheet, "Electrical characteristics": the longest measurement at the usual time.
const MEASUREMENT: Duration = Duration::from_millis(180);
/// Counts a lux at the usual time.
const COUNTS_PER_LUX: f32 = 1.2;

pub struct Sensor {
    driver: BH1750<Bus, Delay>,
    time: u8,
    ready_at: Instant,
}

impl Sensor {
    pub fn new(bus: Bus) -> Self {
        Self {
            driver: BH1750::new(bus, Delay, false),
            time: USUAL_TIME,
            ready_at: Instant::MAX,
        }
    }

    pub fn start(&mut self, range: SensorRange) -> Result<(), Lost> {
        self.time = match range {
            SensorRange::Operating => USUAL_TIME,
            SensorRange::CrossCheck => SHORT_TIME,
        };
        self.driver.set_measurement_time_register(self.time).map_err(|_| Lost)?;
        self.driver.start_continuous_measurement(Resolution::High).map_err(|_| Lost)?;
        self.ready_at = Instant::now() + MEASUREMENT;
        Ok(())
    }

    pub fn take(&mut self) -> Result<Option<LightSample>, Lost> {
        if Instant::now() < self.ready_at {
            return Ok(None);
        }
        self.ready_at = Instant::now() + MEASUREMENT;
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
