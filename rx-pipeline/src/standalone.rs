//! A standalone receiver: a microcontroller with a camera that is flashed, pointed at a panel, and prints messages.
//!
//! ```text
//!   camera ─ frame ─ Application ─ Follow: search the whole frame, follow, read ─ text on the port
//!      ▲                 │  ▲
//!      └── exposure ─────┘  └── requests of a computer: status, reading, message, camera, picture
//! ```
//!
//! | part | purpose |
//! |---|---|
//! | [`Application`] | the program: sets the camera up, processes frames, reports, and recovers from faults |
//! | [`Camera`], [`Clock`], [`Port`], [`Machine`] | its hardware: a board implements these alone |
//! | [`CameraMode`] | what a board states about its camera |
//! | [`Follow`] | finds and reads the panel: a [`Receiver`](crate::receiver::Receiver) |
//! | [`exposure`] | control of the exposure |
//! | [`Trust`] | the public keys that verify signed messages |
//! | [`Request`], [`Answer`] | a computer's requests, in the frames of [`link::serial`] |
//!
//! Text and answers share the port. Answers lie between two zeros, which text never contains, and there is no text while a computer sends
//! requests.

pub mod exposure;

mod application;
mod camera;
mod follow;
mod last_message;
mod message;
mod numbering;
mod picture;
mod range;
mod service;
#[cfg(test)]
pub(crate) mod tests;
mod text;
mod trust;

pub use application::{Application, ApplicationError, QUIET_US, Settings};
pub use camera::{Camera, CameraError, CameraMode, CameraModeError, Exposure};
pub use follow::{Follow, FrameOutcome, PanelReceiver, Sighting};
pub use message::{
    ANSWER_MAX, Answer, BOARD_PREFIX, CameraSettings, Counters, Fault, Message, PART_MAX, PicturePart, REQUEST_MAX, Refusal, Request,
    SCHEMA, Status, Trouble, WireReading,
};
pub use picture::PICTURE_PIXELS;
pub use range::range_pitches;
pub use trust::{KEYS_MAX, Trust, TrustError};

/// A clock.
pub trait Clock {
    /// Microseconds since the start.
    fn micros(&self) -> u64;
}

/// A serial port.
pub trait Port {
    /// The next received byte; `None` if there is none.
    fn read(&mut self) -> Option<u8>;

    /// Sends bytes, and blocks until there is room for them.
    fn write(&mut self, bytes: &[u8]);
}

/// The other parts of a board.
pub trait Machine {
    /// The name of the board after [`BOARD_PREFIX`], up to 20 bytes.
    const BOARD: &'static str;
    /// The version of its program.
    const FIRMWARE: &'static str;

    /// Reports that the program is alive: called at least once a second, except during a single call of a search.
    fn alive(&mut self);

    /// Switches the lamp.
    fn lamp(&mut self, is_on: bool);

    /// The greatest stack depth so far, bytes.
    fn stack_bytes(&self) -> u32;

    /// Frames with missing lines, since the start.
    fn cut_short(&self) -> u32;
}

/// The hardware of an [`Application`].
pub trait Board: Camera + Clock + Port + Machine {}

impl<B: Camera + Clock + Port + Machine> Board for B {}
