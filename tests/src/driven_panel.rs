//! The light of a board's LEDs, from what its pins do.

use serde::Deserialize;

/// Cycles of the transmitter's system clock in a second.
pub const CLOCK_HZ: f64 = 125e6;
/// Light at the low current over that at the full one, of the board's typical panel.
pub const LOW_CURRENT_SHARE: f64 = 0.125;
/// Luminance of an On LED at full duty of the board's typical panel, cd/m².
pub const FULL_CD_M2: f64 = 26_000.0;
/// Reflectance of its LEDs' surface.
pub const REFLECTANCE: f64 = 0.4;

/// The pulses that dim the LEDs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pulses {
    /// Seconds of a pulse.
    pub lit_s: f64,
    /// Seconds of a period.
    pub period_s: f64,
    /// Whether they are at the low current.
    pub low_current: bool,
}

/// The pulses as an emulator tells them.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Cycles {
    /// Cycles of a pulse.
    pub lit_cycles: u32,
    /// Cycles of a period.
    pub period_cycles: u32,
    /// Whether they are at the low current.
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
    /// The share of the full light.
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
