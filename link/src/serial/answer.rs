//! A transmitter's answers.

use core::fmt;

use super::{BodyError, Measured, Status, VERSION};
use crate::l2a_table::Illuminance;
use crate::symbol_rate::{Outside, SymbolRate};
use crate::waveform::Waveform;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An answer; it carries the sequence number of its request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Answer<'a> {
    /// The request failed, and nothing changed.
    Refused(Refusal),
    /// Identification.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// The transmitter's state.
    Status(Status),
    /// A part of the running table.
    Table(TablePart<'a>),
    /// The received part of the new table.
    Staged {
        /// Bytes from its start without a gap.
        received: u16,
    },
    /// This table is stored and in use.
    Committed {
        /// CRC-32C of its image.
        crc: u32,
    },
    /// The measured values of the panel.
    Calibration(Measured),
    /// The request succeeded.
    Done,
    /// The symbol rate.
    SymbolRate {
        /// Thousandths of a symbol a second.
        millihertz: u32,
    },
    /// The limit of the panel's luminous intensity; both numbers 0: no limit.
    IntensityLimit {
        /// The greatest luminous intensity, 1/1000 cd.
        most_mcd: u32,
        /// The diameter of an LED, µm.
        led_diameter_um: u32,
    },
    /// The symbol rate and the carrier.
    Carrier {
        /// Thousandths of a symbol a second.
        millihertz: u32,
        /// Cycles of the carrier a symbol; 0: still panels.
        cycles: u16,
    },
    /// The key that signs messages.
    Key {
        /// Its name, [`KeyId`](crate::framing::KeyId), as a number whose most significant byte is the first; `None`: messages are not
        /// signed.
        id: Option<u32>,
        /// The counter of its next signature, or, after a restart, a greater one; 0 without a key.
        counter: u32,
    },
    /// The last readings of the light sensor.
    Sensor {
        /// In the range that suits most light.
        operating: SensorReading,
        /// In the other one.
        cross_check: SensorReading,
    },
    /// The lock of the ports.
    Lock {
        /// The salt from which, with the PIN, the lock's key is derived; `None`: the ports are open.
        salt: Option<u64>,
        /// The number that the next permit must contain; 0 without a lock.
        challenge: u32,
        /// Seconds until the next permit is verified.
        wait_s: u16,
    },
    /// The program that runs, as it is in the flash memory.
    ProgramHash {
        /// Its bytes, without the store's.
        length: u32,
        /// 32 bytes: the SHA-256 of them.
        sha256: &'a [u8],
    },
}

/// The last reading of a light sensor in one of its ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorReading {
    /// It was not read in this range yet.
    None,
    /// It did not answer.
    Missing,
    /// There was too much light for this range.
    Saturated,
    /// An illuminance, before the sensor's gain.
    Light(#[cfg_attr(feature = "defmt", defmt(Display2Format))] Illuminance),
}

/// The identity of a transmitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Hello<'a> {
    /// [`SCHEMA`](super::SCHEMA) of its messages.
    pub schema: u32,
    /// Version of its firmware, up to 32 bytes.
    pub firmware: &'a str,
    /// Name of its board, up to 32 bytes.
    pub board: &'a str,
    /// Greatest number of bytes of a table in one frame.
    pub chunk_max: u16,
    /// Greatest number of bytes of a message.
    pub message_max: u16,
}

/// A part of the running table's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct TablePart<'a> {
    /// Bytes of the whole image.
    pub length: u16,
    /// CRC-32C of the whole image.
    pub crc: u32,
    /// The part's position in the image.
    pub offset: u16,
    /// Its bytes; none at the end.
    pub bytes: &'a [u8],
}

