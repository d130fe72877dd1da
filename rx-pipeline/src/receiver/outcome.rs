//! What a receiver says of each frame.

use crate::carrier::Reread;
use crate::cells::CellsError;
use crate::corners::Corners;
use crate::detect::{DetectError, Detection};
use crate::features::FeaturesError;
use crate::locate::LocateError;
use crate::track::{TrackError, TrackErrorKind};
use link::framing::Event;
use link::orientation::Orientation;

/// One frame's panel, read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Where the panel is.
    pub corners: Corners,
    /// Its bits, hard and soft, and how sure they are.
    pub detection: Detection,
}

impl Reading {
    /// The same in the panel's own rows and columns, where this is in those of a picture that has it in that orientation. Of a mirrored
    /// picture it stays as it is: corners run clockwise.
    pub fn upright(&self, orientation: Orientation) -> Self {
        let orientation = orientation.turn();
        Self {
            corners: self.corners.upright(orientation.quarter_turns()),
            detection: self.detection.upright(orientation),
        }
    }
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
    #[error("coasting, frame {missed} of {patience} without the panel: {why}")]
    Coasting {
        /// Frames missed in a row, from 1.
        missed: u32,
        /// How many may be before it is given up.
        patience: u32,
        /// Why this one did not show it.
        why: TrackError,
    },
    /// The panel that was followed is given up; from the next frame on it is looked for everywhere.
    #[error("lost: {0}")]
    Lost(TrackError),
}

/// What losses have in common, whatever their numbers are. Of kinds that are as frequent, the last is told first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LossKind {
    /// The panel is covered, or dark.
    Covered,
    /// The bits could not be told apart.
    Undetected,
    /// An outer line of LEDs was not seen.
    EdgeUnseen,
    /// The panel that is followed was not seen, for such a reason.
    Coasting(TrackErrorKind),
    /// The LEDs are lost in noise.
    ContrastTooLow,
    /// The panel that was followed is given up, for such a reason.
    Lost(TrackErrorKind),
    /// Nothing that stands out has the size of a panel.
    NoCandidate,
    /// No panel is followed, and none is looked for.
    NoPlace,
    /// The LEDs show no random pattern.
    NotRandom,
    /// The panel is white.
    Saturated,
    /// The frame and the cells do not match.
    NoFeatures,
    /// What stands out is no grid of LEDs.
    NoGrid,
    /// The grid found has no shape of a panel.
    NoPanel,
    /// The grid goes on beyond 8×8.
    GoesOn,
    /// The panel's cells are not in the frame or the memory.
    NoCells,
}

impl Loss {
    /// What it has in common with losses of other numbers.
    pub fn kind(&self) -> LossKind {
        let why = match self {
            Self::Locate(why) => why,
            Self::NoPlace => return LossKind::NoPlace,
            Self::Cells(_) => return LossKind::NoCells,
            Self::Features(_) => return LossKind::NoFeatures,
            Self::Detect(DetectError::Covered { .. }) => return LossKind::Covered,
            Self::Detect(_) => return LossKind::Undetected,
            Self::Coasting { why, .. } => return LossKind::Coasting(why.kind()),
            Self::Lost(why) => return LossKind::Lost(why.kind()),
        };
        match why {
            LocateError::NothingStandsOut | LocateError::NoCandidate { .. } => LossKind::NoCandidate,
            LocateError::ContrastTooLow { .. } => LossKind::ContrastTooLow,
            LocateError::Saturated { .. } => LossKind::Saturated,
            LocateError::NotRandom { .. } => LossKind::NotRandom,
            LocateError::EdgeUnseen { .. } => LossKind::EdgeUnseen,
            LocateError::GoesOn { .. } => LossKind::GoesOn,
            LocateError::Corners(_) => LossKind::NoPanel,
            LocateError::NoLattice
            | LocateError::GridDoesNotFit { .. }
            | LocateError::SpotsDoNotFit { .. }
            | LocateError::Indistinct { .. }
            | LocateError::TooSmall { .. }
            | LocateError::ImpossiblePose { .. } => LossKind::NoGrid,
        }
    }
}

/// What one frame brought.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The panel, or why there is none: in rows and columns of the picture, turned by less than half a right angle when it was found.
    pub reading: Result<Reading, Loss>,
    /// The number of the symbol that the frame shows, where it was read; of the one that begins, where it shows two.
    pub symbol: Option<u32>,
    /// Which way up these have the panel, by the symbols before: known from the first header of a message on.
    pub orientation: Option<Orientation>,
    /// What the symbol before this frame's meant for the message.
    pub event: Event<'a>,
    /// What the frames before it have shown, where it is the first that tells how to read them: with the signs that a carrier gives them.
    pub reread: Option<Reread<'a>>,
}

impl From<TrackError> for Loss {
    fn from(why: TrackError) -> Self {
        Self::Coasting {
            missed: 0,
            patience: 0,
            why,
        }
    }
}

impl Outcome<'_> {
    /// No panel, no symbol, no message.
    pub(super) const NOTHING: Self = Self {
        reading: Err(Loss::NoPlace),
        symbol: None,
        orientation: None,
        event: Event::Nothing,
        reread: None,
    };
}
