//! What a receiver says of each frame.

use crate::cells::CellsError;
use crate::corners::Corners;
use crate::detect::{DetectError, Detection};
use crate::features::FeaturesError;
use crate::locate::LocateError;
use crate::track::TrackError;
use link::framing::Event;

/// One frame's panel, read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Where the panel is.
    pub corners: Corners,
    /// Its bits, hard and soft, and how sure they are.
    pub detection: Detection,
}

/// Why a frame gave no reading.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Loss {
    /// No panel was found.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// No panel is followed, and none is looked for.
    #[error("no panel is followed, and regions are not searched for one: give its corners")]
    NoPlace,
    /// The panel's cells are not in the frame or the memory.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The frame and the cells do not match.
    #[error(transparent)]
    Features(#[from] FeaturesError),
    /// The bits could not be told apart.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// The panel that was followed is not seen; it is looked for where it should be.
    #[error(
        "coasting, frame {missed} of {} without the panel: {why}",
        crate::parameters::tracking::PATIENCE_FRAMES
    )]
    Coasting {
        /// Frames missed in a row, from 1.
        missed: u32,
        /// Why this one did not show it.
        why: TrackError,
    },
    /// The panel that was followed is given up; from the next frame on it is looked for everywhere.
    #[error("lost: {0}")]
    Lost(TrackError),
}

/// What one frame brought.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The panel, or why there is none.
    pub reading: Result<Reading, Loss>,
    /// The number of the symbol that the frame shows, where it was read; of the one that begins, where it shows two.
    pub symbol: Option<u32>,
    /// What the symbol before this frame's meant for the message.
    pub event: Event<'a>,
}

impl From<TrackError> for Loss {
    fn from(why: TrackError) -> Self {
        Self::Coasting { missed: 0, why }
    }
}

impl Outcome<'_> {
    /// No panel, no symbol, no message.
    pub(super) const NOTHING: Self = Self {
        reading: Err(Loss::NoPlace),
        symbol: None,
        event: Event::Nothing,
    };
}
