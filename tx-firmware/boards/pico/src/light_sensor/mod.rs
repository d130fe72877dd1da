//! The ambient light, asked in the range that the transmitter wants to know about next.

#[cfg(feature = "bh1750")]
mod bh1750;
#[cfg(feature = "no-sensor")]
mod no_sensor;
#[cfg(feature = "opt3001")]
mod opt3001;
#[cfg(feature = "veml7700")]
mod veml7700;

#[cfg(feature = "bh1750")]
use self::bh1750 as chosen;
#[cfg(feature = "no-sensor")]
use self::no_sensor as chosen;
#[cfg(feature = "opt3001")]
use self::opt3001 as chosen;
#[cfg(feature = "veml7700")]
use self::veml7700 as chosen;

use embassy_time::{Duration, Instant};
use tx_firmware::light_watch::{LightSample, SensorRange};

use pico::bus::Bus;

/// How often a sensor is asked whether it is ready.
pub const POLL: Duration = Duration::from_millis(20);
/// A sensor that has nothing new for so long is missing.
const PATIENCE: Duration = Duration::from_millis(500);

/// The sensor did not answer.
struct Lost;

/// The board's light sensor.
pub struct LightSensor {
    sensor: chosen::Sensor,
    /// In which range it measures, and since when there is nothing new; none while it does not answer.
    measuring: Option<(SensorRange, Instant)>,
}

impl LightSensor {
    /// The sensor on a bus.
    pub fn new(bus: Bus) -> Self {
        Self {
            sensor: chosen::Sensor::new(bus),
            measuring: None,
        }
    }

    /// What the sensor has to say, if it has: the range it was measured in, and the reading. It is then set to
    /// `wanted`, and starts over if it did not answer.
    pub fn poll(&mut self, wanted: impl FnOnce() -> SensorRange) -> Option<(SensorRange, LightSample)> {
        let Some((range, since)) = self.measuring else {
            return self.measure(wanted());
        };
        match self.sensor.take() {
            Ok(Some(sample)) => {
                self.measuring = Some((range, Instant::now()));
                Some((range, sample))
            }
            Ok(None) if since.elapsed() < PATIENCE => {
                let wanted = wanted();
                if wanted == range { None } else { self.measure(wanted) }
            }
            Ok(None) | Err(Lost) => {
                self.measuring = None;
                Some((range, LightSample::Missing))
            }
        }
    }

    fn measure(&mut self, range: SensorRange) -> Option<(SensorRange, LightSample)> {
        let started = self.sensor.start(range);
        self.measuring = started.is_ok().then(|| (range, Instant::now()));
        started.is_err().then_some((range, LightSample::Missing))
    }
}
