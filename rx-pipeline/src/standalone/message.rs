//! The messages between a computer and a standalone receiver.

use super::camera::{CameraError, Exposure};
use super::trust::TrustError;
use link::framing::MESSAGE_MAX;
use link::panel::SIDE;
use link::serial::{BodyError, FRAME_OVERHEAD, Hello, VERSION};
use link::signing::Verdict;
use serde::{Deserialize, Serialize};

/// The number of this set of messages, in [`Hello::schema`]; another set has another number.
pub const SCHEMA: u32 = 0x7ece_0004;
/// The prefix of each receiver's board name.
pub const BOARD_PREFIX: &str = "receiver-";
/// Bytes of a picture in one answer, at most.
pub const PART_MAX: usize = 512;
/// Bytes of the longest request's frame.
pub const REQUEST_MAX: usize = FRAME_OVERHEAD + 16;
/// Bytes of the longest answer's frame.
pub const ANSWER_MAX: usize = FRAME_OVERHEAD + 64 + MESSAGE_MAX;

/// A request. All requests are idempotent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// Identification: the same request as a transmitter's. Answered by [`Answer::Hello`].
    Hello,
    /// Answered by [`Answer::Status`].
    Status,
    /// Answered by [`Answer::Message`].
    Message,
    /// Answered by [`Answer::Camera`].
    Camera,
    /// A part of the newest frame's picture, which is kept until half a second after the last request for a part. Answered by
    /// [`Answer::Picture`].
    Picture {
        /// The first byte of the part.
        offset: u32,
    },
    /// Sets the panel's symbol rate. Answered by [`Answer::Done`].
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
    /// The request failed, and nothing changed.
    Refused(Refusal),
    /// Identification: the same answer as a transmitter's.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// The receiver's state.
    Status(Status),
    /// The last message; none yet if the count is 0.
    Message(Message<'a>),
    /// The camera's settings.
    Camera(CameraSettings),
    /// A part of a picture.
    Picture(PicturePart<'a>),
    /// The request succeeded.
    Done,
    /// The last reading of the followed panel; `None` while none is seen.
    Reading(Option<WireReading>),
}

/// Why a receiver refused a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The request has another version of the frames.
    #[error("the receiver speaks version {speaks} of the frames: use a program with that version, or update it")]
    Version {
        /// The receiver's version.
        speaks: u8,
    },
    /// The request is whole but unknown in this set.
    #[error("the receiver does not know this request: update the older side")]
    Unknown,
    /// No frame has come from the camera.
    #[error("the receiver has no picture, because its camera has sent no frame: look at its status")]
    NoPicture,
    /// The symbol rate is out of range.
    #[error("{millihertz} thousandths of a symbol a second cannot be read: give above 0 and at most {most}, one symbol a frame")]
    SymbolRate {
        /// The requested rate.
        millihertz: u32,
        /// The maximum.
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

/// A fault that hinders the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Fault {
    /// The camera does not accept its settings.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The camera is set up and sends nothing.
    #[error("the camera sends no frames: look at PCLK, HREF, VSYNC and the camera's clock")]
    NoFrames,
    /// All of the camera's frames have lacked lines for a second.
    #[error("the camera's frames are cut short, none was whole for a second: look at PCLK, HREF and VSYNC, and keep their wires short")]
    NoWholeFrames,
    /// The list of trusted keys is unusable, and lasts until another program is flashed.
    #[error("no message is verified, because the program was built with a wrong list of trusted keys (VOCC_TRUST): {0}")]
    Keys(#[from] TrustError),
}

/// A current fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Trouble {
    /// The fault.
    pub fault: Fault,
    /// Its start, milliseconds after the receiver's start.
    pub since_ms: u64,
}

/// The state of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Milliseconds since the start.
    pub uptime_ms: u64,
    /// Whether it follows a panel; otherwise it searches.
    pub is_following: bool,
    /// The current fault, if any. A panel may be followed nevertheless.
    pub trouble: Option<Trouble>,
    /// Whether the watchdog or a panic restarted it.
    pub was_reset: bool,
    /// The last known position of the followed panel: the corner LEDs in pixels of the frame, top left, top right, bottom right, bottom
    /// left.
    pub corners: Option<[[f32; 2]; 4]>,
    /// The expected share of right bits in the last reading, by its soft values: 0.5 to 1; 0 while no panel is followed.
    pub confidence: f32,
    /// The expected symbol rate, thousandths of a symbol a second.
    pub symbol_millihertz: u32,
    /// Time for the last frame, from its end until the wait for the next one, µs.
    pub frame_us: u32,
    /// The longest time for a frame since the start, µs.
    pub longest_us: u32,
    /// The greatest stack depth, bytes.
    pub stack_bytes: u32,
    /// The counters.
    pub counters: Counters,
}

