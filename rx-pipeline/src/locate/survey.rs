//! Survey: one pass over a frame for busy and for changed places, and for those with small bright spots.
//!
//! The pass uses sums of 2×2 pixels. For each tile of 16×16 pixels it adds up
//!
//! - the second differences over 4 pixels, along rows and along columns: LEDs make both large, edges and stripes only one;
//! - the differences from an earlier frame, if there is one: before a still background only a panel's LEDs change;
//! - on computers also the excess over the brighter of two neighbours, the least of several directions: only small bright spots have one,
//!   and windows, branches and the edges of shadows have none.

use crate::frame::Frame;
use heapless::Vec;

/// Side of a tile in frames of up to [`TILES`] of them (px). Larger: faster, and small panels drown in their surroundings.
const TILE_PX: usize = 16;
/// Tiles along one side of the frame, at most (count). More: 12 bytes of memory a tile of the square; fewer: coarser tiles in large frames.
const TILES: usize = if cfg!(feature = "large-frames") { 128 } else { 32 };
/// Reach of the second difference (sums of 2×2 px). Longer: tuned to larger LEDs.
const LAG: usize = 2;
/// The weight of the excess over next neighbours against that over neighbours [`LAG`] away (ratio), because an LED's excess grows with the
/// square of the distance. Higher: small panels are found, and large ones drown in noise.
const NEXT: u16 = 4;
/// Places with spots for each busy place in a search for isolated spots (count). More: panels of large LEDs are found later, those of small
/// ones sooner.
const SPOTTED_IN_A_ROW: usize = 3;
/// The least excess of a peak over the median tile (share of that). Higher: faint panels are missed; lower: noise makes peaks. The mean of
/// a tile's 64 differences varies by a tenth.
const STANDS_OUT: f32 = 0.25;

/// Sums of 2×2 pixels along a tile's side.
const TILE_SUMS: usize = TILE_PX / 2;
/// Sums of 2×2 pixels per pass: four rows of them fit into the processor's nearest cache.
const SEGMENT: usize = 256;

/// A local maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    /// Its approximate centre, in pixels.
    pub centre: [f32; 2],
    /// Mean difference of 2×2 pixels' means there, in grey levels; for spots their weighted excess.
    pub strength: f32,
}

/// The result of a pass.
pub(super) struct Survey<const N: usize> {
    /// Busy places, busiest first.
    pub busy: Vec<Peak, N>,
    /// Places with small bright spots, the most and brightest first, and every fourth of them a busy one, because large LEDs are not small
    /// spots; empty without tiles for them.
    pub spotted: Vec<Peak, N>,
    /// Changed places, most changed first; empty without an earlier frame.
    pub changed: Vec<Peak, N>,
    /// Standard deviation of the noise of one pixel, in grey levels.
    pub noise_grey: f32,
    /// The same, estimated from the change since the earlier frame.
    pub noise_of_change_grey: f32,
}

/// A value for each tile.
pub(super) struct Tiles([[u32; TILES]; TILES]);

impl<const N: usize> Survey<N> {
    /// Surveys `frame` and, if there is one, an `earlier` frame of the same size.
    pub fn of(
        frame: &Frame<'_>,
        earlier: Option<&Frame<'_>>,
        busy: &mut Tiles,
        mut spotted: Option<&mut Tiles>,
        changed: &mut Tiles,
    ) -> Self {
        let scale = frame.width().max(frame.height()).div_ceil(TILE_PX * TILES);
        let tiles = |length: usize| (length / 2).div_ceil(TILE_SUMS * scale).min(TILES);
        let size = (tiles(frame.width()), tiles(frame.height()));
        if size.0 == 0 || size.1 == 0 {
            return Self {
                busy: Vec::new(),
                spotted: Vec::new(),
                changed: Vec::new(),
                noise_grey: 0.0,
                noise_of_change_grey: 0.0,
            };
        }
        busy.clear(size);
        changed.clear(size);
        if let Some(spotted) = &mut spotted {
            spotted.clear(size);
        }
        let mut sums = Sums {
            busy,
            spotted: spotted.as_deref_mut(),
            changed,
        };
        sums.add(frame, earlier, scale);
        let tile_px = (TILE_PX * scale) as f32;
        let per_sum = 1.0 / (4.0 * (TILE_SUMS * TILE_SUMS * scale * scale) as f32);
        let (busy_floor, changed_floor) = (busy.median(size), changed.median(size));
        let busy = busy.peaks(size, busy_floor, tile_px, per_sum);
        let spotted = spotted.map_or_else(Vec::new, |spotted| {
            let spotted = spotted.peaks::<N>(size, spotted.median(size), tile_px, per_sum);
            mixed(&spotted, &busy)
        });
        Self {
            busy,
            spotted,
            changed: if earlier.is_some() {
                changed.peaks(size, changed_floor, tile_px, per_sum)
            } else {
                Vec::new()
            },
            noise_grey: noise(frame),
            // The mean of |a − b| of normal numbers is 2/√π·σ; a mean of four pixels has half the noise of one.
            noise_of_change_grey: changed_floor as f32 * per_sum * 1.772,
        }
    }
}

