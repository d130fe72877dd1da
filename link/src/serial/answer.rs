//! A transmitter's answers.

use core::fmt;

use super::{BodyError, Measured, Status, VERSION};
use crate::symbol_rate::{Outside, SymbolRate};
use crate::waveform::Waveform;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An answer; it carries the sequence number of its request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Answer<'a> {
    /// The request was not done, and nothing changed.
    Refused(Refusal),
    /// Who is here.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// How the transmitter is.
    Status(Status),
    /// A part of the running table.
    Table(TablePart<'a>),
    /// The bytes of the new table that have arrived.
    Staged {
        /// Bytes from its beginning without a gap.
        received: u16,
    },
    /// This table is stored and in use.
    Committed {
        /// CRC-32C of its image.
        crc: u32,
    },
    /// What was measured of the panel.
    Calibration(Measured),
    /// It is done.
    Done,
    /// How often the panel changes.
    SymbolRate {
        /// Thousandths of a symbol a second.
        millihertz: u32,
    },
    /// How bright the panel may be; both numbers 0: as bright as it can.
    IntensityLimit {
        /// The most luminous intensity, 1/1000 cd.
        most_mcd: u32,
        /// The diameter of an LED, µm.
        led_diameter_um: u32,
    },
    /// How often the panel changes, and how each symbol is shown.
    Carrier {
        /// Thousandths of a symbol a second.
        millihertz: u32,
        /// Cycles of the carrier a symbol; 0: panels stand still.
        cycles: u16,
    },
    /// Which key signs messages.
    Key {
        /// Its name, [`KeyId`](crate::framing::KeyId), as a number whose most significant byte is the first; none: messages are not signed.
        id: Option<u32>,
        /// The counter of its next signature, or, after a restart, a greater one; 0 without a key.
        counter: u32,
    },
}

/// Who a transmitter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello<'a> {
    /// [`SCHEMA`](super::SCHEMA) of its messages.
    pub schema: u32,
    /// Version of its firmware, up to 32 bytes.
    pub firmware: &'a str,
    /// Name of its board, up to 32 bytes.
    pub board: &'a str,
    /// Most bytes of a table that it takes in one frame.
    pub chunk_max: u16,
    /// Most bytes of a message that it takes.
    pub message_max: u16,
}

/// A part of the running table's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TablePart<'a> {
    /// Bytes of the whole image.
    pub length: u16,
    /// CRC-32C of the whole image.
    pub crc: u32,
    /// Where in the image the part begins.
    pub offset: u16,
    /// Its bytes; none at the end.
    pub bytes: &'a [u8],
}

