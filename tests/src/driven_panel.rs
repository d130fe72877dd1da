//! The light of a board's LEDs, from the signals on its pins.

use serde::Deserialize;

/// Frequency of the transmitter's system clock, Hz.
pub const CLOCK_HZ: f64 = 125e6;
/// Ratio of the light at low current to that at full current, by the resistors of the road kit in kΩ.
pub const LOW_CURRENT_SHARE: f64 = 1.1 / (1.1 + 5.6);
/// Luminance of an On LED of the typical panel at full duty, cd/m².
pub const FULL_CD_M2: f64 = 26_000.0;
/// Reflectance of the LEDs' surface.
pub const REFLECTANCE: f64 = 0.4;

/// The PWM pulses that dim the LEDs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pulses {
    /// Pulse width in seconds.
    pub lit_s: f64,
    /// Period in seconds.
    pub period_s: f64,
    /// Whether the pulses are at low current.
    pub low_current: bool,
}

/// The pulses in an emulator's clock cycles.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Cycles {
    /// Pulse width in cycles.
    pub lit_cycles: u32,
    /// Period in cycles.
    pub period_cycles: u32,
    /// Whether the pulses are at low current.
    pub low_current: bool,
}

impl From<Cycles> for Pulses {
    fn from(cycles: Cycles) -> Self {
        Self {
            lit_s: f64::from(cycles.lit_cycles) / CLOCK_HZ,
            period_s: f64::from(cycles.period_cycles) / CLOCK_HZ,
            low_current: cycles.low_current,
        }
    }
}

impl Pulses {
    /// Fraction of the full light.
    pub fn duty(&self) -> f64 {
        let current = if self.low_current { LOW_CURRENT_SHARE } else { 1.0 };
        if self.lit_s == 0.0 {
            0.0
        } else {
            current * (self.lit_s / self.period_s).min(1.0)
        }
    }

    /// Luminance of an On LED, cd/m².
    pub fn luminance_cd_m2(&self) -> f64 {
        FULL_CD_M2 * self.duty()
    }
}