/// The places of two lists in their order, [`SPOTTED_IN_A_ROW`] of the first for each of the second.
fn mixed<const N: usize>(spotted: &[Peak], busy: &[Peak]) -> Vec<Peak, N> {
    let mut mixed: Vec<Peak, N> = Vec::new();
    let (mut spotted, mut busy) = (spotted.chunks(SPOTTED_IN_A_ROW), busy.iter());
    loop {
        let (several, one) = (spotted.next().unwrap_or_default(), busy.next());
        if several.is_empty() && one.is_none() {
            return mixed;
        }
        for peak in several.iter().chain(one) {
            if mixed.iter().all(|other| other.centre != peak.centre) && mixed.push(*peak).is_err() {
                return mixed;
            }
        }
    }
}

/// The noise of a pixel, in grey levels: from the second differences along some rows, most of which are pure noise.
pub(super) fn noise(frame: &Frame<'_>) -> f32 {
    /// The median of |x| of normal numbers, times the spread of a − 2b + c.
    const MEDIAN: f32 = 0.6745 * 2.449_5;
    let mut histogram = [0u32; 512];
    let mut count = 0;
    for row in frame.rows().step_by(16) {
        for three in row.chunks_exact(3) {
            let difference = 2 * i32::from(three[1]) - i32::from(three[0]) - i32::from(three[2]);
            histogram[(difference.unsigned_abs() as usize).min(511)] += 1;
            count += 1;
        }
    }
    let half = count as f32 / 2.0;
    let mut below = 0.0;
    for (difference, &here) in histogram.iter().enumerate() {
        let here = here as f32;
        if here > 0.0 && below + here >= half {
            return (difference as f32 - 0.5 + (half - below) / here).max(0.0) / MEDIAN;
        }
        below += here;
    }
    0.0
}

struct Sums<'a> {
    busy: &'a mut Tiles,
    spotted: Option<&'a mut Tiles>,
    changed: &'a mut Tiles,
}

/// A value for each 2×2 pixels of one row of a segment, with [`LAG`] more on either side.
type Row = [u16; SEGMENT + 2 * LAG];

impl Sums<'_> {
    fn add(&mut self, frame: &Frame<'_>, earlier: Option<&Frame<'_>>, scale: usize) {
        let (columns, rows) = (frame.width() / 2, frame.height() / 2);
        let mut start = 0;
        while start < columns {
            self.add_segment(frame, earlier, start, (columns - start).min(SEGMENT), rows, scale);
            start += SEGMENT;
        }
    }

    fn add_segment(&mut self, frame: &Frame<'_>, earlier: Option<&Frame<'_>>, start: usize, length: usize, rows: usize, scale: usize) {
        let mut ring: [Row; 2 * LAG + 1] = [[0; SEGMENT + 2 * LAG]; 2 * LAG + 1];
        let mut sums: Row = [0; SEGMENT + 2 * LAG];
        let mut before: Row = [0; SEGMENT + 2 * LAG];
        let (mut along, mut down, mut spots) = ([0; SEGMENT], [0; SEGMENT], [0; SEGMENT]);
        // For this row of tiles and for the next one, whose first change is known before this one's last second differences.
        let mut change = [[0; SEGMENT]; 2];
        for y in 0..rows + LAG {
            let newest = y % (2 * LAG + 1);
            let source = y.min(rows - 1);
            sum_row(frame, source, start, length, &mut sums);
            if let (Some(earlier), true) = (earlier, y < rows) {
                sum_row(earlier, source, start, length, &mut before);
                differences(&sums, &before, &mut change[y / TILE_SUMS % 2]);
            }
            lights(&sums, &mut ring[newest]);
            if y >= LAG {
                let middle = y - LAG;
                let above = if middle >= LAG {
                    &ring[(middle - LAG) % (2 * LAG + 1)]
                } else {
                    &ring[middle % (2 * LAG + 1)]
                };
                let (here, below) = (&ring[middle % (2 * LAG + 1)], &ring[newest]);
                second_differences(above, here, below, &mut along, &mut down);
                if self.spotted.is_some() {
                    let next = |lines: usize| &ring[(middle + lines) % (2 * LAG + 1)];
                    let beside = if middle > 0 { [next(2 * LAG), next(1)] } else { [here; 2] };
                    excesses([above, beside[0], here, beside[1], below], &mut spots);
                }
                if (middle + 1).is_multiple_of(TILE_SUMS) || middle + 1 == rows {
                    let row = middle / TILE_SUMS / scale;
                    let changed = &mut change[middle / TILE_SUMS % 2];
                    for tile in 0..length.div_ceil(TILE_SUMS) {
                        let span = TILE_SUMS * tile..(TILE_SUMS * (tile + 1)).min(length);
                        let column = (start / TILE_SUMS + tile) / scale;
                        let total = |sums: &[u16]| sums[span.clone()].iter().map(|&s| u32::from(s)).sum::<u32>();
                        let (along, down) = (total(&along), total(&down));
                        if row < TILES && column < TILES {
                            self.busy.0[row][column] += along.min(down);
                            if let Some(spotted) = &mut self.spotted {
                                spotted.0[row][column] += total(&spots);
                            }
                            self.changed.0[row][column] += total(changed);
                        }
                    }
                    changed.fill(0);
                    (along, down, spots) = ([0; SEGMENT], [0; SEGMENT], [0; SEGMENT]);
                }
            }
        }
    }
}

