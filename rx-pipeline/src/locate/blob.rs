//! The size of the object at a peak of the survey.

use super::survey::Peak;
use crate::frame::Frame;
use core::ops::RangeInclusive;
use heapless::Vec;

/// Cells along one side of the neighbourhood, at most 64 (count). More: larger panels, and more time for each peak.
const CELLS: usize = 48;
/// Side of a cell (px). Larger: larger panels, and less precise sizes of small ones.
const CELL_PX: usize = 4;
/// Thresholds of a cell of the blob, tried one after another (share of the busiest cell's excess over the noise). In clutter only a high
/// share isolates a panel; in a large panel only a low one joins its LEDs.
const SHARES: [f32; 4] = [0.1, 0.2, 0.35, 0.55];
/// The least threshold (multiple of the median cell). Higher: faint panels are lost; lower: noise joins the blob.
const LEAST_OVER_MEDIAN: f32 = 2.0;
/// Maximum distance of the busiest cell from a peak (cells). Farther: a brighter neighbour may replace it.
const NEAR: usize = 4;
/// Reach of the first difference that makes a cell busy (px). Longer: tuned to larger LEDs.
const REACH: usize = 2;
/// The excess width of a blob by spilled light and by the smoothing of cells (px). More: smaller panels are assumed.
const SPILL_PX: f32 = 6.0;
/// Sides of the smallest and of the largest panel in the search (px). Wider: more false candidates are tried.
pub(super) const SIDE_PX: RangeInclusive<f32> = 14.0..=110.0;
/// The least ratio of sides of two different blobs. Higher: fewer sizes are tried.
const DISTINCT: f32 = 1.25;

/// A connected patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Blob {
    /// Its centre of gravity in pixels.
    pub centre: [f32; 2],
    /// The side of a square with the same spread, in pixels.
    pub side_px: f32,
}

type Cells = [[f32; CELLS]; CELLS];

impl Blob {
    /// The connected cells around `peak` that have changed since `earlier`, or that are busy if there is no earlier frame, by rising
    /// thresholds: the largest first.
    pub fn around(peak: &Peak, frame: &Frame<'_>, earlier: Option<&Frame<'_>>) -> Vec<Self, 4> {
        let half = (CELLS * CELL_PX / 2) as i32;
        let origin = peak.centre.map(|c| c as i32 - half);
        let mut energy = [[0.0f32; CELLS]; CELLS];
        for (j, row) in energy.iter_mut().enumerate() {
            for (i, cell) in row.iter_mut().enumerate() {
                let (x, y) = (origin[0] + (CELL_PX * i) as i32, origin[1] + (CELL_PX * j) as i32);
                *cell = match earlier {
                    Some(earlier) => changed(frame, earlier, x, y),
                    None => busy(frame, x, y),
                };
            }
        }
        let energy = smoothed(&energy);
        let noise = median(&energy);
        let near = CELLS / 2 - NEAR..CELLS / 2 + NEAR;
        let (mut highest, mut place) = (0.0, (0, 0));
        for (j, row) in energy.iter().enumerate().filter(|(j, _)| near.contains(j)) {
            for (i, &value) in row.iter().enumerate().filter(|(i, _)| near.contains(i)) {
                if value > highest {
                    (highest, place) = (value, (i, j));
                }
            }
        }
        let mut blobs: Vec<Self, 4> = Vec::new();
        for share in SHARES {
            let threshold = (noise + share * (highest - noise)).max(LEAST_OVER_MEDIAN * noise);
            if highest <= threshold {
                break;
            }
            let blob = Self::of(&connected(&energy, threshold, place), origin);
            let distinct = blobs.iter().all(|other| other.side_px > DISTINCT * blob.side_px);
            if blob.side_px <= *SIDE_PX.end() && distinct {
                // The capacity is one for each share.
                let _full = blobs.push(blob);
            }
        }
        blobs
    }

