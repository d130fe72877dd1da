//! A rolling shutter: rows are exposed one after another, so that an LED is seen later the lower it is, in symbol and in place.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct RollingShutter;

impl Effect for RollingShutter {
    fn about(&self) -> About {
        About {
            name: "rolling_shutter",
            model: "the exposure of a row begins readout x row / (rows - 1) after that of the first",
            keys: &["camera.readout_s", "pose.velocity_m_s", "link.symbol_rate_hz"],
            cost: "one addition an LED",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let readout_s = view.scene.camera.readout_s;
        if readout_s == 0.0 {
            return 0.0;
        }
        let moved = view.panels.iter().map(|panel| {
            let speed = glam::DVec3::from_array(panel.pose.velocity_m_s).length();
            speed * readout_s * view.scene.camera.focal_px() / panel.pose.distance_m * 2.0
        });
        let by_motion = range.change_by_geometry(moved.fold(0.0, f64::max), 0.0);
        // Rows may see another symbol than the first does unless the change stays outside all exposures.
        if super::symbol_change::straddles(view) {
            range.range_grey()
        } else {
            by_motion
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.row_delay_s = view.scene.camera.readout_s / (view.scene.camera.height_px - 1) as f64;
    }
}
