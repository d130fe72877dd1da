//! Encodes bodies as frames and as bytes on the wire, and decodes them.

use core::fmt;

use super::{Answer, CHUNK_MAX, Request, VERSION};
use crate::checksum::crc32c;
use crate::framing::MESSAGE_MAX;
use cobs::{CobsEncoder, DecodeResult, DecoderState};
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

/// Version, kind, sequence number.
const HEADER: usize = 6;
const CRC: usize = 4;
/// Bytes of a frame besides its body: 6 before it, 4 after it.
pub const FRAME_OVERHEAD: usize = HEADER + CRC;
/// Bytes of the longest request's frame: [`Request::Send`] with 1024 bytes.
pub const REQUEST_FRAME_MAX: usize = FRAME_OVERHEAD + 9 + MESSAGE_MAX;
/// Bytes of the longest answer's frame: [`Answer::Table`] with [`CHUNK_MAX`] bytes.
pub const ANSWER_FRAME_MAX: usize = FRAME_OVERHEAD + 14 + CHUNK_MAX;

/// Bytes on the wire of a frame of `length`, at most: COBS adds one in 254, and a 0 precedes and follows it.
pub const fn wire_length(length: usize) -> usize {
    length + 1 + length / 254 + 2
}

/// The direction of a frame, so that an echo of a request does not count as an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// From the computer to the transmitter.
    Request = 1,
    /// From the transmitter to the computer.
    Answer = 2,
}

/// A message that does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the frame does not fit into {room} bytes: give wire_length of its length")]
pub struct EncodeError {
    /// The available bytes.
    pub room: usize,
}

/// Writes a [`Request`] or an [`Answer`] as a frame, ready for the wire, into `out`; returns the written part.
///
/// # Errors
///
/// [`EncodeError`] if `out` is too short; [`wire_length`] of [`REQUEST_FRAME_MAX`] or [`ANSWER_FRAME_MAX`] always suffices for messages
/// within their limits.
pub fn encode<'a>(kind: Kind, sequence: u32, message: &impl Serialize, out: &'a mut [u8]) -> Result<&'a [u8], EncodeError> {
    encode_version(VERSION, kind, sequence, message, out)
}

/// [`encode`] for another version of the protocol.
fn encode_version<'a>(
    version: u8,
    kind: Kind,
    sequence: u32,
    message: &impl Serialize,
    out: &'a mut [u8],
) -> Result<&'a [u8], EncodeError> {
    let too_short = EncodeError { room: out.len() };
    let inner = out.get_mut(1..).ok_or(too_short)?;
    let mut frame = OutgoingFrame {
        encoder: CobsEncoder::new(inner),
        digest: crate::checksum::digest(),
    };
    let written = frame
        .try_extend(&[version, kind as u8])
        .and_then(|()| frame.try_extend(&sequence.to_le_bytes()))
        .and_then(|()| postcard::serialize_with_flavor(message, frame))
        .map_err(|_| too_short)?;
    let whole = out.get_mut(..written + 2).ok_or(too_short)?;
    if let [first, .., last] = whole {
        (*first, *last) = (0, 0);
    }
    Ok(whole)
}

/// A frame on its way to the wire's buffer: each byte is added to the CRC and encoded at once.
struct OutgoingFrame<'a> {
    encoder: CobsEncoder<'a>,
    digest: crc::Digest<'static, u32, crc::NoTable>,
}

impl Flavor for OutgoingFrame<'_> {
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.digest.update(bytes);
        self.encoder.push(bytes).map_err(|_| postcard::Error::SerializeBufferFull)
    }

    fn finalize(mut self) -> postcard::Result<usize> {
        let crc = self.digest.finalize().to_le_bytes();
        self.encoder.push(&crc).map_err(|_| postcard::Error::SerializeBufferFull)?;
        Ok(self.encoder.finalize())
    }
}

/// Why bytes between two zeros are not a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// Bytes are missing: its lengths do not match.
    #[error("a frame was cut short: send it again")]
    Truncated,
    /// It is longer than any frame.
    #[error("a frame has more than {most} bytes: send less at once")]
    TooLong {
        /// The reader's limit.
        most: usize,
    },
    /// Its bytes were corrupted.
    #[error("a frame has CRC {found:08x} and should have {expected:08x}: send it again")]
    Crc {
        /// The CRC at its end.
        found: u32,
        /// The CRC of its bytes.
        expected: u32,
    },
}

/// An intact frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    version: u8,
    kind: u8,
    sequence: u32,
    body: &'a [u8],
}

