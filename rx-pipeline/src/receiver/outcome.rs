//! The result of a receiver for each frame.

use crate::carrier::Reread;
use crate::cells::CellsError;
use crate::corners::Corners;
use crate::detect::{DetectError, Detection};
use crate::features::FeaturesError;
use crate::locate::LocateError;
use crate::track::{TrackError, TrackErrorKind};
use link::framing::Event;
use link::orientation::Orientation;

/// The reading of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameReading {
    /// The panel's corners.
    pub corners: Corners,
    /// Its bits, hard and soft, with their certainty.
    pub detection: Detection,
}

impl FrameReading {
    /// The reading in the panel's own rows and columns, if this one is in those of a picture with that orientation. The reading of a
    /// mirrored picture stays unchanged, because corners run clockwise.
    pub fn upright(&self, orientation: Orientation) -> Self {
        let orientation = orientation.turn();
        Self {
            corners: self.corners.upright(orientation.quarter_turns()),
            detection: self.detection.upright(orientation),
        }
    }
}

/// Why a frame has no reading.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Loss {
    /// No panel was found.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// No panel is followed, and there is no search.
    #[error("no panel is followed, and regions are not searched for one: give its corners")]
    NoPlace,
    /// The panel's cells are not in the frame or the memory.
    #[error(transparent)]
    Cells(#[from] CellsError),
    /// The frame and the cells do not match.
    #[error(transparent)]
    Features(#[from] FeaturesError),
    /// The bits could not be distinguished.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// The followed panel was not seen; the receiver continues to expect it.
    #[error("coasting, frame {missed} of {patience} without the panel: {why}")]
    Coasting {
        /// Successive frames without the panel, from 1.
        missed: u32,
        /// Maximum of `missed` before the panel is given up.
        patience: u32,
        /// Why this frame did not show it.
        why: TrackError,
    },
    /// The followed panel was given up; from the next frame on, the receiver searches everywhere.
    #[error("lost: {0}")]
    Lost(TrackError),
}

/// The kind of a loss, without its numbers. Of equally frequent kinds, the last in this order is reported first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LossKind {
    /// The panel is covered, or dark.
    Covered,
    /// The bits could not be distinguished.
    Undetected,
    /// An outer line of LEDs was not seen.
    EdgeUnseen,
    /// The followed panel was not seen, for such a reason.
    Coasting(TrackErrorKind),
    /// The LEDs are lost in noise.
    ContrastTooLow,
    /// The followed panel was given up, for such a reason.
    Lost(TrackErrorKind),
    /// No bright area has the size of a panel.
    NoCandidate,
    /// No panel is followed, and there is no search.
    NoPlace,
    /// The LEDs show no random pattern.
    NotRandom,
    /// The panel is white.
    Saturated,
    /// The frame and the cells do not match.
    NoFeatures,
    /// The bright areas are not a grid of LEDs.
    NoGrid,
    /// The grid does not have the shape of a panel.
    NoPanel,
    /// The grid continues beyond 8×8.
    GoesOn,
    /// The panel's cells are not in the frame or the memory.
    NoCells,
}

impl Loss {
    /// The kind of this loss.
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

/// The result of one frame.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The reading, or why there is none, in rows and columns of the picture. The panel was rotated by less than half a right angle when it
    /// was found.
    pub reading: Result<FrameReading, Loss>,
    /// The number of the symbol that the frame shows, if it was read; in a frame of two symbols, that of the later one.
    pub symbol: Option<u32>,
    /// The panel's orientation in the picture according to earlier symbols, known from the first message header on.
    pub orientation: Option<Orientation>,
    /// The event of the symbol before this frame's.
    pub event: Event<'a>,
    /// The readings of the frames before, with the signs of a carrier, if this frame is the first that makes the signs known.
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
    /// An outcome without a panel, symbol or message.
    pub(super) const NOTHING: Self = Self {
        reading: Err(Loss::NoPlace),
        symbol: None,
        orientation: None,
        event: Event::Nothing,
        reread: None,
    };
}
