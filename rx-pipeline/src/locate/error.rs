//! Why no panel was found.

use super::blob::SIDE_PX;
use crate::corners::CornersError;

/// The greatest residual of a single frame, relative to the allowed one, at which a lattice is also tried within the panel's own outline,
/// without its surroundings. Higher: slower.
const NEARLY_FITS: f32 = 1.25;

/// Why no panel was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LocateError {
    /// The frame shows only noise.
    #[error("no candidate: nothing stands out from the noise; raise the panel's luminance or the exposure")]
    NothingStandsOut,
    /// No object has the size of a panel.
    #[error(
        "no candidate: of {places} places that stand out none is {} to {} px large; move the camera or crop the frame",
        SIDE_PX.start(),
        SIDE_PX.end()
    )]
    NoCandidate {
        /// Places that were searched.
        places: usize,
    },
    /// The fit of a lattice does not converge there.
    #[error("the grid does not fit: no 8×8 lattice fits what stands out most, so it is not a panel, or is not all in view")]
    NoLattice,
    /// No lattice of 8×8 spots matches the object.
    #[error(
        "the grid does not fit: the best 8×8 lattice differs from the frame by {residual_grey:.1} grey levels (root mean square), \
         and {allowed_grey:.1} is allowed; what stands out is not a panel, or clutter behind it shows through"
    )]
    GridDoesNotFit {
        /// Root mean square difference, in grey levels.
        residual_grey: f32,
        /// The largest residual accepted here, in grey levels.
        allowed_grey: f32,
    },
    /// The LEDs are lost in noise.
    #[error(
        "contrast too low: the LEDs have a signal-to-noise ratio of {signal_to_noise:.1}, {needed:.1} is needed; expose longer or brighter"
    )]
    ContrastTooLow {
        /// Amplitude ratio of all LEDs together.
        signal_to_noise: f32,
        /// The least accepted ratio.
        needed: f32,
    },
    /// The panel is white throughout.
    #[error("saturated: {percent} % of the panel's pixels are at grey 255, at most {max_percent} % may be; expose less")]
    Saturated {
        /// Share of pixels at 255, in percent.
        percent: u8,
        /// The accepted maximum.
        max_percent: u8,
    },
    /// Too few or too many LEDs are On, or they form a picture.
    #[error(
        "no random pattern: {lit} LEDs are lit or have changed, {different} of 112 neighbours differ; \
         a scrambled message shows about 32 and 56"
    )]
    NotRandom {
        /// LEDs that are On, or that have changed.
        lit: u32,
        /// Neighbours in rows and columns that differ.
        different: u32,
    },
    /// An outer row or column is invisible, so that the lattice may be off by one line.
    #[error("an edge is unseen: an outer line of LEDs has a signal-to-noise ratio of {signal_to_noise:.1}; the next frames may show it")]
    EdgeUnseen {
        /// Amplitude ratio of the evidence.
        signal_to_noise: f32,
    },
    /// The pattern continues beyond 8×8.
    #[error("the grid continues beyond 8×8: {lit_around} places around the 8×8 lattice are lit like LEDs")]
    GoesOn {
        /// Places that are lit.
        lit_around: u32,
    },
    /// The fitted spots do not have the width of LEDs.
    #[error(
        "the grid does not fit: its spots are {spot_sigma_px:.2} px wide (standard deviation), and LEDs at this pitch are \
         {narrowest_px:.2} to {widest_px:.2} px wide; bring the camera into focus, or come nearer"
    )]
    SpotsDoNotFit {
        /// The fitted spots' standard deviation.
        spot_sigma_px: f32,
        /// The least possible.
        narrowest_px: f32,
        /// The most possible.
        widest_px: f32,
    },
    /// The LEDs merge, so that a single frame does not distinguish them from a smooth object.
    #[error(
        "the grid does not fit: its LEDs merge, and one frame is not enough to distinguish a panel from a smooth image; the next frames \
         may show it"
    )]
    Indistinct {
        /// The natural logarithm of the odds.
        log_odds: f32,
    },
    /// The LEDs are too close together for a verification.
    #[error(
        "the grid does not fit: its LEDs are {pitch_px:.1} px apart, and a search needs at least 2 px; come nearer or use a longer lens"
    )]
    TooSmall {
        /// Distance of neighbouring LEDs.
        pitch_px: f32,
    },
    /// The lattice is stretched or slanted as no panel is.
    #[error(
        "the grid does not fit: it is {aspect:.2} times as wide as high, and its rows and columns meet at {angle_deg:.0}°, which is outside \
         the searched range"
    )]
    ImpossiblePose {
        /// Pitch along rows over pitch along columns.
        aspect: f32,
        /// The angle between rows and columns in degrees.
        angle_deg: f32,
    },
    /// The fitted lattice is not readable.
    #[error("the grid that was found is not a panel: {0}")]
    Corners(#[from] CornersError),
}
impl LocateError {
    /// Whether the surroundings of the lattice may have caused the error, rather than the lattice itself.
    pub(super) fn may_be_of_the_surroundings(&self) -> bool {
        match self {
            Self::GoesOn { .. } => true,
            Self::GridDoesNotFit {
                residual_grey,
                allowed_grey,
            } => *residual_grey < NEARLY_FITS * allowed_grey,
            _ => false,
        }
    }

    /// Whether shadows across the lattice may have caused the error.
    pub(super) fn may_be_of_shadows(&self) -> bool {
        matches!(
            self,
            Self::NoLattice | Self::GridDoesNotFit { .. } | Self::EdgeUnseen { .. } | Self::Indistinct { .. }
        )
    }
}