/// Why the body of a frame cannot be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BodyError {
    /// It has the other direction.
    #[error("the frame has the wrong direction: this is an echo, or two computers are connected")]
    OtherKind,
    /// It has another version.
    #[error("the frame is of protocol {version}, and this side uses {VERSION}: update the older side")]
    Version {
        /// The version of the frame.
        version: u8,
    },
    /// It is not a message of this version.
    #[error("the frame holds no message of protocol {VERSION}: update the older side")]
    Malformed,
}

/// Without its body, which may hold a key.
impl fmt::Debug for Frame<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            version,
            kind,
            sequence,
            body,
        } = self;
        write!(f, "Frame(version {version}, kind {kind}, number {sequence}, {} bytes)", body.len())
    }
}

impl<'a> Frame<'a> {
    /// Parses bytes after COBS decoding.
    fn parse(bytes: &'a [u8]) -> Result<Self, FrameError> {
        let (content, crc) = bytes.split_last_chunk().ok_or(FrameError::Truncated)?;
        let (&[version, kind, s0, s1, s2, s3], body) = content.split_first_chunk().ok_or(FrameError::Truncated)?;
        let (found, expected) = (u32::from_le_bytes(*crc), crc32c(&[content]));
        if found == expected {
            let sequence = u32::from_le_bytes([s0, s1, s2, s3]);
            Ok(Self {
                version,
                kind,
                sequence,
                body,
            })
        } else {
            Err(FrameError::Crc { found, expected })
        }
    }

    /// The sender's version of the protocol.
    pub const fn version(&self) -> u8 {
        self.version
    }

    /// The number that an answer shares with its request.
    pub const fn sequence(&self) -> u32 {
        self.sequence
    }

    /// The bytes of the message in it.
    pub const fn body(&self) -> &'a [u8] {
        self.body
    }

    /// Whether it has that direction, in any version.
    pub const fn is(&self, kind: Kind) -> bool {
        self.kind == kind as u8
    }

    /// The request in it.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if it has the other direction or another version, or is not a request.
    pub fn request(&self) -> Result<Request<'a>, BodyError> {
        self.message(Kind::Request)
    }

    /// The answer in it.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if it has the other direction or another version, or is not an answer.
    pub fn answer(&self) -> Result<Answer<'a>, BodyError> {
        self.message(Kind::Answer)
    }

    /// The message in it, of any protocol that uses these frames.
    ///
    /// # Errors
    ///
    /// [`BodyError`] if it has the other direction or another version, or is not such a message.
    pub fn message<T: Deserialize<'a>>(&self, kind: Kind) -> Result<T, BodyError> {
        if !self.is(kind) {
            return Err(BodyError::OtherKind);
        }
        if self.version != VERSION {
            return Err(BodyError::Version { version: self.version });
        }
        match postcard::take_from_bytes(self.body) {
            Ok((message, [])) => Ok(message),
            _ => Err(BodyError::Malformed),
        }
    }
}

/// Finds frames in a stream of bytes, one byte at a time, in a buffer of `MOST` bytes:
/// [`REQUEST_FRAME_MAX`] or [`ANSWER_FRAME_MAX`].
///
/// After any garbage it finds the next frame at the next 0.
pub struct FrameReader<const MOST: usize> {
    decoder: DecoderState,
    buffer: [u8; MOST],
    /// Bytes of the frame so far, including those beyond the buffer.
    length: usize,
}

impl<const MOST: usize> FrameReader<MOST> {
    /// A reader before its first byte; `const`, so that it can be a static.
    pub const fn new() -> Self {
        Self {
            decoder: DecoderState::Idle,
            buffer: [0; MOST],
            length: 0,
        }
    }

    /// Adds one byte. Returns a frame or an error at its end, and mostly `None`.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        match self.decoder.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.length = 0;
                None
            }
            Ok(DecodeResult::DataContinue(decoded)) => {
                if let Some(place) = self.buffer.get_mut(self.length) {
                    *place = decoded;
                }
                self.length = self.length.saturating_add(1);
                None
            }
            Ok(DecodeResult::DataComplete) => Some(
                self.buffer
                    .get(..self.length)
                    .ok_or(FrameError::TooLong { most: MOST })
                    .and_then(Frame::parse),
            ),
            Err(_) => Some(Err(FrameError::Truncated)),
        }
    }
}

/// Without the received bytes, which may hold a key.
impl<const MOST: usize> fmt::Debug for FrameReader<MOST> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FrameReader({} of {MOST} bytes)", self.length)
    }
}

