//! A computer's requests to a transmitter.

use core::fmt;

use super::Measured;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The seed of a signing key. It is not printed.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Seed<'a>(#[serde(borrow)] pub &'a [u8]);

impl fmt::Debug for Seed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Seed({} bytes)", self.0.len())
    }
}

/// A request. All requests are idempotent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub enum Request<'a> {
    /// Identification. Answered by [`Answer::Hello`](super::Answer::Hello).
    Hello,
    /// Answered by [`Answer::Status`](super::Answer::Status).
    Status,
    /// A part of the running table's image. Answered by [`Answer::Table`](super::Answer::Table).
    ReadTable {
        /// The first byte of the part.
        offset: u16,
    },
    /// Announces a new table, and drops the received part of another. Answered by [`Answer::Staged`](super::Answer::Staged).
    BeginTable {
        /// Bytes of its image: up to [`IMAGE_MAX`](crate::l2a_table::image::IMAGE_MAX).
        length: u16,
        /// CRC-32C of its image.
        crc: u32,
    },
    /// A part of it: the next one, or a received one again. Answered by [`Answer::Staged`](super::Answer::Staged).
    WriteTable {
        /// The part's position in the image.
        offset: u16,
        /// Its bytes: up to [`CHUNK_MAX`](super::CHUNK_MAX).
        bytes: &'a [u8],
    },
    /// Checks, stores and uses the new table. Answered by [`Answer::Committed`](super::Answer::Committed).
    CommitTable {
        /// CRC-32C of its image.
        crc: u32,
    },
    /// Drops the received part of a new table; the running one stays. Answered by [`Answer::Done`](super::Answer::Done).
    RollBackTable,
    /// Answered by [`Answer::Calibration`](super::Answer::Calibration).
    ReadCalibration,
    /// Checks, stores and uses these measured values. Answered by [`Answer::Done`](super::Answer::Done).
    WriteCalibration(Measured),
    /// Shows this message from the next symbol on. Answered by [`Answer::Done`](super::Answer::Done).
    ///
    /// The sequence number of the frame identifies the message: the same number again counts as a request whose answer was lost.
    Send {
        /// The number of repeats; `None`: until another message comes.
        repeats: Option<u32>,
        /// 1 to 1024 bytes.
        message: &'a [u8],
    },
    /// Shows beacons from the next symbol on. Answered by [`Answer::Done`](super::Answer::Done).
    StopSending,
    /// Resets the counters. Answered by [`Answer::Done`](super::Answer::Done).
    ResetCounters,
    /// Answered by [`Answer::SymbolRate`](super::Answer::SymbolRate). Added later: an older transmitter refuses it as unknown.
    ReadSymbolRate,
    /// Checks, stores and uses this symbol rate, from the next change of symbols on. Answered by
    /// [`Answer::SymbolRate`](super::Answer::SymbolRate). Added later: an older transmitter refuses it as unknown.
    WriteSymbolRate {
        /// Thousandths of a symbol a second, see [`SymbolRate`](crate::symbol_rate::SymbolRate).
        millihertz: u32,
    },
    /// Answered by [`Answer::IntensityLimit`](super::Answer::IntensityLimit). Added later: an older transmitter refuses it as unknown.
    ReadIntensityLimit,
    /// Checks, stores and uses this limit of the panel's luminous intensity; both numbers 0: none. Answered by
    /// [`Answer::IntensityLimit`](super::Answer::IntensityLimit). Added later: an older transmitter refuses it as unknown.
    WriteIntensityLimit {
        /// The greatest intensity, 1/1000 cd, see [`IntensityLimit`](crate::intensity::IntensityLimit).
        most_mcd: u32,
        /// The diameter of an LED, µm.
        led_diameter_um: u32,
    },
    /// Answered by [`Answer::Carrier`](super::Answer::Carrier). Added later: an older transmitter refuses it as unknown.
    ReadCarrier,
    /// Checks, stores and uses this symbol rate with this carrier. A change from or to a carrier stops the clock for about 35 µs: the
    /// current symbol loses at most half a cycle, or, if it is still, starts again. Answered by
    /// [`Answer::Carrier`](super::Answer::Carrier). Added later: an older transmitter refuses it as unknown.
    WriteCarrier {
        /// Thousandths of a symbol a second, see [`SymbolRate`](crate::symbol_rate::SymbolRate).
        millihertz: u32,
        /// Cycles of the carrier a symbol, see [`Waveform`](crate::waveform::Waveform); 0: still panels.
        cycles: u16,
    },
    /// The signing key. Answered by [`Answer::Key`](super::Answer::Key). Added later: an older transmitter refuses it as unknown.
    ReadKey,
    /// Checks, stores and uses this key: messages sent from now on are signed. Every trace of the key before it is erased. No request reads
    /// it back. Answered by [`Answer::Key`](super::Answer::Key). Added later: an older transmitter refuses it as unknown.
    WriteKey {
        /// 32 bytes, not all zero.
        #[serde(borrow)]
        seed: Seed<'a>,
        /// The counter of its first signature; if the key is already stored, the greater of both counters.
        counter: u32,
    },
    /// Erases every trace of the key: messages sent from now on are not signed. Answered by [`Answer::Key`](super::Answer::Key). Added
    /// later: an older transmitter refuses it as unknown.
    EraseKey,
    /// Shows this panel instead of messages, no brighter than they are; they continue after it where they stopped. Meanwhile the light
    /// sensor is read in its two ranges alternately. Answered by [`Answer::Done`](super::Answer::Done). Added later: an older transmitter
    /// refuses it as unknown.
    TestPanel {
        /// Bit 8·row + column is On; at most [`TEST_LEDS_MAX`](super::TEST_LEDS_MAX) of them, so that no test is brighter than a message.
        bits: u64,
        /// Its light relative to that of a message, in 1/255.
        share: u8,
        /// Its duration, ms, unless another test panel comes first; 0 ends a test at once.
        time_ms: u16,
    },
    /// Requests the last reading of the light sensor in each of its ranges. Answered by [`Answer::Sensor`](super::Answer::Sensor). Added
    /// later: an older transmitter refuses it as unknown.
    ReadSensor,
    /// The lock of the port. Answered by [`Answer::Lock`](super::Answer::Lock). Added later: an older transmitter refuses it as unknown.
    ReadLock,
    /// Locks the ports: from now on each request that [changes something](Self::changes) needs a [permit](Self::Permit). Answered by
    /// [`Answer::Lock`](super::Answer::Lock). Added later: an older transmitter refuses it as unknown.
    WriteLock {
        /// 32 bytes: the public key that verifies permits.
        key: &'a [u8],
        /// A random salt from which, with the PIN, the private key is derived.
        salt: u64,
    },
    /// Removes the lock. Answered by [`Answer::Lock`](super::Answer::Lock). Added later: an older transmitter refuses it as unknown.
    RemoveLock,
    /// Permits the next request at this port that changes something. Answered by [`Answer::Done`](super::Answer::Done), whether or not the
    /// signature is right: it is verified with that request. Added later: an older transmitter refuses it as unknown.
    Permit {
        /// The challenge, by [`Answer::Lock`](super::Answer::Lock).
        challenge: u32,
        /// 64 bytes: a signature over the challenge and that request.
        signature: &'a [u8],
    },
    /// Requests the hash of the program that runs. Answered by [`Answer::ProgramHash`](super::Answer::ProgramHash). Added later: an older
    /// transmitter refuses it as unknown, and so does one that cannot read its program.
    ReadProgramHash,
}

impl Request<'_> {
    /// Whether it changes something at the transmitter, so that a locked one needs a permit for it.
    pub const fn changes(&self) -> bool {
        match self {
            Self::Hello
            | Self::Status
            | Self::ReadTable { .. }
            | Self::ReadCalibration
            | Self::ReadSymbolRate
            | Self::ReadIntensityLimit
            | Self::ReadCarrier
            | Self::ReadKey
            | Self::ReadSensor
            | Self::ReadLock
            | Self::ReadProgramHash
            | Self::Permit { .. } => false,
            Self::BeginTable { .. }
            | Self::WriteTable { .. }
            | Self::CommitTable { .. }
            | Self::RollBackTable
            | Self::WriteCalibration(_)
            | Self::Send { .. }
            | Self::StopSending
            | Self::ResetCounters
            | Self::WriteSymbolRate { .. }
            | Self::WriteIntensityLimit { .. }
            | Self::WriteCarrier { .. }
            | Self::WriteKey { .. }
            | Self::EraseKey
            | Self::TestPanel { .. }
            | Self::WriteLock { .. }
            | Self::RemoveLock => true,
        }
    }
}
