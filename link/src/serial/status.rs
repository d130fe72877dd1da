//! How a transmitter is.

use crate::l2a_table::{Illuminance, L2a};
use fixed::types::{U0F32, U32F32};
use serde::{Deserialize, Serialize};

/// The state of a transmitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// Seconds since it started.
    pub uptime_s: u32,
    /// What it knows of the light.
    pub light: Light,
    /// The ambient illuminance it goes by, lx; none before the first reading.
    pub illuminance_lx: Option<Illuminance>,
    /// The L2A wanted; 0 while dark before the first reading.
    pub l2a: L2a,
    /// Luminance of an On LED, cd/m².
    pub luminance_cd_m2: U32F32,
    /// The same as a share of full luminance; the greatest number of its type stands for 1.
    pub duty: U0F32,
    /// Why the luminance is not the wanted one; none when it is.
    pub limited: Option<Limit>,
    /// What is wrong.
    pub faults: Faults,
    /// CRC-32C of the running table's image.
    pub table_crc: u32,
    /// Whether a message is being shown, not a beacon.
    pub sending: bool,
    /// What was counted.
    pub counters: Counters,
}

/// What is counted from the start, or from a reset of the counters; each stays at its greatest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames that arrived whole.
    pub frames: u32,
    /// Garbage between two zeros: frames cut short, too long or with a wrong CRC.
    pub bad_frames: u32,
    /// Requests refused.
    pub refusals: u32,
    /// Symbols shown.
    pub symbols: u32,
    /// Symbols lost on the way to the LEDs.
    pub lost_symbols: u32,
    /// Readings of the light sensor, saturated ones among them.
    pub readings: u32,
    /// Readings that did not come.
    pub missed_readings: u32,
}

/// What a transmitter knows of the light around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Light {
    /// Nothing yet: it has just started, and is dark.
    Unknown,
    /// The sensor reads.
    Measured,
    /// The sensor does not read just now: the last reading still counts.
    Held,
    /// Too bright for the sensor, at two of its settings.
    Daylight,
    /// Nothing any more: the luminance is a safe one.
    Lost,
}

/// What kept a panel from the wanted luminance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Limit {
    /// It is above full luminance: the panel is at full luminance, its L2A too low.
    Top,
    /// It is below the shortest pulse: the panel is at that pulse, its L2A too high but not above 4.
    Floor,
    /// It is so far below the shortest pulse that even this would be above an L2A of 4: the panel is dark.
    Off,
}

/// What is wrong with a transmitter: a set.
///
/// ```
/// use link::serial::Faults;
/// let mut faults = Faults::NONE;
/// faults.set(Faults::SENSOR_STUCK, true);
/// faults.set(Faults::NO_TABLE, true);
/// assert!(faults.contains(Faults::SENSOR_STUCK));
/// assert!(faults.names().eq(["sensor_stuck", "no_table"]));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Faults(pub u16);

impl Faults {
    /// Nothing is wrong.
    pub const NONE: Self = Self(0);
    /// The light sensor does not answer.
    pub const SENSOR_MISSING: Self = Self(1 << 0);
    /// The light sensor answers the same, whatever its setting.
    pub const SENSOR_STUCK: Self = Self(1 << 1);
    /// The light sensor is saturated, and no other setting confirms it.
    pub const SENSOR_SATURATED: Self = Self(1 << 2);
    /// Nobody asks the light sensor any more.
    pub const SENSOR_SILENT: Self = Self(1 << 3);
    /// The LEDs did not take the last panel or duty.
    pub const LEDS: Self = Self(1 << 4);
    /// The flash memory failed, or what it held was damaged.
    pub const STORE: Self = Self(1 << 5);
    /// No table was ever stored: the one it shipped with is in use.
    pub const NO_TABLE: Self = Self(1 << 6);
    /// No calibration was ever stored: the board's typical values are in use.
    pub const NO_CALIBRATION: Self = Self(1 << 7);
    /// The watchdog restarted the transmitter.
    pub const WATCHDOG: Self = Self(1 << 8);
    /// The supply voltage fell, and the transmitter restarted.
    pub const BROWN_OUT: Self = Self(1 << 9);

    const NAMES: [&'static str; 10] = [
        "sensor_missing",
        "sensor_stuck",
        "sensor_saturated",
        "sensor_silent",
        "leds",
        "store",
        "no_table",
        "no_calibration",
        "watchdog",
        "brown_out",
    ];

    /// Whether all faults of `other` are among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Both sets together.
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Puts the faults of `other` in, or takes them out.
    pub const fn set(&mut self, other: Self, present: bool) {
        if present {
            self.0 |= other.0;
        } else {
            self.0 &= !other.0;
        }
    }

    /// The names of those that are present and known to this version.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let named = Self::NAMES.into_iter().enumerate();
        named.filter_map(move |(bit, name)| self.contains(Self(1 << bit)).then_some(name))
    }
}

/// The status that takes the most bytes.
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
        faults: Faults(u16::MAX),
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
