//! The board behind a panel's LEDs, as it falls on the sensor.

use glam::DVec2;

use super::layout;
use super::outlined::LargeShape;
use super::placed::ExposureVibration;
use crate::accuracy::Accuracy;
use crate::disc::chords::Chords;
use crate::disc::outline::Outline;
use crate::formation::Formation;
use crate::scene::Camera;
use crate::view::{BOARD_CORNERS, PanelView};

/// A panel's board of 8 × 8 pitches.
pub(super) struct Board {
    pub(super) outlined: LargeShape,
    /// None where it is drawn pixel by pixel.
    pub(super) chords: Option<Chords>,
}

impl Board {
    /// Where it is `after_s` seconds after the middle of the exposure.
    pub(super) fn new(
        camera: &Camera,
        panel: &PanelView,
        formation: &Formation,
        accuracy: &Accuracy,
        shaken: Option<&ExposureVibration>,
        after_s: f64,
    ) -> Self {
        let corners = board_corners(camera, panel, formation, shaken, after_s);
        let centre = corners.iter().sum::<DVec2>() / 4.0;
        let outline = Outline::Quadrilateral(corners.map(|corner| corner - centre));
        Self {
            outlined: LargeShape::new(outline, centre),
            chords: Chords::within(&outline, formation.sigma_px, accuracy.quadrature),
        }
    }
}

/// The corners of a panel's board, each at its row's own time.
pub(super) fn board_corners(
    camera: &Camera,
    panel: &PanelView,
    formation: &Formation,
    shaken: Option<&ExposureVibration>,
    after_s: f64,
) -> [DVec2; 4] {
    BOARD_CORNERS.map(|(row, column)| {
        let at = panel.projection.led_m(row, column);
        layout::place(camera, panel, formation, shaken, after_s, at)
    })
}
