//! What is said between a computer and a receiver that stands alone.

use crate::hm01b0::{CameraError, Exposure};
use link::framing::MESSAGE_MAX;
use link::panel::SIDE;
use link::serial::{BodyError, FRAME_OVERHEAD, Hello, VERSION};
use serde::{Deserialize, Serialize};

/// The number of this set of messages, in [`Hello::schema`]; another number, other messages.
pub const SCHEMA: u32 = 0x7ece_0003;
/// What the name of each receiver's board begins with.
pub const BOARD_PREFIX: &str = "receiver-";
/// Bytes of a picture in one answer, at most.
pub const PART_MAX: usize = 512;
/// Bytes of the longest request's frame.
pub const REQUEST_MAX: usize = FRAME_OVERHEAD + 16;
/// Bytes of the longest answer's frame.
pub const ANSWER_MAX: usize = FRAME_OVERHEAD + 64 + MESSAGE_MAX;

/// A request. Doing twice what it asks for is the same as doing it once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// Who is there? The same request as a transmitter's. Answered by [`Answer::Hello`].
    Hello,
    /// Answered by [`Answer::Status`].
    Status,
    /// Answered by [`Answer::Message`].
    Message,
    /// Answered by [`Answer::Camera`].
    Camera,
    /// A part of the newest frame's picture, which is kept until half a second after a part of it was last asked for. Answered by
    /// [`Answer::Picture`].
    Picture {
        /// The first byte wanted.
        offset: u32,
    },
    /// Read a panel that shows so many symbols. Answered by [`Answer::Done`].
    SetSymbolRate {
        /// Thousandths of a symbol a second.
        millihertz: u32,
    },
    /// Answered by [`Answer::Reading`].
    Reading,
}

/// An answer; it carries the sequence number of its request.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Answer<'a> {
    /// The request was not done, and nothing changed.
    Refused(Refusal),
    /// Who is here: the same answer as a transmitter's.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// How the receiver is.
    Status(Status),
    /// The last message; none has come where the count is 0.
    Message(Message<'a>),
    /// How the camera is set.
    Camera(CameraSettings),
    /// A part of a picture.
    Picture(PicturePart<'a>),
    /// It is done.
    Done,
    /// What the panel that is followed was last read as; nothing while none is seen.
    Reading(Option<WireReading>),
}

/// Why a receiver did not do what was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The request is of another version of the frames.
    #[error("the receiver speaks version {speaks} of the frames: use a program that does, or update it")]
    Version {
        /// The version it speaks.
        speaks: u8,
    },
    /// The request is whole, and no message of this set.
    #[error("the receiver does not know this request: update the older side")]
    Unknown,
    /// No frame has come from the camera.
    #[error("the receiver has no picture, as no frame has come from its camera: look at its status")]
    NoPicture,
    /// It cannot read symbols at that rate.
    #[error("{millihertz} thousandths of a symbol a second: above 0 and at most {most} can be read, one in each frame")]
    SymbolRate {
        /// The rate asked for.
        millihertz: u32,
        /// The most.
        most: u32,
    },
}

impl From<BodyError> for Refusal {
    fn from(error: BodyError) -> Self {
        match error {
            BodyError::Version { .. } => Self::Version { speaks: VERSION },
            BodyError::OtherKind | BodyError::Malformed => Self::Unknown,
        }
    }
}

/// What keeps a receiver from seeing as it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Fault {
    /// The camera does not do what it is told.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The camera is set up and sends nothing.
    #[error("the camera sends no frames: look at PCLK, HREF, VSYNC and the camera's clock")]
    NoFrames,
    /// The camera's frames lack lines, all of them for a second.
    #[error("the camera's frames are cut short, none was whole for a second: look at PCLK, HREF and VSYNC, and keep their wires short")]
    NoWholeFrames,
}

/// A fault that has not gone yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trouble {
    /// What is wrong.
    pub fault: Fault,
    /// Since when, milliseconds after the receiver's start.
    pub since_ms: u64,
}

