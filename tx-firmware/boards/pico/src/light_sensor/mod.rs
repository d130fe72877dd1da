//! The ambient light, asked at the setting that the transmitter wants to know about next.

#[cfg(feature = "bh1750")]
mod bh1750;
#[cfg(feature = "opt3001")]
mod opt3001;
#[cfg(feature = "veml7700")]
mod veml7700;

#[cfg(feature = "bh1750")]
use self::bh1750 as chosen;
#[cfg(feature = "opt3001")]
use self::opt3001 as chosen;
#[cfg(feature = "veml7700")]
use self::veml7700 as chosen;

use embassy_time::{Duration, Instant};
use tx_firmware::light_watch::{Reading, Setting};

use crate::bus::Bus;

/// How often a sensor is asked whether it is ready.
pub const POLL: Duration = Duration::from_millis(20);
/// A sensor that has nothing new for so long is missing.
const PATIENCE: Duration = Duration::from_millis(500);

/// The sensor did not answer.
struct Lost;

/// The board's light sensor.
pub struct LightSensor {
    sensor: chosen::Sensor,
    /// At which setting it measures, and since when there is nothing new; none while it does not answer.
    measuring: Option<(Setting, Instant)>,
}

impl LightSensor {
    /// The sensor on a bus.
    pub fn new(bus: Bus) -> Self {
        Self {
            sensor: chosen::Sensor::new(bus),
            measuring: None,
        }
    }

    /// What the sensor has to say, if it has: the setting it was measured at, and the reading. It is then set to
    /// `wanted`, and starts over if it did not answer.
    pub fn poll(&mut self, wanted: impl FnOnce() -> Setting) -> Option<(Setting, Reading)> {
        let Some((setting, since)) = self.measuring else {
            return self.measure(wanted());
        };
        match self.sensor.take() {
            Ok(Some(reading)) => {
                self.measuring = Some((setting, Instant::now()));
                Some((setting, reading))
            }
            Ok(None) if since.elapsed() < PATIENCE => {
                let wanted = wanted();
                if wanted == setting {
                    None
                } else {
                    self.measure(wanted)
                }
            }
            Ok(None) | Err(Lost) => {
                self.measuring = None;
                Some((setting, Reading::Missing))
            }
        }
    }

    fn measure(&mut self, setting: Setting) -> Option<(Setting, Reading)> {
        let started = self.sensor.start(setting);
        self.measuring = started.is_ok().then(|| (setting, Instant::now()));
        started.is_err().then_some((setting, Reading::Missing))
    }
}
