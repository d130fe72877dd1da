//! Where names can stand beside their points without covering each other.

use super::paper::width_px;
use super::{Box, meet};

/// The size of labels.
pub const LABEL_PX: i32 = 11;

/// Places for labels on a surface.
pub struct Labels {
    within: Box,
    taken: Vec<Box>,
    drawn: Vec<(i32, i32)>,
}

/// Where a label stands.
pub struct Placement {
    /// Its top left corner.
    pub corner: (i32, i32),
    /// Where a line from its point meets it, if it is so far from there that one is needed.
    pub leader: Option<(i32, i32)>,
}

/// The height of a line.
const LINE_PX: i32 = 13;
/// How far from its mark a label stands.
const APART_PX: i32 = 3;

impl Labels {
    /// For labels within a rectangle that must not cover what is `taken`, and should cover few of the pixels that are `drawn`.
    pub fn new(within: Box, taken: Vec<Box>, drawn: Vec<(i32, i32)>) -> Self {
        Self { within, taken, drawn }
    }

    /// A place for a label of the point at `at`, whose mark reaches so far, or none where there is no room near it.
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
        // So far from its mark, whose name it is has to be shown.
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

    /// How much of what is drawn a label would cover.
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