/// The state of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Milliseconds since it started.
    pub uptime_ms: u64,
    /// Whether it follows a panel; otherwise it looks for one.
    pub is_following: bool,
    /// What is wrong, if anything. A panel may be followed nevertheless.
    pub trouble: Option<Trouble>,
    /// Whether the watchdog or a panic restarted it.
    pub was_reset: bool,
    /// Where the panel that is followed was last seen: the corner LEDs in pixels of the frame, top left, top right, bottom right, bottom
    /// left.
    pub corners: Option<[[f32; 2]; 4]>,
    /// The share of the last reading's bits that are right if its soft values are: 0.5 to 1; 0 while none is followed.
    pub confidence: f32,
    /// Thousandths of a symbol a second that it expects.
    pub symbol_millihertz: u32,
    /// What the last frame took, from its end to the next one's being waited for, µs.
    pub frame_us: u32,
    /// The most that a frame took since the start, µs.
    pub longest_us: u32,
    /// The deepest that its stack was, bytes.
    pub stack_bytes: u32,
    /// What was counted.
    pub counters: Counters,
}

/// What is counted from the start; each stays at its greatest value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames taken in.
    pub frames: u32,
    /// Whole frames of the camera that were not taken in, as the ones before took too long.
    pub passed_by: u32,
    /// Frames that ended too early.
    pub cut_short: u32,
    /// Frames in which the panel was read.
    pub readings: u32,
    /// Times that a panel was found.
    pub found: u32,
    /// Times that a panel was lost.
    pub lost: u32,
    /// Messages received whole.
    pub messages: u32,
    /// LEDs that error correction mended in these.
    pub corrected_bits: u32,
    /// Times that the camera was set up.
    pub starts: u32,
    /// Requests that arrived whole.
    pub requests: u32,
    /// Garbage between two zeros on the port.
    pub bad_frames: u32,
}

/// What a frame was read as: in rows and columns as a [`Sighting`](super::Sighting) is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireReading {
    /// The frame's number.
    pub frame: u64,
    /// LEDs that are On: bit 8·row + column.
    pub bits: u64,
    /// How sure that is of each LED, by rows: ln(P(On)/P(Off)) in steps of [`LLR_STEP`](link::panel::LLR_STEP).
    pub soft: [[i8; SIDE]; SIDE],
    /// Whether the exposure seems to have caught two symbols: the bits are of neither then.
    pub is_mixed: bool,
    /// The corner LEDs in pixels of the frame, top left, top right, bottom right, bottom left.
    pub corners: [[f32; 2]; 4],
    /// The share of the bits that are right if the soft values are: 0.5 to 1.
    pub confidence: f32,
    /// How far away the panel is, in distances from one of its LEDs to the next, by the module's own lens.
    pub range_pitches: f32,
    /// That distance, m, where the transmitter has told how large its panel is.
    pub pitch_m: Option<f32>,
}

impl WireReading {
    /// How far away the panel is, m, where it has told its size.
    pub fn range_m(&self) -> Option<f32> {
        self.pitch_m.map(|pitch_m| pitch_m * self.range_pitches)
    }
}

/// A message that was received whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Message<'a> {
    /// Its number since the start, from 1; 0: none has come.
    pub count: u32,
    /// Its bytes: 1 to 1024, none where none has come.
    pub bytes: &'a [u8],
    /// Milliseconds since it was complete.
    pub age_ms: u64,
    /// Camera frames from its beginning to its end.
    pub frames: u32,
    /// LEDs that error correction mended.
    pub corrected_bits: u32,
}

/// How the camera is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraSettings {
    /// Columns and rows of a frame.
    pub size: [u16; 2],
    /// Time between frames, µs.
    pub period_us: u32,
    /// Lines that are exposed.
    pub lines: u16,
    /// Time that they are exposed for, µs.
    pub exposure_us: u32,
    /// Analog gain, as a power of 2.
    pub gain_log2: u8,
    /// Bright and dark grey level of the panel, or of the frame while none is followed, see
    /// [`Levels`](super::exposure::Levels).
    pub levels: [u8; 2],
}

impl CameraSettings {
    /// The exposure in it.
    pub const fn exposure(&self) -> Exposure {
        Exposure {
            lines: self.lines,
            gain_log2: self.gain_log2,
        }
    }
}

/// A part of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PicturePart<'a> {
    /// The number of its frame.
    pub frame: u64,
    /// Columns and rows of the picture.
    pub size: [u16; 2],
    /// Column and row of its first pixel in the camera's frame.
    pub origin: [u16; 2],
    /// Pixels of the frame from one of its pixels to the next.
    pub step: u8,
    /// Where in the picture the part begins.
    pub offset: u32,
    /// Grey levels, row by row; none at the end.
    pub bytes: &'a [u8],
}
