//! Places names next to their points without overlaps.

use super::paper::width_px;
use super::{Box, meet};

/// Font size of labels.
pub const LABEL_PX: i32 = 11;

/// Label placement on a surface.
pub struct Labels {
    within: Box,
    taken: Vec<Box>,
    drawn: Vec<(i32, i32)>,
}

/// Position of a label.
pub struct Placement {
    /// The top left corner.
    pub corner: (i32, i32),
    /// End of the leader line, if the label is too far from its point to do without.
    pub leader: Option<(i32, i32)>,
}

/// Height of a label.
const LINE_PX: i32 = 13;
/// Distance between a label and its mark.
const APART_PX: i32 = 3;

impl Labels {
    /// Labels within a rectangle that must not overlap `taken`, and should cover few of the pixels `drawn`.
    pub fn new(within: Box, taken: Vec<Box>, drawn: Vec<(i32, i32)>) -> Self {
        Self { within, taken, drawn }
    }

    /// A position for the label of the point `at` with a mark of radius `reach`; `None` if there is no space near it.
    pub fn place(&mut self, text: &str, at: (i32, i32), reach: i32) -> Option<Placement> {
        let apart = reach + APART_PX;
        let width = width_px(text, LABEL_PX);
        let (x, y) = at;
        let middle = y - LINE_PX / 2;
        let (right, left) = (x + apart, x - apart - width);
        let (above, below) = (y - apart - LINE_PX, y + apart);
        let centre = x - width / 2;
        let near = [
            (right, middle),
            (left, middle),
            (centre, above),
            (centre, below),
            (right, above),
            (right, below),
            (left, above),
            (left, below),
        ];
        // At this distance from its mark, a label needs a leader line.
        let farther = near.map(|(left, top)| (left + (left - x).signum() * 10, top + 16 * (top - middle).signum()));
        let label = |&(left, top): &(i32, i32)| [left, top, left + width, top + LINE_PX];
        let free = near.into_iter().chain(farther).filter(|corner| {
            let label = label(corner);
            self.holds(label) && !self.taken.iter().any(|&other| meet(label, other))
        });
        let (left, top) = free.min_by_key(|corner| self.covered(label(corner)))?;
        let label = [left, top, left + width, top + LINE_PX];
        self.taken.push(label);
        let nearest = (x.clamp(label[0], label[2]), y.clamp(label[1], label[3]));
        let is_far = (nearest.0 - x).abs().max((nearest.1 - y).abs()) > apart + 1;
        Some(Placement {
            corner: (left, top),
            leader: is_far.then_some(nearest),
        })
    }

    /// Number of drawn pixels that a label would cover.
    fn covered(&self, label: Box) -> usize {
        let drawn = self.drawn.iter();
        drawn.filter(|&&(x, y)| meet(label, [x - 1, y - 1, x + 1, y + 1])).count()
    }

    fn holds(&self, [left, top, right, bottom]: Box) -> bool {
        let within = self.within;
        left >= within[0] && top >= within[1] && right <= within[2] && bottom <= within[3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_cover_neither_each_other_nor_points_nor_the_edge() {
        let point = [45, 45, 55, 55];
        let width = width_px("name", LABEL_PX);
        assert!((15..45).contains(&width), "{width}");
        let mut labels = Labels::new([0, 0, 200, 100], vec![point], vec![(70, 50); 3]);
        let first = labels.place("name", (50, 50), 4).expect("room");
        assert!(first.corner.0 < 50, "a line runs to the right: {:?}", first.corner);
        let mut labels = Labels::new([0, 0, 200, 100], vec![point], Vec::new());
        let (mut placed, mut far) = (Vec::new(), 0);
        while let Some(Placement { corner, leader }) = labels.place("name", (50, 50), 4) {
            let (left, top) = corner;
            far += usize::from(leader.is_some());
            placed.push([left, top, left + width, top + LINE_PX]);
        }
        assert!(placed.len() >= 4 && far < placed.len(), "{placed:?}");
        for (k, &label) in placed.iter().enumerate() {
            assert!(!meet(label, point) && labels.holds(label));
            assert!(!placed[..k].iter().any(|&other| meet(label, other)));
        }
    }
}
