//! A lattice of 8×8 spots, in perspective if that is visible.

use crate::corners::Corners;
use link::panel::SIDE;

/// Lattices are the same if no corner differs by more (pitches).
const SAME_LATTICE: f32 = 0.4;

/// The positions of a panel's LEDs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// The panel's centre in pixels.
    pub centre: [f32; 2],
    /// The step from one LED to the next in its row.
    pub column: [f32; 2],
    /// The step from one LED to the next in its column.
    pub row: [f32; 2],
    /// The growth of distance to the next LED in a row and in a column, as a share of the panel's distance: 0 if it is not measurable.
    pub tilt: [f32; 2],
}

/// The middle of the panel in columns or rows.
pub(crate) const MIDDLE: f32 = (SIDE - 1) as f32 / 2.0;

/// The least distance of a lattice's position, in distances of its middle: nearer ones are behind the camera.
const NEAREST: f32 = 0.1;

impl Lattice {
    /// An upright lattice turned by `roll_rad`, its columns `across` px and its rows `down` px apart.
    #[cfg(test)]
    pub fn turned(centre: [f32; 2], across: f32, down: f32, roll_rad: f32) -> Self {
        Self::along(centre, [across, down], (libm::sinf(roll_rad), libm::cosf(roll_rad)))
    }

    /// A lattice with these pitches along rows and along columns, whose rows have the direction of that sine and cosine.
    pub fn along(centre: [f32; 2], [across, down]: [f32; 2], (sin, cos): (f32, f32)) -> Self {
        Self {
            centre,
            column: [across * cos, across * sin],
            row: [-down * sin, down * cos],
            tilt: [0.0; 2],
        }
    }

    /// Whether the middle of another lattice is at most `pitches` pitches away.
    pub fn is_beside(&self, other: &Self, pitches: f32) -> bool {
        let [dx, dy] = core::array::from_fn(|axis| self.centre[axis] - other.centre[axis]);
        libm::hypotf(dx, dy) <= pitches * self.pitch()[0]
    }

    /// The same lattice, turned further about its middle.
    #[cfg(feature = "surroundings")]
    pub fn rolled(&self, roll_rad: f32) -> Self {
        let (sin, cos) = (libm::sinf(roll_rad), libm::cosf(roll_rad));
        let turned = |[x, y]: [f32; 2]| [cos * x - sin * y, sin * x + cos * y];
        Self {
            column: turned(self.column),
            row: turned(self.row),
            ..*self
        }
    }

    /// The lattice of four corner LEDs.
    pub fn through(corners: &Corners) -> Self {
        let [centre, column, row, tilt] = corners.homography().about_middle();
        Self { centre, column, row, tilt }
    }

    /// The same LEDs, numbered from the next corner: turned by a right angle clockwise.
    fn counted_on(&self) -> Self {
        Self {
            column: self.row,
            row: self.column.map(|c| -c),
            tilt: [self.tilt[1], -self.tilt[0]],
            ..*self
        }
    }

    /// The same LEDs, numbered from each of the four corners.
    pub fn turns(&self) -> impl Iterator<Item = Self> {
        core::iter::successors(Some(*self), |lattice| Some(lattice.counted_on())).take(4)
    }

    /// The same LEDs, numbered so that rows are turned by at most half a right angle: the image does not show which corner is the panel's
    /// first.
    pub fn most_upright(&self) -> Self {
        let upright = |lattice: &Self| lattice.column[0] + lattice.row[1];
        let best = self.turns().max_by(|a, b| upright(a).total_cmp(&upright(b)));
        best.unwrap_or(*self)
    }

    /// The same lattice elsewhere.
    #[cfg(feature = "surroundings")]
    pub fn shifted(&self, [dx, dy]: [f32; 2]) -> Self {
        let [x, y] = self.centre;
        Self {
            centre: [x + dx, y + dy],
            ..*self
        }
    }

    /// The same shape around `centre`, `scale` times as large.
    pub fn scaled(&self, centre: [f32; 2], scale: f32) -> Self {
        Self {
            centre,
            column: self.column.map(|c| c * scale),
            row: self.row.map(|c| c * scale),
            tilt: self.tilt,
        }
    }

    /// The position of an LED, or of a point between or beyond LEDs.
    pub fn position(&self, column: f32, row: f32) -> [f32; 2] {
        let (column, row) = (column - MIDDLE, row - MIDDLE);
        let nearness = 1.0 / self.distance(column, row);
        core::array::from_fn(|axis| {
            let plane = column * self.column[axis] + row * self.row[axis];
            self.centre[axis] + plane * nearness
        })
    }

