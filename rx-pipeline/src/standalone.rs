//! A receiver that stands alone: a microcontroller with a camera that is flashed, pointed at a panel, and prints messages.
//!
//! ```text
//!   camera ─ frame ─ Application ─ Follow: search the whole frame, follow, read ─ text on the port
//!      ▲                 │  ▲
//!      └── exposure ─────┘  └── requests of a computer: status, reading, message, camera, picture
//! ```
//!
//! | part | what it is |
//! |---|---|
//! | [`Application`] | what runs: sets the camera up, takes frames, says what it sees, mends what can be mended |
//! | [`Camera`], [`Clock`], [`Port`], [`Machine`] | what it runs on: a board is these and nothing else |
//! | [`Follow`] | what finds and reads the panel: a [`Receiver`](crate::receiver::Receiver) |
//! | [`exposure`] | how long to expose |
//! | [`Request`], [`Answer`] | what a computer may ask, in the frames of [`link::serial`] |
//!
//! Text and answers share the port. Answers lie between two zeros, which text never has; and as long as a computer asks, there is no text.

pub mod exposure;

mod application;
mod follow;
mod last_message;
mod message;
mod numbering;
mod picture;
mod range;
mod service;
#[cfg(test)]
mod tests;
mod text;

pub use application::{Application, ApplicationError, QUIET_US, Settings};
pub use follow::{Follow, FrameOutcome, PanelReceiver, Sighting};
pub use message::{
    ANSWER_MAX, Answer, BOARD_PREFIX, CameraSettings, Counters, Fault, Message, PART_MAX, PicturePart, REQUEST_MAX, Refusal, Request,
    SCHEMA, Status, Trouble, WireReading,
};
pub use picture::PICTURE_PIXELS;
pub use range::range_pitches;

use crate::hm01b0::{CameraError, Exposure, Hm01b0};
use embedded_hal::{delay::DelayNs, i2c::I2c};

/// A camera's registers.
pub trait Camera {
    /// Sets the camera up anew; its frames begin.
    ///
    /// # Errors
    /// [`CameraError`] says what is wrong with it.
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError>;

    /// Exposes like this from one of the next frames on.
    ///
    /// # Errors
    /// [`CameraError`] says what is wrong with it.
    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError>;
}

impl<B: I2c, D: DelayNs> Camera for Hm01b0<B, D> {
    fn start(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        Hm01b0::start(self, exposure)
    }

    fn expose(&mut self, exposure: Exposure) -> Result<(), CameraError> {
        Hm01b0::expose(self, exposure)
    }
}

/// A clock.
pub trait Clock {
    /// Microseconds since the start.
    fn micros(&self) -> u64;
}

/// A serial port.
pub trait Port {
    /// A byte that has come; `None` where none has.
    fn read(&mut self) -> Option<u8>;

    /// Sends bytes, and waits where there is no room for them yet.
    fn write(&mut self, bytes: &[u8]);
}

/// What else a board has.
pub trait Machine {
    /// The name of the board behind [`BOARD_PREFIX`], up to 20 bytes.
    const BOARD: &'static str;
    /// The version of its program.
    const FIRMWARE: &'static str;

    /// The program is alive: called more often than once a second but for single calls of a search, whatever it is at.
    fn alive(&mut self);

    /// Switches the lamp.
    fn lamp(&mut self, is_on: bool);

    /// The deepest that the stack has been, bytes.
    fn stack_bytes(&self) -> u32;

    /// Frames that ended before all of their lines had come, since the start.
    fn cut_short(&self) -> u32;
}

/// All that an [`Application`] runs on.
pub trait Board: Camera + Clock + Port + Machine {}

impl<B: Camera + Clock + Port + Machine> Board for B {}