/// Sums of 2×2 pixels; beyond the frame, its last ones repeat.
fn sum_row(frame: &Frame<'_>, y: usize, start: usize, length: usize, sums: &mut Row) {
    let (Some(upper), Some(lower)) = (frame.row(2 * y), frame.row(2 * y + 1)) else {
        return;
    };
    let last = frame.width() / 2;
    let (from, to) = (start.saturating_sub(LAG), (start + length + LAG).min(last));
    let offset = LAG - (start - from);
    let end = offset + to - from;
    sum_pairs(&upper[2 * from..2 * to], &lower[2 * from..2 * to], &mut sums[offset..end]);
    let first = sums[offset];
    sums[..offset].fill(first);
    let final_sum = sums[end - 1];
    sums[end..].fill(final_sum);
}

/// Sums of 2×2 pixels of two rows of twice as many pixels as there are sums.
fn sum_pairs(upper: &[u8], lower: &[u8], sums: &mut [u16]) {
    /// Sums per pass, so that the compiler vectorises the loop.
    const SUMS: usize = 8;
    fn sum<const P: usize>(upper: &[[u8; P]], lower: &[[u8; P]], sums: &mut [u16]) {
        for (sums, (u, l)) in sums.chunks_exact_mut(P / 2).zip(upper.iter().zip(lower)) {
            for (i, sum) in sums.iter_mut().enumerate() {
                let [u, l] = [u, l].map(|row| u16::from(row[2 * i]) + u16::from(row[2 * i + 1]));
                *sum = u + l;
            }
        }
    }
    let (upper, lower) = (upper.as_chunks(), lower.as_chunks());
    let (most, rest) = sums.split_at_mut(SUMS * upper.0.len());
    sum::<{ 2 * SUMS }>(upper.0, lower.0, most);
    sum::<2>(upper.1.as_chunks().0, lower.1.as_chunks().0, rest);
}

fn second_differences(above: &Row, here: &Row, below: &Row, along: &mut [u16; SEGMENT], down: &mut [u16; SEGMENT]) {
    for i in 0..SEGMENT {
        let twice = 2 * here[i + LAG];
        along[i] += (here[i] + here[i + 2 * LAG]).abs_diff(twice);
        down[i] += (above[i + LAG] + below[i + LAG]).abs_diff(twice);
    }
}

/// Adds the excess of each light over the brighter of two opposite neighbours: over the next ones the least along the row and the column,
/// over those [`LAG`] away also the least along the diagonals. The rows are those from [`LAG`] above to [`LAG`] below.
fn excesses([above, upper, here, lower, below]: [&Row; 5], spots: &mut [u16; SEGMENT]) {
    for i in 0..SEGMENT {
        let light = here[i + LAG];
        let next = here[i + LAG - 1].max(here[i + LAG + 1]).max(upper[i + LAG]).max(lower[i + LAG]);
        let far = here[i].max(here[i + 2 * LAG]).max(above[i + LAG]).max(below[i + LAG]);
        let diagonal = above[i].max(below[i + 2 * LAG]).max(above[i + 2 * LAG]).max(below[i]);
        spots[i] += NEXT * light.saturating_sub(next) + light.saturating_sub(far.max(diagonal));
    }
}

fn differences(here: &Row, before: &Row, change: &mut [u16; SEGMENT]) {
    for i in 0..SEGMENT {
        change[i] += here[i + LAG].abs_diff(before[i + LAG]);
    }
}

