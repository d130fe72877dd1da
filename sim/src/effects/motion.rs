//! Motion during the exposure.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// The most moments of one exposure: on ways beyond 64 px, steps grow.
pub(super) const MOST_MOMENTS: f64 = 256.0;

/// See the [module](self).
pub(super) struct Motion;

impl Effect for Motion {
    fn about(&self) -> About {
        About {
            name: "motion",
            model: "motion during the exposure: the mean of the images at equally spaced moments of it",
            keys: &["pose.velocity_m_s", "camera.exposure_max_s", "camera.exposure_s"],
            cost: "LEDs are drawn once for each quarter pixel",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        // Relative to the image at the middle of the exposure, light moves by at most half the way.
        range.change_by_geometry(way_px(view) / 2.0, 0.0)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.motion_samples = moments(way_px(view), view.exposure.time_s);
        formation.moves = true;
    }
}

/// Moments of an exposure with a motion of `way_px`: (time from the exposure's middle in seconds, weight). One for each quarter pixel keeps
/// the steps far below the blur.
pub(crate) fn moments(way_px: f64, exposure_s: f64) -> Vec<(f64, f64)> {
    let count = (way_px * 4.0).ceil().clamp(1.0, MOST_MOMENTS);
    let moment = |k: usize| (((k as f64 + 0.5) / count - 0.5) * exposure_s, 1.0 / count);
    (0..count as usize).map(moment).collect()
}

/// The longest way of any LED in the image during the exposure, in px.
pub(crate) fn way_px(view: &View) -> f64 {
    let way = |panel: &crate::view::PanelView| {
        let velocity = glam::DVec3::from_array(panel.pose.velocity_m_s);
        let focal_px = view.scene.camera.focal_px();
        let nearest = panel.pose.distance_m - velocity.z.abs() * view.exposure.time_s;
        let off_axis = panel
            .ellipses
            .iter()
            .map(|e| (e.centre - glam::DVec2::from_array(view.scene.camera.principal_px())).length());
        let sideways = velocity.truncate().length() * focal_px / nearest.max(crate::view::DEPTH_MIN_M);
        let growth = off_axis.fold(0.0, f64::max) * velocity.z.abs() / nearest.max(crate::view::DEPTH_MIN_M);
        (sideways + growth) * view.exposure.time_s
    };
    view.panels.iter().map(way).fold(0.0, f64::max)
}