    /// The distance from the camera of a point `column` and `row` LEDs off the middle, relative to that of the panel's middle.
    pub fn distance(&self, column: f32, row: f32) -> f32 {
        (1.0 + column * self.tilt[0] + row * self.tilt[1]).max(NEAREST)
    }

    /// Column and row at a position; `None` if the lattice has no area.
    pub fn coordinates(&self, at: [f32; 2]) -> Option<[f32; 2]> {
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        let leant = |step: [f32; 2], tilt: f32| [step[0] - tilt * x, step[1] - tilt * y];
        let [a, c] = leant(self.column, self.tilt[0]);
        let [b, d] = leant(self.row, self.tilt[1]);
        let determinant = a * d - b * c;
        (determinant.abs() > f32::MIN_POSITIVE).then(|| [MIDDLE + (d * x - b * y) / determinant, MIDDLE + (a * y - c * x) / determinant])
    }

    /// The corner LEDs: top left, top right, bottom right, bottom left.
    pub fn corners(&self) -> [[f32; 2]; 4] {
        let last = (SIDE - 1) as f32;
        [[0.0, 0.0], [last, 0.0], [last, last], [0.0, last]].map(|[column, row]| self.position(column, row))
    }

    /// Distance of neighbouring LEDs in a row and in a column.
    pub fn pitch(&self) -> [f32; 2] {
        [self.column, self.row].map(|[x, y]| libm::hypotf(x, y))
    }

    /// Width and height of the box around it, with a margin of `room` pitches beyond its outer LEDs.
    pub fn extent(&self, room: f32) -> [f32; 2] {
        let far = (SIDE - 1) as f32 + 2.0 * room;
        core::array::from_fn(|axis| far * (self.column[axis].abs() + self.row[axis].abs()))
    }

    /// Whether all corners differ by less than [`SAME_LATTICE`] pitches, whichever corner LEDs are numbered from.
    pub fn is_close_to(&self, other: &Self) -> bool {
        let limit = SAME_LATTICE * self.pitch()[0];
        let (here, there) = (self.corners(), other.corners());
        let is_near = |[a, b]: [[f32; 2]; 2]| libm::hypotf(a[0] - b[0], a[1] - b[1]) < limit;
        (0..4).any(|turns| (0..4).all(|corner| is_near([here[corner], there[(corner + turns) % 4]])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn leds_numbered_from_another_corner_are_the_same(
            roll in -3.2f32..3.2, steps in prop::array::uniform2(3.0f32..9.0), tilt in prop::array::uniform2(-0.02f32..0.02),
        ) {
            let lattice = Lattice { tilt, ..Lattice::turned([40.0, 50.0], steps[0], steps[1], roll) };
            let upright = lattice.most_upright();
            let roll = libm::atan2f(upright.column[1], upright.column[0]);
            prop_assert!(roll.abs() <= core::f32::consts::FRAC_PI_4 + 1e-5);
            for (a, turned) in lattice.corners().into_iter().zip(lattice.counted_on().corners().into_iter().cycle().skip(3)) {
                prop_assert!(libm::hypotf(a[0] - turned[0], a[1] - turned[1]) < 1e-3);
            }
            prop_assert!(upright.is_close_to(&lattice) && lattice.is_close_to(&upright));
            let beside = Lattice { centre: upright.position(MIDDLE + 1.0, MIDDLE), ..upright };
            prop_assert!(!beside.is_close_to(&lattice));
        }

        #[test]
        fn a_lattice_through_corners_is_their_homography(jitter in prop::array::uniform8(-6.0f32..6.0)) {
            let square = [[10.0, 10.0], [66.0, 10.0], [66.0, 66.0], [10.0, 66.0]];
            let points = core::array::from_fn(|i| {
                let [x, y]: [f32; 2] = square[i];
                [x + jitter[2 * i], y + jitter[2 * i + 1]]
            });
            let corners = Corners::new(points).unwrap();
            let (lattice, homography) = (Lattice::through(&corners), corners.homography());
            for led in 0..64 {
                let [column, row] = [led % 8, led / 8].map(|c| c as f32);
                let [x, y] = lattice.position(column, row);
                let truth = homography.to_image([f64::from(column), f64::from(row)]);
                prop_assert!((f64::from(x) - truth[0]).abs() < 1e-3 && (f64::from(y) - truth[1]).abs() < 1e-3);
                let back = lattice.coordinates([x, y]).unwrap();
                prop_assert!((back[0] - column).abs() < 1e-3 && (back[1] - row).abs() < 1e-3);
            }
        }
    }
}
