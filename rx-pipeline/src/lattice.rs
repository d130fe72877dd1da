//! An affine lattice of 8×8 spots.

use crate::corners::Corners;
use crate::parameters::search::SAME_LATTICE;
use link::panel::SIDE;

/// Where the LEDs of a panel lie, as long as its perspective is weak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// The panel's centre in pixels.
    pub centre: [f32; 2],
    /// From one LED to the next in its row.
    pub column: [f32; 2],
    /// From one LED to the next in its column.
    pub row: [f32; 2],
}

/// The middle of the panel in columns or rows.
pub(crate) const MIDDLE: f32 = (SIDE - 1) as f32 / 2.0;

impl Lattice {
    /// An upright lattice turned by `roll_rad`, its columns `across` px and its rows `down` px apart.
    pub fn turned(centre: [f32; 2], across: f32, down: f32, roll_rad: f32) -> Self {
        let (sin, cos) = (libm::sinf(roll_rad), libm::cosf(roll_rad));
        Self {
            centre,
            column: [across * cos, across * sin],
            row: [-down * sin, down * cos],
        }
    }

    /// The affine lattice that comes closest to four corner LEDs.
    pub fn through(corners: &Corners) -> Self {
        let [a, b, c, d] = corners.points();
        let last = (SIDE - 1) as f32;
        Self {
            centre: core::array::from_fn(|i| (a[i] + b[i] + c[i] + d[i]) / 4.0),
            column: core::array::from_fn(|i| (b[i] - a[i] + c[i] - d[i]) / (2.0 * last)),
            row: core::array::from_fn(|i| (d[i] - a[i] + c[i] - b[i]) / (2.0 * last)),
        }
    }

    /// The same shape around `centre`, so many times as large.
    pub fn scaled(&self, centre: [f32; 2], scale: f32) -> Self {
        Self {
            centre,
            column: self.column.map(|c| c * scale),
            row: self.row.map(|c| c * scale),
        }
    }

    /// The position of an LED, or of a place between or beyond LEDs.
    pub fn position(&self, column: f32, row: f32) -> [f32; 2] {
        let (column, row) = (column - MIDDLE, row - MIDDLE);
        core::array::from_fn(|axis| {
            self.centre[axis] + column * self.column[axis] + row * self.row[axis]
        })
    }

    /// Column and row at a position; `None` if the lattice has no area.
    pub fn coordinates(&self, at: [f32; 2]) -> Option<[f32; 2]> {
        let ([a, c], [b, d]) = (self.column, self.row);
        let determinant = a * d - b * c;
        let [x, y] = [at[0] - self.centre[0], at[1] - self.centre[1]];
        (determinant.abs() > f32::MIN_POSITIVE).then(|| {
            [
                MIDDLE + (d * x - b * y) / determinant,
                MIDDLE + (a * y - c * x) / determinant,
            ]
        })
    }

    /// The corner LEDs: top left, top right, bottom right, bottom left.
    pub fn corners(&self) -> [[f32; 2]; 4] {
        let last = (SIDE - 1) as f32;
        [[0.0, 0.0], [last, 0.0], [last, last], [0.0, last]]
            .map(|[column, row]| self.position(column, row))
    }

    /// Distance of neighbouring LEDs in a row and in a column.
    pub fn pitch(&self) -> [f32; 2] {
        [self.column, self.row].map(|[x, y]| libm::hypotf(x, y))
    }

    /// Width and height of the box around it, with so much room beyond its outer LEDs, in pitches.
    pub fn extent(&self, room: f32) -> [f32; 2] {
        let far = (SIDE - 1) as f32 + 2.0 * room;
        core::array::from_fn(|axis| far * (self.column[axis].abs() + self.row[axis].abs()))
    }

    /// Whether no corner differs by as much as [`SAME_LATTICE`] pitches.
    pub fn is_close_to(&self, other: &Self) -> bool {
        let limit = SAME_LATTICE * self.pitch()[0];
        let pairs = self.corners().into_iter().zip(other.corners());
        pairs
            .into_iter()
            .all(|(a, b)| libm::hypotf(a[0] - b[0], a[1] - b[1]) < limit)
    }
}
