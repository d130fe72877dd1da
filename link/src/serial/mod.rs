//! The messages of the transmitter's serial port: a computer's requests and the transmitter's answers.
//!
//! # The layers
//!
//! ```text
//!   Request, Answer            the content                        request, answer, status, calibration
//!      │   postcard: each field one after another, integers as varints
//!   body
//!      │   version, kind, sequence number before it; CRC-32C of all behind it
//!   frame                      whole or not at all                frame
//!      │   COBS: no byte is 0
//!   0 … 0                      on the wire, found again after any garbage
//! ```
//!
//! `docs/serial.md` describes it byte by byte, with test vectors that a test compares with this code.
//!
//! # The conversation
//!
//! The transmitter answers each request once and sends nothing by itself. An answer carries the sequence number of its request. A frame
//! that does not arrive whole is ignored and gets no answer. **If no answer comes, send the same frame again.** That is safe, because all
//! requests are idempotent. (Showing a message would not be. The transmitter therefore remembers the number of the last message, and
//! answers the same number without showing it again.)
//!
//! # Choosing
//!
//! * A transmitter passes its bytes to `tx_firmware::service`, which does all of this.
//! * A computer encodes with [`encode`], reads with a [`FrameReader`] of [`ANSWER_FRAME_MAX`] bytes and
//!   [`Frame::answer`].
//!
//! ```
//! use link::serial::{Answer, FrameReader, Kind, REQUEST_FRAME_MAX, Request, encode};
//! let mut wire = [0; 32];
//! let sent = encode(Kind::Request, 7, &Request::ReadTable { offset: 128 }, &mut wire)?;
//!
//! let mut reader = FrameReader::<REQUEST_FRAME_MAX>::new();
//! let noise = b"login: ";
//! let mut received = None;
//! for &byte in noise.iter().chain(sent) {
//!     if let Some(Ok(frame)) = reader.push(byte) {
//!         received = Some((frame.sequence(), frame.request() == Ok(Request::ReadTable { offset: 128 })));
//!     }
//! }
//! assert_eq!(received, Some((7, true)));
//! # Ok::<(), link::serial::EncodeError>(())
//! ```

mod answer;
mod calibration;
mod frame;
mod request;
mod status;

pub use answer::{Answer, Hello, Refusal, SensorReading, TablePart};
pub use calibration::Measured;
pub use frame::{
    ANSWER_FRAME_MAX, BodyError, EncodeError, FRAME_OVERHEAD, Frame, FrameError, FrameReader, Kind, REQUEST_FRAME_MAX, encode, wire_length,
};
pub use request::{Request, Seed};
pub use status::{Counters, Faults, Light, Limit, Status};

/// The version of the protocol. The positions of version, kind, sequence number and CRC in a frame hold for all future versions.
pub const VERSION: u8 = 1;
/// The greatest number of bytes of a table in one frame.
pub const CHUNK_MAX: usize = 128;
/// The most LEDs that are On in a [test panel](Request::TestPanel): as many as in a message on average, to which the limit of the luminous
/// intensity applies.
pub const TEST_LEDS_MAX: u32 = crate::panel::LEDS as u32 / 2;

/// Identifies the messages that every program knows: the CRC-32C of their layout in `docs/serial.md`. Two programs with the same number
/// understand each other. Messages added later are not included, and a transmitter that does not know one refuses it as
/// [unknown](Refusal::Unknown). A test compares the layout with the types, and this number with the layout.
pub const SCHEMA: u32 = 0x423a_6da7;
