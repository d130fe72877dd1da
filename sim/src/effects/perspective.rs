//! Perspective within the panel, compared with an affine image of the whole panel.

use glam::DVec2;
use link::panel::SIDE;

use super::{About, Effect};
use crate::camera::projection::Ellipse;
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Perspective;

impl Effect for Perspective {
    fn about(&self) -> About {
        About {
            name: "perspective",
            model: "pinhole projection of each LED by itself; without it the panel is one affine image",
            keys: &[
                "pose.roll_deg",
                "pose.yaw_deg",
                "pose.pitch_deg",
                "pose.distance_m",
                "camera.shake_deg",
            ],
            cost: "chords for each LED instead of one set",
        }
    }

    /// The error of the affine image at an LED and its rim, also under the camera's vibration.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let moved = view.panels.iter().flat_map(|panel| {
            let centre = panel.projection.pixel(DVec2::ZERO);
            let jacobian = panel.projection.jacobian(DVec2::ZERO);
            let affine = Ellipse {
                centre,
                shape: jacobian * (panel.panel.led_diameter_m / 2.0),
            };
            let (reach, radius) = (super::shake::reach(view, panel), panel.radius_px());
            let bent = reach.bend_per_px * radius;
            panel.ellipses.iter().enumerate().map(move |(led, exact)| {
                let at = panel.projection.led_m((led / SIDE) as f64, (led % SIDE) as f64);
                let shift = (exact.centre - centre - jacobian * at).length();
                let rim = rim_difference(exact, &affine);
                let extent = exact.half_extent().length();
                (
                    shift * (1.0 + reach.stretch) + bent * radius,
                    rim * (1.0 + reach.stretch) + bent * extent,
                )
            })
        });
        let (shift, rim) = moved.fold((0.0, 0.0), |(shift, rim): (f64, f64), (s, r)| (shift.max(s), rim.max(r)));
        range.change_by_geometry(shift, rim)
    }

    fn include(&self, _view: &View, formation: &mut Formation) {
        formation.exact_perspective = true;
    }
}

/// The greatest distance of the rims of two concentric ellipses.
///
/// The support functions √(nᵀ·S·n), S = shape·shapeᵀ, of two convex sets differ by as much as the sets do, and |√a − √b| ≤ |a − b|/√b.
fn rim_difference(one: &Ellipse, other: &Ellipse) -> f64 {
    let square = |ellipse: &Ellipse| ellipse.shape * ellipse.shape.transpose();
    let change = square(one) - square(other);
    let norm = (change.x_axis.length_squared() + change.y_axis.length_squared()).sqrt();
    norm / other.smaller_half_diameter()
}