impl<const MOST: usize> Default for FrameReader<MOST> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serial::{Hello, Measured, Refusal, SCHEMA, TablePart};
    use fixed::types::{U1F31, U12F20, U32F32};
    use properties::prelude::*;
    use std::vec::Vec;

    const GREATEST: Measured = Measured {
        luminance_full_cd_m2: U32F32::MAX,
        shortest_pulse_ns: u32::MAX,
        pwm_period_ns: u32::MAX,
        reflectance: U1F31::MAX,
        interval: crate::l2a_table::Interval::MAX,
        sensor_gain: U12F20::MAX,
        low_current_share: U1F31::MAX,
    };

    /// The results of a reader on these bytes: the sequence numbers of frames, and errors.
    fn read<const MOST: usize>(bytes: &[u8]) -> Vec<Result<u32, FrameError>> {
        let mut reader = FrameReader::<MOST>::new();
        let mut found = Vec::new();
        for &byte in bytes {
            if let Some(frame) = reader.push(byte) {
                found.push(frame.map(|frame| frame.sequence()));
            }
        }
        found
    }

    fn sent(kind: Kind, message: &impl Serialize) -> Vec<u8> {
        let mut place = [0; wire_length(REQUEST_FRAME_MAX)];
        encode(kind, 7, message, &mut place).expect("it fits").to_vec()
    }

    #[test]
    fn the_longest_request_fills_its_frame_exactly() {
        let request = Request::Send {
            repeats: Some(u32::MAX),
            message: &[0; MESSAGE_MAX],
        };
        let wire = sent(Kind::Request, &request);
        assert_eq!(read::<REQUEST_FRAME_MAX>(&wire), [Ok(7)]);
        let most = REQUEST_FRAME_MAX - 1;
        let shorter = read::<{ REQUEST_FRAME_MAX - 1 }>(&wire);
        assert_eq!(shorter, [Err(FrameError::TooLong { most })]);
    }

    #[test]
    fn the_longest_answers_fit() {
        let table = TablePart {
            length: u16::MAX,
            crc: u32::MAX,
            offset: u16::MAX,
            bytes: &[1; CHUNK_MAX],
        };
        let name = core::str::from_utf8(&[b'x'; 32]).expect("ASCII");
        let hello = Hello {
            schema: SCHEMA,
            firmware: name,
            board: name,
            chunk_max: u16::MAX,
            message_max: u16::MAX,
        };
        let refusal = Refusal::TableCrc {
            found: u32::MAX,
            expected: u32::MAX,
        };
        for answer in [
            Answer::Table(table),
            Answer::Hello(hello),
            Answer::Status(crate::serial::status::greatest()),
            Answer::Calibration(GREATEST),
            Answer::Refused(refusal),
        ] {
            assert_eq!(read::<ANSWER_FRAME_MAX>(&sent(Kind::Answer, &answer)), [Ok(7)], "{answer:?}");
        }
    }

    #[test]
    fn a_place_that_is_too_short_is_refused_whatever_its_length() {
        let whole = sent(Kind::Request, &Request::WriteCalibration(GREATEST));
        for room in 0..whole.len() {
            let mut place = std::vec![0; room];
            let outcome = encode(Kind::Request, 7, &Request::WriteCalibration(GREATEST), &mut place);
            assert_eq!(outcome, Err(EncodeError { room }));
        }
        let mut place = std::vec![0; whole.len()];
        assert!(encode(Kind::Request, 7, &Request::WriteCalibration(GREATEST), &mut place).is_ok());
    }

    #[test]
    fn bytes_behind_a_message_are_no_message() {
        // A status request with one byte more.
        let wire = sent(Kind::Request, &(1_u8, 0_u8));
        let mut reader = FrameReader::<REQUEST_FRAME_MAX>::new();
        let mut outcome = None;
        for &byte in &wire {
            if let Some(Ok(frame)) = reader.push(byte) {
                outcome = Some(frame.request() == Err(BodyError::Malformed));
            }
        }
        assert_eq!(outcome, Some(true));
    }

    properties! {
        #[test]
        fn a_frame_is_found_behind_any_garbage(garbage in prop::collection::vec(any::<u8>(), 0..1500), offset: u16) {
            let mut bytes = garbage;
            bytes.extend(sent(Kind::Request, &Request::ReadTable { offset }));
            let found = read::<REQUEST_FRAME_MAX>(&bytes);
            prop_assert_eq!(found.last(), Some(&Ok(7)));
        }

        #[test]
        fn one_changed_dropped_or_doubled_byte_is_never_read_as_a_frame(
            place: prop::sample::Index, change in 1_u8..=255, way in 0..3, bytes in prop::collection::vec(any::<u8>(), 1..128),
        ) {
            let mut wire = sent(Kind::Request, &Request::WriteTable { offset: 0, bytes: &bytes });
            // The zeros at the ends do not belong to the frame.
            let place = 1 + place.index(wire.len() - 2);
            match way {
                0 => wire[place] ^= change,
                1 => { wire.remove(place); }
                _ => wire.insert(place, wire[place]),
            }
            for outcome in read::<REQUEST_FRAME_MAX>(&wire) {
                prop_assert!(outcome.is_err());
            }
        }
    }
}