/// Why a transmitter refused a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The request has another version of the protocol; the answer's frame holds the transmitter's.
    #[error("the transmitter uses protocol {speaks}: use a program with that protocol, or update it")]
    Version {
        /// The transmitter's version.
        speaks: u8,
    },
    /// The request is whole but unknown in this version.
    #[error("the transmitter does not know this request: update the older side")]
    Unknown,
    /// No table has that length.
    #[error("a table has at most {most} bytes, not {length}")]
    TableLength {
        /// The announced length.
        length: u16,
        /// The maximum.
        most: u16,
    },
    /// No table was announced, or it was dropped or committed since.
    #[error("no table is being written: begin again")]
    NotBegun,
    /// A part does not continue the earlier ones, or reaches beyond the table's end.
    #[error("the transmitter expects the table from byte {expected} on: continue there")]
    Offset {
        /// The first missing byte.
        expected: u16,
    },
    /// Parts of the table are missing.
    #[error("{received} of the table's {length} bytes have arrived: send the rest")]
    Incomplete {
        /// Bytes received.
        received: u16,
        /// Bytes announced.
        length: u16,
    },
    /// The received table is not the announced one.
    #[error("the table has CRC {found:08x}, {expected:08x} was announced: begin again")]
    TableCrc {
        /// CRC-32C of the received table.
        found: u32,
        /// The announced CRC-32C.
        expected: u32,
    },
    /// The numbers do not make a table.
    #[error("the table's numbers are invalid: check the file")]
    TableInvalid,
    /// Writing to flash memory failed.
    #[error("the transmitter's flash memory failed: the old values stay in use")]
    Store,
    /// A measured value is out of its range.
    #[error(
        "{} is out of its range",
        Self::CALIBRATION.get(usize::from(*.value)).copied().unwrap_or("a measured value")
    )]
    Calibration {
        /// Its position in [`Measured`], from 0.
        value: u8,
    },
    /// A message is empty or too long.
    #[error("the message has {length} bytes: give 1 to {most}")]
    MessageLength {
        /// Its length.
        length: u16,
        /// The maximum.
        most: u16,
    },
    /// The transmitter cannot show that symbol rate.
    #[error("{}", NoSymbolRate(*.millihertz, [*.least, *.most]))]
    SymbolRate {
        /// The requested rate, in thousandths of a symbol a second.
        millihertz: u32,
        /// The least possible rate.
        least: u32,
        /// The greatest possible rate.
        most: u32,
    },
    /// The limit of the luminous intensity is out of range.
    #[error(
        "an intensity limit of {} cd for LEDs of {} m is impossible: give 0.001 to 1000000 cd and 0.0001 to 1 m",
        f64::from(*.most_mcd) / 1e3, f64::from(*.led_diameter_um) / 1e6
    )]
    IntensityLimit {
        /// The requested intensity, 1/1000 cd.
        most_mcd: u32,
        /// The diameter of an LED, µm.
        led_diameter_um: u32,
    },
    /// The carrier is out of range.
    #[error("{}", NoCarrier(*.millihertz, *.cycles))]
    Carrier {
        /// The requested symbol rate, in thousandths of a symbol a second.
        millihertz: u32,
        /// The requested cycles a symbol.
        cycles: u16,
    },
    /// The LEDs' driver cannot show a carrier.
    #[error(
        "it cannot show a carrier, because its LEDs are lit row by row (MAX7219) or its timer latches too slowly: give 0 cycles for still panels"
    )]
    NoLatch,
    /// This firmware cannot sign.
    #[error("its firmware signs no messages: flash one that was built with the feature `signing`")]
    NoSigning,
    /// The bytes are not a key.
    #[error("a key's seed has 32 bytes, not all of them zero: make one with `vocc keys new`")]
    Seed,
    /// The counter of the key's signatures is exhausted.
    #[error("its key has used all its counters, and nothing was changed: give it a new key (`vocc device key`)")]
    NoCounter,
    /// A test panel would be brighter than a message.
    #[error("the test panel has {on} LEDs On, and at most {most} are allowed: show the others in another panel")]
    TestPanel {
        /// LEDs that are On.
        on: u8,
        /// The most possible.
        most: u8,
    },
    /// The ports are locked, and the request has no permit, or one for an earlier challenge.
    #[error("it is locked, and nothing was changed: give its PIN with --pin-file, or at a terminal")]
    Locked,
    /// The permit's signature is not that of the lock's key.
    #[error("the PIN is wrong, and nothing was changed{}: try again, or see docs/serial.md if it is lost", After(*.wait_s))]
    WrongPermit {
        /// Seconds until the next permit is verified.
        wait_s: u16,
    },
    /// Too many permits were wrong.
    #[error("too many wrong PINs were tried, and nothing was changed: try again in {wait_s} s, without a restart until then")]
    Wait {
        /// Seconds until the next permit is verified.
        wait_s: u16,
    },
    /// This firmware has no lock.
    #[error("its firmware has no lock: flash one that was built with the feature `signing`")]
    NoLock,
    /// The bytes are not a key of a lock.
    #[error("a lock needs a public key of 32 bytes on the curve: lock it with `vocc device lock`")]
    LockKey,
}

/// The wait before the next try.
struct After(u16);

impl fmt::Display for After {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => Ok(()),
            wait_s => write!(formatter, "; it accepts the next one in {wait_s} s"),
        }
    }
}

/// The error text for a refused carrier: thousandths of a symbol a second, and cycles a symbol.
struct NoCarrier(u32, u16);

impl fmt::Display for NoCarrier {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let &Self(millihertz, cycles) = self;
        let symbols_hz = f64::from(millihertz) / 1e3;
        match Waveform::new(cycles.into()).and_then(|waveform| waveform.carrier_hz(symbols_hz)) {
            Err(error) => error.fmt(formatter),
            // The transmitter's firmware may have another range.
            Ok(carrier_hz) => write!(
                formatter,
                "{cycles} cycles a symbol at {symbols_hz} symbols a second are a carrier of {carrier_hz} Hz, which it cannot show: give other \
                 cycles or another rate, or 0 cycles for still panels"
            ),
        }
    }
}

/// The error text for a refused symbol rate.
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
