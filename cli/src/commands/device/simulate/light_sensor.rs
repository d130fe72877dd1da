//! The light on the simulated board, and the sensor that looks at it.

use fixed::types::I32F32;
use tx_firmware::light_watch::LightSample;

/// What an OPT3001 can read at most, lx.
const SATURATED_LX: f64 = 83_865.6;

/// How the sensor does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// It measures.
    Works,
    /// Nothing answers on the bus.
    Missing,
    /// It always answers with the same register.
    Stuck,
}

/// A light sensor with the precision of an OPT3001, in given light.
#[derive(Debug)]
pub struct LightSensor {
    /// The light, lx.
    pub illuminance_lx: f64,
    /// How it does.
    pub health: Health,
    /// What it read last.
    last: LightSample,
    conversions: u16,
}

impl LightSensor {
    /// One that works.
    pub fn new(illuminance_lx: f64) -> Self {
        Self {
            illuminance_lx,
            health: Health::Works,
            last: LightSample::Missing,
            conversions: 0,
        }
    }

    /// What it reads, in either range.
    pub fn read(&mut self) -> LightSample {
        match self.health {
            Health::Works => {
                // No two conversions of a living sensor are alike.
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
            Health::Stuck => self.last,
        }
    }
}
