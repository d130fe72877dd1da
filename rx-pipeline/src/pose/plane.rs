//! The image of a plane: eight numbers, as a lattice in perspective.

use nalgebra::{SMatrix, SVector};

use super::Lens;
use crate::corners::Corners;

/// The image of the panel's plane in directions (x, y, 1) of the camera.
///
/// The place (u, v) of the panel, from −1 at the first line of LEDs to 1 at the last, has the direction
/// `centre + (u·column + v·row)/(1 + u·tilt[0] + v·tilt[1])`: a homography, in parameters that stay well conditioned at any distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneImage {
    /// The direction of the panel's middle.
    pub centre: [f64; 2],
    /// The step from the middle to the last column.
    pub column: [f64; 2],
    /// The step from the middle to the last row.
    pub row: [f64; 2],
    /// The relative increase of depth from the middle to the last column and to the last row.
    pub tilt: [f64; 2],
}

/// The number of parameters of a [`PlaneImage`].
pub(super) const PLANE: usize = 8;
/// The parameters, in the order of its fields.
pub(super) type Vector8 = SVector<f64, PLANE>;
/// Their information.
pub(super) type Matrix8 = SMatrix<f64, PLANE, PLANE>;

impl PlaneImage {
    /// The plane through four corner LEDs; `None` if the lens model has no direction for one of them.
    pub(super) fn through(corners: &Corners, lens: &Lens) -> Option<Self> {
        let [p00, p10, p11, p01] = corners.points().map(|point| lens.ray(point.map(f64::from)));
        let [p00, p10, p11, p01] = [p00?, p10?, p11?, p01?];
        // Heckbert 1989, section 2.2.3, for the square from (0, 0) to (1, 1).
        let side = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let (d1, d2) = (side(p10, p11), side(p01, p11));
        let sum = [0, 1].map(|i| p00[i] - p10[i] + p11[i] - p01[i]);
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let determinant = cross(d1, d2);
        let (g, h) = (cross(sum, d2) / determinant, cross(d1, sum) / determinant);
        // The same about the middle: U = (u + 1)/2, V = (v + 1)/2.
        let middle = 1.0 + (g + h) / 2.0;
        let (g, h) = (g / 2.0 / middle, h / 2.0 / middle);
        let across = [0, 1].map(|i| p10[i] - p00[i] + 2.0 * g * middle * p10[i]);
        let down = [0, 1].map(|i| p01[i] - p00[i] + 2.0 * h * middle * p01[i]);
        let centre = [0, 1].map(|i| (p00[i] + (across[i] + down[i]) / 2.0) / middle);
        let plane = Self {
            centre,
            column: [0, 1].map(|i| across[i] / 2.0 / middle - g * centre[i]),
            row: [0, 1].map(|i| down[i] / 2.0 / middle - h * centre[i]),
            tilt: [g, h],
        };
        plane.vector().iter().all(|c| c.is_finite()).then_some(plane)
    }

    pub(super) fn vector(&self) -> Vector8 {
        let [[a, b], [c, d], [e, f], [g, h]] = [self.centre, self.column, self.row, self.tilt];
        Vector8::from([a, b, c, d, e, f, g, h])
    }

    pub(super) fn of_vector(vector: &Vector8) -> Self {
        let [a, b, c, d, e, f, g, h] = vector.data.0[0];
        Self {
            centre: [a, b],
            column: [c, d],
            row: [e, f],
            tilt: [g, h],
        }
    }

    /// The direction of a place.
    pub fn direction(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let nearness = 1.0 / self.depth([u, v]);
        core::array::from_fn(|i| self.centre[i] + (u * self.column[i] + v * self.row[i]) * nearness)
    }

    /// The depth of a place, relative to that of the middle.
    pub(super) fn depth(&self, [u, v]: [f64; 2]) -> f64 {
        1.0 + u * self.tilt[0] + v * self.tilt[1]
    }

    /// The derivatives of a place's direction by the eight numbers: two rows.
    pub(super) fn slopes(&self, [u, v]: [f64; 2]) -> [[f64; PLANE]; 2] {
        let nearness = 1.0 / self.depth([u, v]);
        [0, 1].map(|i| {
            let plane = (u * self.column[i] + v * self.row[i]) * nearness * nearness;
            let mut slopes = [0.0; PLANE];
            slopes[i] = 1.0;
            slopes[2 + i] = u * nearness;
            slopes[4 + i] = v * nearness;
            slopes[6] = -u * plane;
            slopes[7] = -v * plane;
            slopes
        })
    }

    /// A unit for each of its numbers, so that they are of similar size.
    pub(super) fn units(&self) -> [f64; PLANE] {
        let scale = self.scale();
        core::array::from_fn(|i| if i < 6 { scale } else { 1.0 })
    }

    /// Its size: the root of half the area that its quarter covers.
    pub(super) fn scale(&self) -> f64 {
        let [[a, b], [c, d]] = [self.column, self.row];
        libm::sqrt((a * d - b * c).abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn corners_are_seen_where_they_are(jitter in prop::array::uniform8(-6.0f32..6.0)) {
            let square = [[10.0, 10.0], [66.0, 10.0], [66.0, 66.0], [10.0, 66.0]];
            let points: [[f32; 2]; 4] = core::array::from_fn(|i| {
                let [x, y]: [f32; 2] = square[i];
                [x + jitter[2 * i], y + jitter[2 * i + 1]]
            });
            let lens = Lens::pinhole(500.0, [80, 80]);
            let plane = PlaneImage::through(&Corners::new(points).unwrap(), &lens).unwrap();
            for (place, point) in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].into_iter().zip(points) {
                let pixel = lens.pixel(plane.direction(place));
                prop_assert!((pixel[0] - f64::from(point[0])).abs() < 1e-9 && (pixel[1] - f64::from(point[1])).abs() < 1e-9);
            }
            let place = [0.3, -0.8];
            let slopes = plane.slopes(place);
            for number in 0..8 {
                let mut moved = plane.vector();
                moved[number] += 1e-6;
                let there = PlaneImage::of_vector(&moved).direction(place);
                for axis in 0..2 {
                    let slope = (there[axis] - plane.direction(place)[axis]) / 1e-6;
                    prop_assert!((slope - slopes[axis][number]).abs() < 1e-5);
                }
            }
        }
    }
}
