//! Finds overlapping boxes.

use glam::DVec2;

/// An axis-aligned rectangle: its lowest corner and its highest one.
pub type Box2 = [DVec2; 2];

/// Reports each pair of boxes that share more than an edge. The sweep from left to right takes the time of sorting plus that of the pairs
/// that overlap along x.
pub(crate) fn for_each_meeting(boxes: &[Box2], mut met: impl FnMut(usize, usize)) {
    let mut rightwards: Vec<usize> = (0..boxes.len()).collect();
    rightwards.sort_by(|&a, &b| boxes[a][0].x.total_cmp(&boxes[b][0].x));
    for (place, &left) in rightwards.iter().enumerate() {
        let [low, high] = boxes[left];
        let reached = |&&right: &&usize| boxes[right][0].x < high.x;
        for &right in rightwards[place + 1..].iter().take_while(reached) {
            if low.cmplt(boxes[right][1]).all() && boxes[right][0].y < high.y {
                met(left, right);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pairs_are_those_that_comparing_all_with_all_finds() {
        let mut state = 1u64;
        let mut number = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 59) as f64
        };
        for count in [0, 1, 2, 5, 60] {
            let boxes: Vec<Box2> = (0..count)
                .map(|_| {
                    let low = DVec2::new(number(), number());
                    [low, low + DVec2::new(number(), number()) / 4.0]
                })
                .collect();
            let meet = |a: Box2, b: Box2| a[0].cmplt(b[1]).all() && b[0].cmplt(a[1]).all();
            let mut all: Vec<_> = (0..count)
                .flat_map(|a| (0..a).map(move |b| (b, a)))
                .filter(|&(a, b)| meet(boxes[a], boxes[b]))
                .collect();
            let mut found = Vec::new();
            for_each_meeting(&boxes, |a, b| found.push((a.min(b), a.max(b))));
            all.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, all);
            assert!(count < 60 || !found.is_empty());
        }
    }
}
