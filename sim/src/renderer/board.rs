//! The image of the board behind a panel's LEDs.

use glam::DVec2;

use super::layout::Imaging;
use super::outlined::LargeShape;
use crate::accuracy::Accuracy;
use crate::disc::chords::Chords;
use crate::disc::outline::Outline;
use crate::view::BOARD_CORNERS;

/// A panel's board of 8 × 8 pitches.
pub(super) struct Board {
    pub(super) outlined: LargeShape,
    /// `None` if it is drawn pixel by pixel.
    pub(super) chords: Option<Chords>,
}

impl Board {
    /// Its position at a moment.
    pub(super) fn new(imaging: &Imaging, accuracy: &Accuracy) -> Self {
        let corners = board_corners(imaging);
        let centre = corners.iter().sum::<DVec2>() / 4.0;
        let outline = Outline::Quadrilateral(corners.map(|corner| corner - centre));
        Self {
            outlined: LargeShape::new(outline, centre),
            chords: Chords::within(&outline, imaging.formation.sigma_px, accuracy.quadrature),
        }
    }
}

/// The corners of a panel's board, each at its row's own time.
pub(super) fn board_corners(imaging: &Imaging) -> [DVec2; 4] {
    BOARD_CORNERS.map(|(row, column)| imaging.place(imaging.panel.projection.led_m(row, column)))
}