/// Counters since the start; each saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Processed frames.
    pub frames: u32,
    /// Whole frames of the camera that were dropped because earlier ones took too long.
    pub passed_by: u32,
    /// Frames with missing lines.
    pub cut_short: u32,
    /// Frames in which the panel was read.
    pub readings: u32,
    /// Times that a panel was found.
    pub found: u32,
    /// Times that a panel was lost.
    pub lost: u32,
    /// Messages received whole.
    pub messages: u32,
    /// LEDs that error correction changed in these.
    pub corrected_bits: u32,
    /// Times that the camera was set up.
    pub starts: u32,
    /// Whole requests.
    pub requests: u32,
    /// Garbage between two zeros on the port.
    pub bad_frames: u32,
}

/// The reading of a frame: in rows and columns as in a [`Sighting`](super::Sighting).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WireReading {
    /// The frame's number.
    pub frame: u64,
    /// On LEDs: bit 8·row + column.
    pub bits: u64,
    /// The soft value of each LED, by rows: ln(P(On)/P(Off)) in steps of [`LLR_STEP`](link::panel::LLR_STEP).
    pub soft: [[i8; SIDE]; SIDE],
    /// Whether the exposure seems to have caught two symbols: the bits are then of neither.
    pub is_mixed: bool,
    /// The corner LEDs in pixels of the frame, top left, top right, bottom right, bottom left.
    pub corners: [[f32; 2]; 4],
    /// The expected share of right bits, by the soft values: 0.5 to 1.
    pub confidence: f32,
    /// The panel's distance in pitches, by the module's own lens.
    pub range_pitches: f32,
    /// The pitch, m, if the transmitter has sent its panel's size.
    pub pitch_m: Option<f32>,
}

impl WireReading {
    /// The panel's distance, m, if the transmitter has sent its size.
    pub fn range_m(&self) -> Option<f32> {
        self.pitch_m.map(|pitch_m| pitch_m * self.range_pitches)
    }
}

/// A received message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Message<'a> {
    /// Its number since the start, from 1; 0: none yet.
    pub count: u32,
    /// Its bytes: 1 to 1024, or none before the first message.
    pub bytes: &'a [u8],
    /// Milliseconds since it was complete.
    pub age_ms: u64,
    /// Camera frames from its beginning to its end.
    pub frames: u32,
    /// LEDs that error correction changed.
    pub corrected_bits: u32,
    /// The verdict on its signature.
    pub verdict: Verdict,
}

/// The camera's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraSettings {
    /// Columns and rows of a frame.
    pub size: [u16; 2],
    /// Time between frames, µs.
    pub period_us: u32,
    /// Exposed lines.
    pub lines: u16,
    /// Exposure time of a line, µs.
    pub exposure_us: u32,
    /// Analog gain, as a power of 2.
    pub gain_log2: u8,
    /// Bright and dark grey level of the panel, or of the frame while no panel is followed, see [`Levels`](super::exposure::Levels).
    pub levels: [u8; 2],
}

impl CameraSettings {
    /// The exposure in these settings.
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
    /// Pixels of the frame per step between its pixels.
    pub step: u8,
    /// The part's position in the picture, bytes.
    pub offset: u32,
    /// Grey levels, row by row; none at the end.
    pub bytes: &'a [u8],
}