/// The approximate light of sums of grey levels, 0 to 1016: the square over 1024, for any gamma near 2.
fn lights(sums: &Row, lights: &mut Row) {
    for (light, &sum) in lights.iter_mut().zip(sums) {
        let eightfold = u32::from(8 * sum);
        *light = ((eightfold * eightfold) >> 16) as u16;
    }
}

impl Tiles {
    pub const fn new() -> Self {
        Self([[0; TILES]; TILES])
    }

    fn clear(&mut self, (columns, rows): (usize, usize)) {
        self.0[..rows].iter_mut().for_each(|row| row[..columns].fill(0));
    }

    /// The median over the tiles.
    fn median(&self, (columns, rows): (usize, usize)) -> u32 {
        // In steps of 1/64, from a histogram of the values' square-root-like logarithm.
        let mut histogram = [0u32; 1024];
        let class = |value: u32| -> usize {
            let value = value | 1;
            let exponent = value.ilog2();
            let mantissa = if exponent >= 5 {
                value >> (exponent - 5) & 31
            } else {
                value << (5 - exponent) & 31
            };
            (32 * exponent + mantissa) as usize
        };
        for row in &self.0[..rows] {
            for &value in &row[..columns] {
                histogram[class(value).min(1023)] += 1;
            }
        }
        let half = (columns * rows) as u32 / 2;
        let mut below = 0;
        for (class, &count) in histogram.iter().enumerate() {
            below += count;
            if below > half {
                let (exponent, mantissa) = (class as u32 / 32, class as u32 % 32);
                return ((u64::from(32 + mantissa) << exponent) >> 5) as u32;
            }
        }
        0
    }

    /// Local maxima of 2×2 tiles, the greatest first.
    fn peaks<const N: usize>(&self, (columns, rows): (usize, usize), floor: u32, tile_px: f32, per_sum: f32) -> Vec<Peak, N> {
        let mut peaks: Vec<Peak, N> = Vec::new();
        let at = |x: usize, y: usize| self.0[y][x].saturating_sub(floor);
        let square = |x: usize, y: usize| {
            let (right, lower) = ((x + 1).min(columns - 1), (y + 1).min(rows - 1));
            at(x, y) + at(right, y) + at(x, lower) + at(right, lower)
        };
        for y in 0..rows {
            for x in 0..columns {
                let value = square(x, y);
                if value as f32 <= STANDS_OUT * 4.0 * floor as f32 {
                    continue;
                }
                let strength = value as f32 * per_sum / 4.0;
                if peaks.is_full() && peaks.last().is_some_and(|last| last.strength >= strength) {
                    continue;
                }
                let near = |c: usize, limit: usize| c.saturating_sub(1)..(c + 2).min(limit);
                let greatest = near(y, rows).all(|v| {
                    near(x, columns).all(|u| {
                        let other = square(u, v);
                        other < value || (other == value && (v, u) >= (y, x))
                    })
                });
                if !greatest {
                    continue;
                }
                let centre = [(x + 1) as f32 * tile_px - 0.5, (y + 1) as f32 * tile_px - 0.5];
                let place = peaks.iter().position(|other| other.strength < strength).unwrap_or(peaks.len());
                if peaks.is_full() {
                    peaks.pop();
                }
                let _full = peaks.insert(place, Peak { centre, strength });
            }
        }
        peaks
    }
}

#[cfg(all(test, feature = "surroundings"))]
mod tests {
    use super::*;
    use std::boxed::Box;
    use std::vec::Vec as Pixels;

    /// Windows, which are busier than LEDs, have edges and corners, but no small spots.
    #[test]
    fn small_spots_come_before_windows() {
        const SIDE: usize = 256;
        let is_window = |x: usize, y: usize| x < 128 && x % 16 < 9 && y % 20 < 12;
        let is_led = |x: usize, y: usize| (180..228).contains(&x) && (100..148).contains(&y) && x % 6 < 2 && y % 6 < 2;
        let grey = |i: usize| match (i % SIDE, i / SIDE) {
            (x, y) if is_window(x, y) => 220,
            (x, y) if is_led(x, y) => 160,
            _ => 60,
        };
        let pixels: Pixels<u8> = (0..SIDE * SIDE).map(grey).collect();
        let frame = Frame::new(&pixels, SIDE, SIDE).unwrap();
        let tiles = || Box::new(Tiles::new());
        let survey = Survey::<8>::of(&frame, None, &mut tiles(), Some(&mut tiles()), &mut tiles());
        let is_panel = |peak: &Peak| (170.0..240.0).contains(&peak.centre[0]) && (90.0..160.0).contains(&peak.centre[1]);
        assert!(is_panel(&survey.spotted[0]), "{:?}", survey.spotted);
        assert!(!is_panel(&survey.busy[0]), "{:?}", survey.busy);
    }
}
