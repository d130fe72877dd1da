//! Two clusters in the plane of two features (Lloyd's algorithm).

use super::detection::bits_where;
use super::error::{DetectError, two_classes};
use super::standardise::sum;
use link::panel::{LEDS, PanelFrame};

/// Rounds of Lloyd's algorithm, at most (count): it ends when no cell changes sides, which has always taken far fewer with 64 cells in two
/// groups.
const KMEANS_ROUNDS: usize = 32;

/// A point in the plane of AGR and GRI.
type Point = [f32; 2];
/// 1 for each cell of the group On, 0 for the others: a number, so that sums over a group need no branch.
type Group = [f32; LEDS];

/// The cells of the cluster of higher features. The clusters start from the cells of lowest and highest GRI, and among equals of lowest and
/// highest AGR.
#[inline(always)]
pub(super) fn split(agr: &[f32; LEDS], gri: &[f32; LEDS]) -> Result<PanelFrame, DetectError> {
    let by_gri = |&a: &usize, &b: &usize| gri[a].total_cmp(&gri[b]).then(agr[a].total_cmp(&agr[b]));
    let cell = |index: Option<usize>| index.map_or([0.0; 2], |cell| [agr[cell], gri[cell]]);
    let mut off = cell((0..LEDS).min_by(by_gri));
    let mut on = cell((0..LEDS).max_by(by_gri));
    let mut group = nearer_to(agr, gri, on, off);
    for _ in 0..KMEANS_ROUNDS {
        two_classes(bits(&group))?;
        on = centroid(agr, gri, &group);
        off = centroid(agr, gri, &group.map(|member| 1.0 - member));
        let next = nearer_to(agr, gri, on, off);
        if next == group {
            break;
        }
        group = next;
    }
    let bits = two_classes(bits(&group))?;
    let brightness = |[agr, gri]: Point| agr + gri;
    Ok(if brightness(on) >= brightness(off) {
        bits
    } else {
        PanelFrame::from_bits(!bits.bits())
    })
}

#[inline(always)]
fn nearer_to(agr: &[f32; LEDS], gri: &[f32; LEDS], on: Point, off: Point) -> Group {
    let distance = |cell: usize, point: Point| {
        let (a, b) = (agr[cell] - point[0], gri[cell] - point[1]);
        a * a + b * b
    };
    core::array::from_fn(|cell| if distance(cell, on) < distance(cell, off) { 1.0 } else { 0.0 })
}

/// The mean of a group's cells, at least one.
#[inline(always)]
fn centroid(agr: &[f32; LEDS], gri: &[f32; LEDS], group: &Group) -> Point {
    let count = sum(group);
    [agr, gri].map(|feature| sum(&core::array::from_fn(|cell| group[cell] * feature[cell])) / count)
}

fn bits(group: &Group) -> PanelFrame {
    bits_where(|cell| group[cell] > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_settle_where_no_cell_changes_sides() {
        // One outlier as the first centre: the bright group must still be found whole.
        let gri = core::array::from_fn(|cell| match cell {
            0 => 90.0,
            1..20 => 50.0,
            _ => 0.0,
        });
        assert_eq!(split(&[1.0; LEDS], &gri).unwrap().bits(), (1 << 20) - 1);
    }

    #[test]
    fn equal_cells_are_no_clusters() {
        assert_eq!(split(&[1.0; LEDS], &[2.0; LEDS]), Err(DetectError::OneClass { on: 0 }));
    }
}
