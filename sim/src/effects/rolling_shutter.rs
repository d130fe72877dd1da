//! A rolling shutter: rows are exposed one after another, so that a lower LED is seen later, in symbol and in position.

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
            keys: &[
                "camera.readout_s",
                "pose.velocity_m_s",
                "camera.shake_deg",
                "link.symbol_rate_hz",
                "link.carrier_cycles",
            ],
            cost: "one addition an LED",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let readout_s = view.scene.camera.readout_s;
        if readout_s == 0.0 {
            return 0.0;
        }
        // A vibration rotates by at most its peak to either side, and at most at its highest frequency.
        let of_shake = (std::f64::consts::TAU * view.scene.camera.shake_highest_hz * readout_s).min(2.0);
        let moved = view.panels.iter().map(|panel| {
            let speed = glam::DVec3::from_array(panel.pose.velocity_m_s).length();
            let way = speed * readout_s * view.scene.camera.focal_px() / panel.pose.distance_m * 2.0;
            let reach = super::shake::reach(view, panel);
            let shaken = of_shake * (reach.shift_px + reach.stretch * panel.radius_px());
            (way + shaken, of_shake * reach.stretch * super::shake::extent_px(panel))
        });
        let (moved, rim) = moved.fold((0.0, 0.0), |(way, rim): (f64, f64), (w, r)| (way.max(w), rim.max(r)));
        let by_motion = range.change_by_geometry(moved, rim);
        // Rows may see another symbol than the first row unless the change stays outside all exposures, and another phase of a carrier.
        if super::symbol_change::straddles(view) || !view.waveform.is_still() {
            range.range_grey()
        } else {
            by_motion
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.row_delay_s = view.scene.camera.readout_s / (view.scene.camera.height_px - 1) as f64;
    }
}
