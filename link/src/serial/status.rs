//! A transmitter's status.

use crate::l2a_table::{Illuminance, L2a};
use bitflags::bitflags;
use fixed::types::{U0F32, U32F32};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The state of a transmitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// Seconds since the start.
    pub uptime_s: u32,
    /// The state of the light measurement.
    pub light: Light,
    /// The ambient illuminance in use, lx; `None` before the first reading.
    pub illuminance_lx: Option<Illuminance>,
    /// The wanted L2A: the table's, or that of the safe default without light readings; 0 while the panel is dark before the first reading.
    pub l2a: L2a,
    /// Luminance of an On LED, cd/m².
    pub luminance_cd_m2: U32F32,
    /// Luminance of an On LED as a share of full luminance; the greatest number of its type means 1.
    pub duty: U0F32,
    /// Why the luminance differs from the wanted one; `None` if it does not.
    pub limited: Option<Limit>,
    /// The current faults.
    pub faults: Faults,
    /// CRC-32C of the running table's image.
    pub table_crc: u32,
    /// Whether it shows a message rather than a beacon.
    pub sending: bool,
    /// The counters.
    pub counters: Counters,
}

/// Counters since the start or since their reset; each saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Whole frames.
    pub frames: u32,
    /// Garbage between two zeros: frames cut short, too long or with a wrong CRC.
    pub bad_frames: u32,
    /// Requests refused.
    pub refusals: u32,
    /// Symbols shown.
    pub symbols: u32,
    /// Symbols lost on the way to the LEDs.
    pub lost_symbols: u32,
    /// Readings of the light sensor, including saturated ones.
    pub readings: u32,
    /// Readings that failed.
    pub missed_readings: u32,
}

/// The state of a transmitter's light measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Light {
    /// No reading yet: it has just started, and is dark.
    Unknown,
    /// The sensor delivers readings.
    Measured,
    /// The sensor has stopped for a moment: the last reading still counts.
    Held,
    /// Too bright for the sensor, in two of its ranges.
    Daylight,
    /// The reading has expired: the luminance is a safe default.
    Lost,
}

/// The cause of a deviation from the wanted luminance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Limit {
    /// The wanted luminance exceeds the panel's maximum, full luminance or that of its intensity limit: the panel is at the maximum, its
    /// L2A too low.
    Top,
    /// The wanted luminance is below the shortest pulse: the panel is at that pulse, its L2A too high but not above 4.
    Floor,
    /// The shortest pulse would exceed an L2A of 4 or the intensity limit: the panel is dark.
    Off,
}

/// The faults of a transmitter, a set. Bits that this version does not know are kept.
///
/// ```
/// use link::serial::Faults;
/// let mut faults = Faults::empty();
/// faults.set(Faults::SENSOR_STUCK, true);
/// faults.set(Faults::NO_TABLE, true);
/// assert!(faults.contains(Faults::SENSOR_STUCK));
/// let names = faults.iter_names().map(|(name, _)| name);
/// assert!(names.eq(["SENSOR_STUCK", "NO_TABLE"]));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
pub struct Faults(u16);

bitflags! {
    impl Faults: u16 {
        /// The light sensor does not answer.
        const SENSOR_MISSING = 1 << 0;
        /// The light sensor returns the same value in all its ranges.
        const SENSOR_STUCK = 1 << 1;
        /// The light sensor is saturated, and no other range confirms it.
        const SENSOR_SATURATED = 1 << 2;
        /// The light sensor is no longer polled.
        const SENSOR_SILENT = 1 << 3;
        /// The LEDs did not accept the last panel or duty.
        const LEDS = 1 << 4;
        /// The flash memory failed, or its content was damaged.
        const STORE = 1 << 5;
        /// No table was ever stored: the shipped one is in use.
        const NO_TABLE = 1 << 6;
        /// No calibration was ever stored: the board's typical values are in use.
        const NO_CALIBRATION = 1 << 7;
        /// The watchdog restarted the transmitter.
        const WATCHDOG = 1 << 8;
        /// The supply voltage fell, and the transmitter restarted: for boards that can distinguish this from a power-up.
        const BROWN_OUT = 1 << 9;
    }
}

/// The names, with a space after each, or `none`.
#[cfg(feature = "defmt")]
impl defmt::Format for Faults {
    fn format(&self, formatter: defmt::Formatter<'_>) {
        if self.is_empty() {
            defmt::write!(formatter, "none");
        }
        for (name, _) in self.iter_names() {
            defmt::write!(formatter, "{=str} ", name);
        }
    }
}

/// The status with the most bytes.
#[cfg(test)]
pub fn greatest() -> Status {
    Status {
        uptime_s: u32::MAX,
        light: Light::Lost,
        illuminance_lx: Some(Illuminance::MAX),
        l2a: L2a::MAX,
        luminance_cd_m2: U32F32::MAX,
        duty: U0F32::MAX,
        limited: Some(Limit::Off),
        faults: Faults::from_bits_retain(u16::MAX),
        table_crc: u32::MAX,
        sending: true,
        counters: Counters {
            frames: u32::MAX,
            bad_frames: u32::MAX,
            refusals: u32::MAX,
            symbols: u32::MAX,
            lost_symbols: u32::MAX,
            readings: u32::MAX,
            missed_readings: u32::MAX,
        },
    }
}
