//! The place of a panel, in 1/65 536 of a pixel.

use crate::corners::Corners;
use link::panel::SIDE;

/// Steps from the first LED of a row to the last.
pub const STEPS: i32 = SIDE as i32 - 1;
/// One pixel in units of a position: 65 536.
pub const PIXEL: i32 = 1 << 16;

/// A point or a vector in the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Point {
    pub x: i32,
    pub y: i32,
}

impl Point {
    pub fn plus(self, other: Self) -> Self {
        Self {
            x: self.x.wrapping_add(other.x),
            y: self.y.wrapping_add(other.y),
        }
    }

    pub fn minus(self, other: Self) -> Self {
        Self {
            x: self.x.wrapping_sub(other.x),
            y: self.y.wrapping_sub(other.y),
        }
    }

    pub fn over(self, divisor: i32) -> Self {
        Self {
            x: self.x / divisor,
            y: self.y / divisor,
        }
    }

    /// `share`/256 of the vector.
    pub fn share(self, share: i32) -> Self {
        let part = |at: i32| (i64::from(at) * i64::from(share) / 256) as i32;
        Self {
            x: part(self.x),
            y: part(self.y),
        }
    }
}

/// A panel's corner LEDs: top left, top right, bottom right, bottom left. Other points are interpolated between them, which is right except
/// for the perspective of a panel that is very near and rotated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outline(pub [Point; 4]);

impl Outline {
    /// The outline of corners in pixels, in a frame of up to 8191 pixels a side.
    pub fn of(corners: &Corners) -> Self {
        let whole = |at: f32| (at.clamp(-8191.0, 8191.0) * PIXEL as f32) as i32;
        Self(corners.points().map(|[x, y]| Point { x: whole(x), y: whole(y) }))
    }

    /// The corners in pixels; `None` if they are not a panel's.
    pub fn corners(&self) -> Option<Corners> {
        let pixels = |at: i32| at as f32 / PIXEL as f32;
        Corners::new(self.0.map(|point| [pixels(point.x), pixels(point.y)])).ok()
    }

    /// The centre of an LED.
    pub fn led(&self, column: usize, row: usize) -> Point {
        let weights = weights(column as i32, row as i32);
        let mixed = |of: fn(&Point) -> i32| {
            let sum: i64 = self
                .0
                .iter()
                .zip(weights)
                .map(|(corner, weight)| i64::from(of(corner)) * i64::from(weight))
                .sum();
            (sum / i64::from(STEPS * STEPS)) as i32
        };
        Point {
            x: mixed(|point| point.x),
            y: mixed(|point| point.y),
        }
    }

    /// The vectors from one LED to the next along a row and along a column; means over the panel.
    pub fn steps(&self) -> [Point; 2] {
        let [top_left, top_right, bottom_right, bottom_left] = self.0;
        let mean = |a: Point, b: Point, c: Point, d: Point| a.minus(b).over(2 * STEPS).plus(c.minus(d).over(2 * STEPS));
        [
            mean(top_right, top_left, bottom_right, bottom_left),
            mean(bottom_left, top_left, bottom_right, top_right),
        ]
    }
}

/// The weights of the corners at an LED; their sum is 49.
pub fn weights(column: i32, row: i32) -> [i32; 4] {
    let (right, below) = (column, row);
    let (left, above) = (STEPS - column, STEPS - row);
    [left * above, right * above, right * below, left * below]
}
