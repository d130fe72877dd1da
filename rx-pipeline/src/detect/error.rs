//! Why a panel could not be read.

use link::panel::{LEDS, PanelFrame};

/// The least difference between the brightest and the darkest cell's mean that rounding cannot cause (grey). Higher: faint panels are
/// refused; lower: rounding is read as bits.
pub(crate) const MIN_CONTRAST_GREY: f32 = 0.5;
/// White cells of a readable panel, at most (count): scrambled bits light 32 ± 4 LEDs. Higher: light from neighbours is read as an LED;
/// lower: bright panels with many LEDs On are refused.
pub(super) const WHITE_CELLS_MAX: usize = 48;

/// Why a panel could not be read.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DetectError {
    /// All cells look alike.
    #[error(
        "the brightest and the darkest cell differ by {range_grey} grey levels, and at least {MIN_CONTRAST_GREY} are \
         needed to exceed rounding: check exposure and corners"
    )]
    ContrastTooLow {
        /// Highest minus lowest mean grey of a cell, in grey levels.
        range_grey: f32,
    },
    /// The features do not fall into two groups.
    #[error("{on} of the cells are On, and at least one has to be On and one Off: check the corners")]
    OneClass {
        /// Cells in the brighter group, 0 or 64.
        on: u32,
    },
    /// The panel's place shows hardly any of the earlier contrast.
    #[error("the panel shows {percent} % of its usual contrast: it is covered, or dark")]
    Covered {
        /// The contrast of its LEDs relative to the usual one, in percent.
        percent: u8,
    },
    /// Nearly all cells are white.
    #[error(
        "{white} of the 64 cells are white, and at most {WHITE_CELLS_MAX} may be, because Off LEDs do not show among white: expose \
         less, or dim the panel"
    )]
    TooWhite {
        /// Cells that are white.
        white: usize,
    },
    /// The panel's image has too many pixels, or too few.
    #[error(
        "the panel's image has {width} × {height} pixels, and 4 × 4 to {capacity} in all, 128 a side, can be read: check the \
         corners, or shrink the frame"
    )]
    OutsideMemory {
        /// The image's columns.
        width: usize,
        /// The image's rows.
        height: usize,
        /// The detector's `PIXELS`.
        capacity: usize,
    },
}

/// The split, if there are cells in both classes.
pub(super) fn two_classes(bits: PanelFrame) -> Result<PanelFrame, DetectError> {
    match bits.count_on() {
        on if on == 0 || on == LEDS as u32 => Err(DetectError::OneClass { on }),
        _ => Ok(bits),
    }
}