/// Why a transmitter did not do what was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, thiserror::Error)]
pub enum Refusal {
    /// The request is of another version of the protocol; the answer's frame names its own.
    #[error("the transmitter speaks protocol {speaks}: use a program that does, or update it")]
    Version {
        /// The version it speaks.
        speaks: u8,
    },
    /// The request is whole, and no message of this version.
    #[error("the transmitter does not know this request: update the older side")]
    Unknown,
    /// A table of that length there cannot be.
    #[error("a table of {length} bytes is impossible, the most is {most}")]
    TableLength {
        /// The length announced.
        length: u16,
        /// The most possible.
        most: u16,
    },
    /// No table was announced, or it was dropped or taken since.
    #[error("no table is being written: begin again")]
    NotBegun,
    /// A part does not join on to those before it, or reaches beyond the table's end.
    #[error("the transmitter expects the table from byte {expected} on: go on there")]
    Offset {
        /// The first byte that is missing.
        expected: u16,
    },
    /// Parts of the table are missing.
    #[error("{received} of the table's {length} bytes have come: send the rest")]
    Incomplete {
        /// Bytes received.
        received: u16,
        /// Bytes announced.
        length: u16,
    },
    /// The table that came is not the one that was announced.
    #[error("the table has CRC {found:08x}, {expected:08x} was announced: begin again")]
    TableCrc {
        /// CRC-32C of what came.
        found: u32,
        /// CRC-32C announced.
        expected: u32,
    },
    /// The numbers are no table.
    #[error("the numbers are no table of L2A: check the file")]
    TableInvalid,
    /// The flash memory did not take it.
    #[error("the transmitter's flash memory failed: the old values stay in use")]
    Store,
    /// A measured value is out of its range.
    #[error(
        "{} is out of its range",
        Self::CALIBRATION.get(usize::from(*.value)).copied().unwrap_or("a measured value")
    )]
    Calibration {
        /// Its place in [`Measured`], from 0.
        value: u8,
    },
    /// A message is empty or too long.
    #[error("a message of {length} bytes is impossible, 1 to {most} are possible")]
    MessageLength {
        /// Its length.
        length: u16,
        /// The most possible.
        most: u16,
    },
    /// The transmitter cannot show that symbol rate.
    #[error("{}", NoSymbolRate(*.millihertz, [*.least, *.most]))]
    SymbolRate {
        /// The rate asked for, in thousandths of a symbol a second.
        millihertz: u32,
        /// The least that it can show.
        least: u32,
        /// The most that it can show.
        most: u32,
    },
    /// There can be no such limit of the luminous intensity.
    #[error(
        "an intensity limit of {} cd for LEDs of {} m is impossible: give 0.001 to 1000000 cd and 0.0001 to 1 m",
        f64::from(*.most_mcd) / 1e3, f64::from(*.led_diameter_um) / 1e6
    )]
    IntensityLimit {
        /// The most intensity asked for, 1/1000 cd.
        most_mcd: u32,
        /// The diameter of an LED, µm.
        led_diameter_um: u32,
    },
    /// There can be no such carrier.
    #[error("{}", NoCarrier(*.millihertz, *.cycles))]
    Carrier {
        /// The symbol rate asked for, in thousandths of a symbol a second.
        millihertz: u32,
        /// The cycles a symbol asked for.
        cycles: u16,
    },
    /// These LEDs show no carrier.
    #[error("its LEDs show no carrier, for they are lit row by row and not latched all at once (MAX7219): give 0 cycles for still panels")]
    NoLatch,
    /// This firmware does not sign.
    #[error("its firmware signs no messages: flash one that was built with the feature `signing`")]
    NoSigning,
    /// These bytes are no key.
    #[error("a key's seed has 32 bytes, not all of them zero: make one with `vocc keys new`")]
    Seed,
    /// The counter of the key's signatures is at its end.
    #[error("its key has no counter left to sign with, and nothing was changed: give it a new key (`vocc device key`)")]
    NoCounter,
}

/// What is said of a carrier that a transmitter refuses: thousandths of a symbol a second, and cycles a symbol.
struct NoCarrier(u32, u16);

impl fmt::Display for NoCarrier {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Self(millihertz, cycles) = self;
        let symbols_hz = f64::from(millihertz) / 1e3;
        match Waveform::new(cycles.into()).and_then(|waveform| waveform.carrier_hz(symbols_hz)) {
            Err(error) => error.fmt(formatter),
            // Its firmware has another range.
            Ok(carrier_hz) => write!(
                formatter,
                "{cycles} cycles a symbol at {symbols_hz} symbols a second are a carrier of {carrier_hz} Hz, which it cannot show: give other \
                 cycles or another rate, or 0 cycles for still panels"
            ),
        }
    }
}

/// What is said of a symbol rate that a transmitter refuses.
struct NoSymbolRate(u32, [u32; 2]);

impl fmt::Display for NoSymbolRate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Self(millihertz, [least, most]) = self;
        if least <= SymbolRate::MIN.millihertz() && most >= SymbolRate::MAX.millihertz() {
            return Outside(millihertz, least..=most).fmt(formatter);
        }
        let [asked, least, most] = [millihertz, least, most].map(|millihertz| f64::from(millihertz) / 1e3);
        write!(
            formatter,
            "{asked} symbols a second are outside {least} to {most}, which the carrier in use allows: give a rate in that range, or set rate and \
             cycles together (`--carrier-cycles`)"
        )
    }
}

impl From<BodyError> for Refusal {
    fn from(error: BodyError) -> Self {
        match error {
            BodyError::Version { .. } => Self::Version { speaks: VERSION },
            BodyError::OtherKind | BodyError::Malformed => Self::Unknown,
        }
    }
}

impl Refusal {
    /// The values of [`Measured`], in their order.
    pub const CALIBRATION: [&'static str; 7] = [
        "luminance_full_cd_m2",
        "shortest_pulse_ns",
        "pwm_period_ns",
        "reflectance",
        "interval",
        "sensor_gain",
        "low_current_share",
    ];
}
