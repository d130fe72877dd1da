//! The light on the simulated board, and its light sensor.

use fixed::types::I32F32;
use tx_firmware::light_watch::LightSample;

/// Maximum reading of an OPT3001, in lx.
const SATURATED_LX: f64 = 83_865.6;

/// The state of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    Works,
    /// Nothing answers on the bus.
    Missing,
    /// It always returns the same register.
    Stuck,
}

/// A light sensor with the precision of an OPT3001, in given light.
#[derive(Debug)]
pub struct LightSensor {
    /// The light, lx.
    pub illuminance_lx: f64,
    pub health: Health,
    last: LightSample,
    conversions: u16,
}

impl LightSensor {
    /// A working sensor.
    pub fn new(illuminance_lx: f64) -> Self {
        Self {
            illuminance_lx,
            health: Health::Works,
            last: LightSample::Missing,
            conversions: 0,
        }
    }

    /// The reading in either range.
    pub fn read(&mut self) -> LightSample {
        match self.health {
            Health::Works => {
                // No two conversions of a working sensor are equal.
                self.conversions = self.conversions.wrapping_add(1);
                self.last = if self.illuminance_lx > SATURATED_LX {
                    LightSample::Saturated
                } else {
                    LightSample::Light {
                        lux: I32F32::saturating_from_num(self.illuminance_lx),
                        word: self.conversions,
                    }
                };
                self.last
            }
            Health::Missing => LightSample::Missing,
            Health::Stuck if self.last == LightSample::Saturated => LightSample::Stuck,
            Health::Stuck => self.last,
        }
    }
}
