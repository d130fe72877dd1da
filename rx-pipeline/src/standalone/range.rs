//! The distance of a panel in pitches, by its size in the picture.

use super::camera::CameraMode;
use crate::corners::Corners;

/// The distance from the lens to a panel's centre over the panel's pitch.
///
/// A view along the line of sight shortens the panel's plane in one direction at most. So the greatest stretch of a step between LEDs, at
/// right angles to that line, depends on the distance alone, and not on the panel's rotation. The result is exact for a lens without
/// distortion; errors of the corners carry over.
pub fn range_pitches(corners: &Corners, mode: &CameraMode) -> f32 {
    let focal_length_px = mode.focal_length_px;
    let [centre, along_row, along_column, _] = corners.homography().about_middle();
    let middle = [mode.width, mode.height].map(|side| (side as f32 - 1.0) / 2.0);
    let sight = [0, 1].map(|axis| (centre[axis] - middle[axis]) / focal_length_px);
    // The ratio of the line of sight to the depth.
    let slant = libm::sqrtf(1.0 + dot(sight, sight));
    let across = |step: [f32; 2]| {
        let along = dot(sight, step) / (slant * (slant + 1.0));
        [0, 1].map(|axis| step[axis] - along * sight[axis])
    };
    slant * focal_length_px / greatest_stretch(across(along_row), across(along_column))
}

/// The greater singular value of the matrix of these columns.
fn greatest_stretch(a: [f32; 2], b: [f32; 2]) -> f32 {
    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
    libm::sqrtf(((aa + bb) + libm::hypotf(aa - bb, 2.0 * ab)) / 2.0)
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::standalone::tests::{OTHER, QVGA};
    use properties::prelude::*;

    /// Corners are 32-bit floats: those of a panel 14 px across are precise to a millionth of that, and the computation loses some.
    const ROUNDING: f64 = 2e-4;

    /// The corner LEDs of a panel whose centre is at `centre` (pitches, z along the optical axis), turned by roll, yaw and pitch.
    fn seen(centre: [f64; 3], [roll, yaw, pitch]: [f64; 3], mode: &CameraMode) -> Option<Corners> {
        let corner = |u: f64, v: f64| {
            let (x, y) = (u * roll.cos() - v * roll.sin(), u * roll.sin() + v * roll.cos());
            let (x, z) = (x * yaw.cos(), x * yaw.sin());
            let (y, z) = (y * pitch.cos() - z * pitch.sin(), y * pitch.sin() + z * pitch.cos());
            let scale = f64::from(mode.focal_length_px) / (centre[2] + z);
            let middle = [mode.width, mode.height].map(|side| (side as f64 - 1.0) / 2.0);
            [
                (middle[0] + (centre[0] + x) * scale) as f32,
                (middle[1] + (centre[1] + y) * scale) as f32,
            ]
        };
        let half = 3.5;
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        Corners::new(corners.map(|(u, v)| corner(u, v))).ok()
    }

    properties! {
        #[test]
        fn turned_panels_anywhere_in_view_are_as_far_away_as_they_are(
            depth in 20.0..100.0f64,
            x in -0.6..0.6f64,
            y in -0.45..0.45f64,
            turned in prop::array::uniform3(-0.6..0.6f64),
        ) {
            let centre = [x * depth, y * depth, depth];
            let range = centre.iter().map(|side| side * side).sum::<f64>().sqrt();
            for mode in [&QVGA, &OTHER] {
                let Some(corners) = seen(centre, turned, mode) else {
                    return Err(TestCaseError::reject("seen too small or too obliquely"));
                };
                let found = f64::from(range_pitches(&corners, mode));
                prop_assert!((found / range - 1.0).abs() < ROUNDING, "{found} of {range}");
            }
        }
    }

    /// With the mean pitch in the picture, a panel that is turned would seem too far away.
    #[test]
    fn the_mean_pitch_would_be_wrong() {
        let turned = [0.0, 0.5, 0.0];
        let corners = seen([0.0, 0.0, 30.0], turned, &QVGA).unwrap();
        let naive = QVGA.focal_length_px / corners.pitch_px();
        assert!(naive > 1.05 * 30.0, "{naive}");
        let found = range_pitches(&corners, &QVGA);
        assert!((found / 30.0 - 1.0).abs() < ROUNDING as f32, "{found}");
    }
}
