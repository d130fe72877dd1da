//! The part of a frame in use: within a quadrilateral.

use super::lattice_model::LatticeModel;
use super::window::Window;
use crate::lattice::Lattice;
use core::ops::Range;
use link::panel::SIDE;

/// The reach of light across a board's end (standard deviations of a spot): a single frame is used only up to that much less than half a
/// pitch beyond the outer LEDs. More: surroundings of a board without a margin disturb less, and less is seen.
const CARRIED: f32 = 0.8;

/// A convex quadrilateral in the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outline([[f32; 2]; 4]);

impl Outline {
    /// The area of a panel alone: its board may end half a pitch beyond the outer LEDs, and blur carries light across.
    pub fn of(spots: &LatticeModel) -> Self {
        let [across, down] = spots.lattice.pitch();
        let spill = CARRIED * spots.sigma / across.min(down);
        Self::around(&spots.lattice, (0.5 - spill).max(0.0))
    }

    /// The area of a panel up to `margin` pitches beyond its outer LEDs.
    pub fn around(lattice: &Lattice, margin: f32) -> Self {
        let far = (SIDE - 1) as f32 + margin;
        let corners = [[-margin, -margin], [far, -margin], [far, far], [-margin, far]];
        Self(corners.map(|[column, row]| lattice.position(column, row)))
    }

    /// The columns of `window`, counted from its first one, that lie within in row `y` of the frame.
    pub fn span(&self, y: usize, window: Window) -> Range<usize> {
        let y = y as f32;
        let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
        for (i, &[x0, y0]) in self.0.iter().enumerate() {
            let [x1, y1] = self.0[(i + 1) % 4];
            if (y0 <= y) != (y1 <= y) {
                let x = x0 + (y - y0) / (y1 - y0) * (x1 - x0);
                (left, right) = (left.min(x), right.max(x));
            }
        }
        // A cast of a negative number is 0.
        let first = libm::ceilf(left - window.x as f32) as usize;
        let end = (libm::floorf(right - window.x as f32) + 1.0) as usize;
        let end = end.min(window.width);
        first.min(end)..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_holds_the_pixels_within() {
        let lattice = Lattice::turned([50.0, 40.0], 4.0, 4.0, 0.1);
        let outline = Outline::around(&lattice, 0.4);
        let window = Window {
            x: 20,
            y: 10,
            width: 60,
            height: 60,
        };
        for y in 10..70 {
            let span = outline.span(y, window);
            for x in 0..60 {
                let at = [(20 + x) as f32, y as f32];
                let [column, row] = lattice.coordinates(at).unwrap();
                let within = [column, row].iter().all(|c| (-0.4..7.4).contains(c));
                assert_eq!(span.contains(&x), within, "{at:?}");
            }
        }
    }

    #[test]
    fn nothing_is_within_outside_the_window() {
        let outline = Outline::around(&Lattice::turned([50.0, 40.0], 4.0, 4.0, 0.0), 0.4);
        let window = |x| Window {
            x,
            y: 0,
            width: 10,
            height: 60,
        };
        assert!(outline.span(40, window(0)).is_empty());
        assert!(outline.span(40, window(90)).is_empty());
        assert!(outline.span(5, window(50)).is_empty());
    }
}
