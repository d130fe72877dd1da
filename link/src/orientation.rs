//! Orientation: the eight ways in which a picture may show a panel.

use crate::panel::{LEDS, SIDE};

/// A panel's orientation in a picture: one of the eight symmetries of the square.
///
/// ```
/// use link::orientation::Orientation;
/// use link::panel::PanelFrame;
/// // Its top left LED alone is On; a quarter turn clockwise takes it to the top right.
/// let quarter = Orientation::new(1, false);
/// let seen = PanelFrame::from_bits(1).seen(quarter);
/// assert!(seen.is_on(0, 7));
/// assert_eq!(seen.upright(quarter), PanelFrame::from_bits(1));
/// assert_eq!(quarter.to_string(), "turned by 90° clockwise");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Orientation {
    quarter_turns: u8,
    is_mirrored: bool,
}

impl Orientation {
    /// Upright.
    pub const UPRIGHT: Self = Self::new(0, false);
    /// Upright, the three rotations, and their mirror images.
    pub const ALL: [Self; 8] = [
        Self::UPRIGHT,
        Self::new(1, false),
        Self::new(2, false),
        Self::new(3, false),
        Self::new(0, true),
        Self::new(1, true),
        Self::new(2, true),
        Self::new(3, true),
    ];

    /// A panel turned clockwise by `quarter_turns` right angles; if it `is_mirrored`, left and right are exchanged first.
    pub const fn new(quarter_turns: u8, is_mirrored: bool) -> Self {
        Self {
            quarter_turns: quarter_turns % 4,
            is_mirrored,
        }
    }

    /// Its clockwise rotation in right angles, 0 to 3.
    pub const fn quarter_turns(self) -> u8 {
        self.quarter_turns
    }

    /// Its clockwise rotation in degrees: 0, 90, 180 or 270.
    pub const fn turned_deg(self) -> u32 {
        90 * self.quarter_turns as u32
    }

    /// Whether the picture is a mirror image.
    pub const fn is_mirrored(self) -> bool {
        self.is_mirrored
    }

    /// The rotation to undo in readings of such a picture: none for a mirror image, which is reported as seen.
    pub fn turn(self) -> Self {
        if self.is_mirrored { Self::default() } else { self }
    }

    /// The position, 8·row + column of the picture, of LED `led` (0 to 63).
    pub const fn place_of(self, led: usize) -> usize {
        let last = SIDE - 1;
        let (row, column) = (led % LEDS / SIDE, led % SIDE);
        let column = if self.is_mirrored { last - column } else { column };
        let (row, column) = match self.quarter_turns {
            0 => (row, column),
            1 => (column, last - row),
            2 => (last - row, last - column),
            _ => (last - column, row),
        };
        SIDE * row + column
    }
}

impl core::fmt::Display for Orientation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match (self.quarter_turns, self.is_mirrored) {
            (0, false) => "upright",
            (1, false) => "turned by 90° clockwise",
            (2, false) => "upside down",
            (_, false) => "turned by 90° anticlockwise",
            (0, true) => "mirrored",
            (1, true) => "mirrored and turned by 90° clockwise",
            (2, true) => "mirrored and upside down",
            (_, true) => "mirrored and turned by 90° anticlockwise",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eight_are_all_symmetries_of_the_square() {
        let is_neighbour = |a: usize, b: usize| (a / SIDE).abs_diff(b / SIDE) + (a % SIDE).abs_diff(b % SIDE) == 1;
        let mut corners = std::collections::BTreeSet::new();
        for orientation in Orientation::ALL {
            let mut seen = [false; LEDS];
            for led in 0..LEDS {
                let place = orientation.place_of(led);
                assert!(!core::mem::replace(&mut seen[place], true), "{orientation}");
                for other in (0..LEDS).filter(|&other| is_neighbour(led, other)) {
                    assert!(is_neighbour(place, orientation.place_of(other)), "{orientation}");
                }
            }
            corners.insert([0, SIDE - 1].map(|led| orientation.place_of(led)));
        }
        assert_eq!(corners.len(), Orientation::ALL.len());
    }

    #[test]
    fn turns_are_clockwise_and_follow_the_mirror() {
        // The positions in the picture of the panel's top left and top right LED.
        let top = |turns, is_mirrored| [0, 7].map(|led| Orientation::new(turns, is_mirrored).place_of(led));
        assert_eq!(top(1, false), [7, 63]);
        assert_eq!(top(2, false), [63, 56]);
        assert_eq!(top(3, false), [56, 0]);
        assert_eq!(top(0, true), [7, 0]);
        assert_eq!(top(1, true), [63, 7]);
    }

    #[test]
    fn they_have_names() {
        let names = Orientation::ALL.map(|orientation| orientation.to_string());
        assert_eq!(names[0], "upright");
        assert_eq!(names[2], "upside down");
        assert_eq!(names[3], "turned by 90° anticlockwise");
        assert_eq!(names[4], "mirrored");
        assert_eq!(names[6], "mirrored and upside down");
    }
}