    fn of(patch: &[u64; CELLS], origin: [i32; 2]) -> Self {
        let (mut count, mut sum, mut squares) = (0.0, [0.0; 2], 0.0);
        for (j, bits) in patch.iter().enumerate() {
            for i in (0..CELLS).filter(|i| bits >> i & 1 == 1) {
                count += 1.0;
                for (sum, place) in sum.iter_mut().zip([i as f32, j as f32]) {
                    *sum += place;
                    squares += place * place;
                }
            }
        }
        let mean = sum.map(|sum| sum / f32::max(count, 1.0));
        let variance = squares / f32::max(count, 1.0) - mean[0] * mean[0] - mean[1] * mean[1];
        let middle = (CELL_PX - 1) as f32 / 2.0;
        // An evenly filled square of side s has the variance s²/12 along each axis, and so has the cell itself.
        let side_px = CELL_PX as f32 * libm::sqrtf(6.0 * variance.max(0.0) + 1.0) - SPILL_PX;
        Self {
            centre: core::array::from_fn(|axis| origin[axis] as f32 + CELL_PX as f32 * mean[axis] + middle),
            side_px: side_px.max(*SIDE_PX.start()),
        }
    }
}

/// Squared difference of a cell's means.
fn changed(frame: &Frame<'_>, earlier: &Frame<'_>, x: i32, y: i32) -> f32 {
    let difference = sum(frame, x, y) - sum(earlier, x, y);
    (difference * difference) as f32 / 256.0
}

fn sum(frame: &Frame<'_>, x: i32, y: i32) -> i32 {
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
        return 0;
    };
    let rows = (y..y + CELL_PX).filter_map(|y| frame.row(y)?.get(x..x + CELL_PX));
    rows.flatten().map(|&grey| i32::from(grey)).sum()
}

/// The lesser of the squared first differences over four pixels along both axes, of the squares of grey levels, which are about light.
fn busy(frame: &Frame<'_>, x: i32, y: i32) -> f32 {
    let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
        return 0.0;
    };
    let (mut along, mut down) = (0, 0);
    let light = |grey: u8| i32::from(grey) * i32::from(grey) / 256;
    for y in y..y + CELL_PX {
        let (Some(above), Some(here), Some(below)) = (y.checked_sub(REACH).and_then(|y| frame.row(y)), frame.row(y), frame.row(y + REACH))
        else {
            continue;
        };
        for x in x.max(REACH)..(x + CELL_PX).min(frame.width().saturating_sub(REACH)) {
            let across = light(here[x + REACH]) - light(here[x - REACH]);
            let upright = light(below[x]) - light(above[x]);
            along += across * across;
            down += upright * upright;
        }
    }
    along.min(down) as f32 / 16.0
}

/// Means over 3×3 cells.
fn smoothed(cells: &Cells) -> Cells {
    core::array::from_fn(|j| {
        core::array::from_fn(|i| {
            let near = |c: usize| c.saturating_sub(1)..(c + 2).min(CELLS);
            near(j).map(|v| cells[v][near(i)].iter().sum::<f32>()).sum::<f32>() / 9.0
        })
    })
}

/// The median of every fourth cell.
fn median(cells: &Cells) -> f32 {
    let mut sample = [0.0; CELLS * CELLS / 4];
    let from = cells.iter().step_by(2).flat_map(|row| row.iter().step_by(2));
    for (to, &from) in sample.iter_mut().zip(from) {
        *to = from;
    }
    let middle = sample.len() / 2;
    *sample.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// The cells above the threshold that are connected to (`x`, `y`), with gaps of at most one cell.
fn connected(cells: &Cells, threshold: f32, (x, y): (usize, usize)) -> [u64; CELLS] {
    let above = |row: &[f32; CELLS]| (0..CELLS).fold(0, |bits, i| bits | u64::from(row[i] > threshold) << i);
    let bits = cells.each_ref().map(above);
    let mut patch = [0u64; CELLS];
    patch[y] = 1 << x & bits[y];
    loop {
        let before = patch;
        for y in 0..CELLS {
            let near = patch[y.saturating_sub(2)..(y + 3).min(CELLS)]
                .iter()
                .fold(0, |near, row| near | row);
            patch[y] |= (near | near << 1 | near >> 1 | near << 2 | near >> 2) & bits[y];
        }
        if patch == before {
            return patch;
        }
    }
}
