//! The camera's vibration: the whole picture moves from frame to frame, during the exposure, and from line to line.

use super::{About, Effect};
use crate::camera::shake::{Reach, Shake};
use crate::formation::Formation;
use crate::view::{LinearRange, PanelView, View};

/// See the [module](self).
pub(super) struct ExposureVibration;

impl Effect for ExposureVibration {
    fn about(&self) -> About {
        About {
            name: "shake",
            model: "vibration of the camera about its axes, noise of a band with the same power in each octave, as a sum of sines",
            keys: &[
                "camera.shake_deg",
                "camera.shake_roll_deg",
                "camera.shake_lowest_hz",
                "camera.shake_highest_hz",
            ],
            cost: "LEDs are placed again in each frame, and drawn once for each quarter pixel of their path",
        }
    }

    /// The shift of LEDs and their rims at its peak.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let shake = Shake::of(&view.scene.camera);
        if shake.is_none() {
            return 0.0;
        }
        let (mut shift, mut rim) = (0.0f64, 0.0f64);
        for panel in &view.panels {
            let reach = panel.reach_of(&shake, &view.scene.camera);
            shift = shift.max(reach.shift_px + reach.stretch * panel.radius_px());
            rim = rim.max(reach.stretch * extent_px(panel));
        }
        // A longer way gets other moments of the exposure.
        let way = super::motion::way_px(view);
        if way > 0.0 {
            shift += (way / super::motion::MOST_MOMENTS).max(0.25);
        }
        let Some(_) = &view.photograph else {
            return range.change_by_geometry(shift, rim);
        };
        // Between its pixels a photograph rises by at most the whole range along each axis.
        let camera = &view.scene.camera;
        let [x, y] = camera.principal_px();
        let behind = shake.reach(camera, x.hypot(y)).shift_px;
        range.change_by_geometry_before(shift, rim, std::f64::consts::SQRT_2 * behind)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.shake = Some(Shake::of(&view.scene.camera)).filter(|shake| !shake.is_none());
    }
}

/// The greatest distance of the rim of any LED from its centre.
pub(super) fn extent_px(panel: &PanelView) -> f64 {
    let extents = panel.ellipses.iter().map(|ellipse| ellipse.half_extent().length());
    extents.fold(0.0, f64::max)
}

/// Bounds of the vibration's effect on a panel's image; 0 if the camera is still.
pub(super) fn reach(view: &View, panel: &PanelView) -> Reach {
    panel.reach_of(&Shake::of(&view.scene.camera), &view.scene.camera)
}
