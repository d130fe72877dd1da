//! Finds a panel in the whole frame by its blinking, in integer arithmetic: before a static background, only a panel's LEDs change.
//!
//! The search keeps the greatest change of each pixel over some frames. After a few symbols, this is a picture of all 64 LEDs on black,
//! whatever the panel shows. The corner LEDs are the outermost points of the largest connected group, along the diagonals or, if the panel
//! stands on a corner, along rows and columns. All 64 LEDs must then be in the places that these corners imply, and nothing beside them.
//!
//! The camera must stand still during the search, or move by less than a fraction of a pitch. The panel may have any rotation, and its LEDs
//! must not overlap.

use core::borrow::BorrowMut;

use super::super::blinked::Area;
use super::outline::Outline;
use super::samples::{GREY, Samples};
use crate::corners::Corners;
use crate::frame::Frame;
use link::panel::{LEDS, SIDE};

/// Tiles along the longer side of a frame: LEDs that are more than two tiles apart are not connected.
const TILES: usize = 16;
/// Minimum number of frames before the first attempt.
const LEAST_FRAMES: u32 = 5;
/// Number of frames after which all changes are forgotten, because something else has changed by then.
const MOST_FRAMES: u32 = 30;
/// Number of frames that show a change of the exposure.
const SETTLING_FRAMES: u32 = 3;
/// Smallest difference that counts as a change, in grey levels.
const LEAST_CHANGE: u8 = 14;
/// A change must also exceed the mean change of all pixels, which is noise, by this factor.
const OVER_NOISE: u32 = 4;
/// Minimum number of LEDs that blink; the others may be broken, or may not have changed yet.
const LEAST_LEDS: usize = 60;
/// Minimum pitch of a panel, in pixels.
const LEAST_PITCH_PX: f32 = 1.8;
/// Number of steps that move the corners onto the LEDs.
const ROUNDS: usize = 6;
/// Maximum pixels along a side of a frame, so that sums over all pixels fit into 32 bits.
const LONGEST_SIDE: usize = 2048;
/// All LEDs.
const ALL: u64 = u64::MAX;

/// Why a frame cannot be searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BlinkSearchError {
    /// The frame is too large.
    #[error("a frame of {width} × {height} pixels cannot be searched: at most 2048 a side can; leave pixels out")]
    Size {
        /// The columns of the frame.
        width: usize,
        /// The rows of the frame.
        height: usize,
    },
    /// The search has too little memory.
    #[error("{has} bytes for a search that needs {needed}: give it `BlinkSearch::bytes`")]
    Room {
        /// Required bytes.
        needed: usize,
        /// Available bytes.
        has: usize,
    },
}

/// Searches for a panel by its blinking. `B` lends [`BlinkSearch::bytes`] bytes.
pub struct BlinkSearch<B> {
    room: B,
    size: [usize; 2],
    /// Frames whose changes are included.
    frames: u32,
    /// Frames to skip first.
    settling: u32,
}

impl BlinkSearch<[u8; 0]> {
    /// The memory for a search in frames of that size, up to 2048 pixels a side: two bytes a pixel.
    pub const fn bytes(width: usize, height: usize) -> usize {
        2 * width * height
    }
}

impl<B: BorrowMut<[u8]>> BlinkSearch<B> {
    /// A search that has not seen a frame.
    pub fn new(room: B) -> Self {
        Self {
            room,
            size: [0; 2],
            frames: 0,
            settling: 1,
        }
    }

    /// Forgets all frames.
    pub fn forget(&mut self) {
        (self.frames, self.settling) = (0, 1);
    }

    /// Announces that the exposure of the next frames differs, so that the change it causes is ignored.
    pub fn expect_another_exposure(&mut self) {
        (self.frames, self.settling) = (0, SETTLING_FRAMES);
    }

    /// Processes a frame. Returns the panel if it has blinked enough.
    ///
    /// # Errors
    /// [`BlinkSearchError`] if the frame is too large for this search or its memory. The frame is then ignored.
    pub fn find(&mut self, frame: &Frame<'_>) -> Result<Option<Corners>, BlinkSearchError> {
        self.find_beside(frame, [])
    }

    /// Processes a frame, but skips some areas of it.
    pub(crate) fn find_beside(
        &mut self,
        frame: &Frame<'_>,
        others: impl IntoIterator<Item = Area>,
    ) -> Result<Option<Corners>, BlinkSearchError> {
        let size = [frame.width(), frame.height()];
        let [width, height] = size;
        if width.max(height) > LONGEST_SIDE {
            return Err(BlinkSearchError::Size { width, height });
        }
        let area = width * height;
        let has = self.room.borrow().len();
        let needed = 2 * area;
        let Some(room) = self.room.borrow_mut().get_mut(..needed) else {
            return Err(BlinkSearchError::Room { needed, has });
        };
        let (earlier, change) = room.split_at_mut(area);
        if self.size != size {
            (self.size, self.frames, self.settling) = (size, 0, 1);
        }
        if self.settling > 0 || self.frames >= MOST_FRAMES {
            self.settling = self.settling.saturating_sub(1);
            self.frames = 0;
            change.fill(0);
            for (to, from) in earlier.chunks_exact_mut(size[0]).zip(frame.rows()) {
                to.copy_from_slice(from);
            }
            return Ok(None);
        }
        let mut sum = keep_change(frame, earlier, change);
        for area in others {
            sum -= wipe(change, width, area);
        }
        self.frames += 1;
        if self.frames < LEAST_FRAMES {
            return Ok(None);
        }
        Ok(found(change, size, sum))
    }
}

/// The panel in a picture of changes whose pixels add up to `sum`.
fn found(change: &[u8], size: [usize; 2], sum: u32) -> Option<Corners> {
    let most = change.iter().copied().max().unwrap_or(0);
    let noise = OVER_NOISE * sum / change.len().max(1) as u32;
    let enough = LEAST_CHANGE.max(noise.min(255) as u8).max(most / 3);
    let change = Frame::new(change, size[0], size[1]).ok()?;
    let outline = corner_leds(&change, enough)?;
    settled(&change, outline, i32::from(enough) * GREY)
}

/// Updates the greatest changes; returns their sum.
fn keep_change(frame: &Frame<'_>, earlier: &mut [u8], change: &mut [u8]) -> u32 {
    let mut sum = 0;
    let rows = earlier.chunks_exact_mut(frame.width()).zip(change.chunks_exact_mut(frame.width()));
    for (row, (earlier, change)) in frame.rows().zip(rows) {
        for ((&grey, earlier), change) in row.iter().zip(earlier).zip(change) {
            *change = (*change).max(grey.abs_diff(*earlier));
            *earlier = grey;
            sum += u32::from(*change);
        }
    }
    sum
}

/// Clears an area of a picture; returns the sum of its pixels.
fn wipe(change: &mut [u8], width: usize, area: Area) -> u32 {
    let [[left, right], [top, bottom]] = area;
    let rows = change.chunks_exact_mut(width).take(bottom).skip(top);
    let pixels = rows.flat_map(|row| row.iter_mut().take(right).skip(left));
    pixels.map(|pixel| u32::from(core::mem::take(pixel))).sum()
}

/// The corners of the largest group of changed pixels: along the diagonals or along rows and columns, whichever enclose the larger area.
fn corner_leds(change: &Frame<'_>, enough: u8) -> Option<Outline> {
    let tiles = Tiles::of(change);
    let group = largest_group(change, enough, tiles);
    let is_in_group = |x: usize, y: usize| group.0[tiles.of_place(y)] >> tiles.of_place(x) & 1 == 1;
    // The minima of x + y, −x + y, −x − y and x − y are the top left, top right, bottom right and bottom left corners; those of y, −x, −y
    // and x the tips.
    let mut ends = [[(i32::MAX, [0i32; 2]); 4]; 2];
    let inner_rows = change.rows().enumerate().skip(1).take(change.height().saturating_sub(2));
    for (y, row) in inner_rows {
        let inner = row.iter().enumerate().skip(1).take(row.len().saturating_sub(2));
        // This test is first because most pixels have not changed.
        for (x, &here) in inner.filter(|&(_, &here)| here >= enough) {
            if !is_in_group(x, y) || !is_peak(change, x, y, here) {
                continue;
            }
            let (u, v) = (x as i32, y as i32);
            let reaches = [[u + v, v - u, -u - v, u - v], [v, -u, -v, u]];
            for (end, reach) in ends.as_flattened_mut().iter_mut().zip(reaches.as_flattened()) {
                if *reach < end.0 {
                    *end = (*reach, [u, v]);
                }
            }
        }
    }
    let [diagonal, upright] = ends.map(|ends| ends.map(|(_, at)| at));
    let points = if area(&upright) > area(&diagonal) { upright } else { diagonal };
    let points = points.map(|at| at.map(|at| at as f32));
    Corners::new(points).ok().map(|corners| Outline::of(&corners))
}

/// Twice the area of a quadrilateral.
fn area([a, b, c, d]: &[[i32; 2]; 4]) -> i32 {
    (c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0])
}

fn is_peak(change: &Frame<'_>, x: usize, y: usize, here: u8) -> bool {
    (y - 1..=y + 1).all(|v| {
        change
            .row(v)
            .and_then(|row| row.get(x - 1..=x + 1))
            .is_some_and(|near| near.iter().all(|&other| other <= here))
    })
}

/// Maps a column or a row to its tile. A processor without a divider takes about 40 cycles for a division, and each pixel needs one. This
/// is a multiplication instead, with the same result for all places below [`LONGEST_SIDE`].
#[derive(Clone, Copy)]
struct Tiles {
    /// The reciprocal of the pixels along a tile, in 1/2¹⁸, rounded up.
    inverse: u32,
}

impl Tiles {
    const SHIFT: u32 = 18;

    fn of(frame: &Frame<'_>) -> Self {
        Self::of_pixels(frame.width().max(frame.height()).div_ceil(TILES))
    }

    fn of_pixels(tile: usize) -> Self {
        Self {
            inverse: (1u32 << Self::SHIFT).div_ceil(tile.max(1) as u32),
        }
    }

    fn of_place(self, place: usize) -> usize {
        ((place as u32).wrapping_mul(self.inverse) >> Self::SHIFT) as usize
    }
}

/// A set of tiles.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Group([u16; TILES]);

impl Group {
    const NONE: Self = Self([0; TILES]);

    /// The first tile of the set, alone.
    fn first(self) -> Option<Self> {
        let row = self.0.iter().position(|&row| row != 0)?;
        let mut first = Self::NONE;
        first.0[row] = self.0[row] & self.0[row].wrapping_neg();
        Some(first)
    }

    /// The set with all tiles that touch it.
    fn grown(self) -> Self {
        let wide = self.0.map(|row| row | row << 1 | row >> 1);
        Self(core::array::from_fn(|y| {
            let above = y.checked_sub(1).map_or(0, |y| wide[y]);
            let below = wide.get(y + 1).copied().unwrap_or(0);
            wide[y] | above | below
        }))
    }

    fn and(self, other: Self) -> Self {
        Self(core::array::from_fn(|y| self.0[y] & other.0[y]))
    }

    fn without(self, other: Self) -> Self {
        Self(core::array::from_fn(|y| self.0[y] & !other.0[y]))
    }

    /// The sum of the counts of its tiles.
    fn count(self, counts: &[[u16; TILES]; TILES]) -> u32 {
        let rows = self.0.iter().zip(counts);
        rows.flat_map(|(row, counts)| {
            let tiles = counts.iter().enumerate();
            tiles.filter(move |(x, _)| row >> x & 1 == 1)
        })
        .map(|(_, &count)| u32::from(count))
        .sum()
    }
}

/// The tiles of the group with the most changed pixels.
fn largest_group(change: &Frame<'_>, enough: u8, tiles: Tiles) -> Group {
    let mut counts = [[0u16; TILES]; TILES];
    for (y, row) in change.rows().enumerate() {
        let counts = &mut counts[tiles.of_place(y)];
        for (x, _) in row.iter().enumerate().filter(|&(_, &here)| here >= enough) {
            counts[tiles.of_place(x)] += 1;
        }
    }
    let mut left = Group::NONE;
    for (row, counts) in left.0.iter_mut().zip(&counts) {
        for (x, &count) in counts.iter().enumerate() {
            *row |= u16::from(count > 0) << x;
        }
    }
    let mut best = (0, Group::NONE);
    while let Some(seed) = left.first() {
        let mut group = seed;
        loop {
            let grown = group.grown().and(left);
            if grown == group {
                break;
            }
            group = grown;
        }
        left = left.without(group);
        let count = group.count(&counts);
        if count > best.0 {
            best = (count, group);
        }
    }
    best.1
}

/// Moves corners onto the LEDs. Returns them if all LEDs are there and nothing is beside them.
fn settled(change: &Frame<'_>, mut outline: Outline, enough: i32) -> Option<Corners> {
    for _ in 0..ROUNDS {
        let samples = Samples::take(change, &outline)?;
        outline.correct(&samples, ALL);
    }
    let samples = Samples::take(change, &outline)?;
    let features: [i32; LEDS] = core::array::from_fn(|led| samples.feature(led));
    let mean = features.iter().sum::<i32>() / LEDS as i32;
    let seen = features.iter().filter(|&&feature| feature > mean / 4).count();
    let corners = outline.corners()?;
    let is_large = corners.pitch_px() >= LEAST_PITCH_PX;
    (is_large && mean > enough / 4 && seen >= LEAST_LEDS && ends_there(change, &outline, mean)).then_some(corners)
}

/// Whether there are no LEDs one pitch beyond the outermost ones: the frame is darker there than half an LED.
fn ends_there(change: &Frame<'_>, outline: &Outline, mean: i32) -> bool {
    let [column, row] = outline.steps();
    let last = SIDE - 1;
    let beyond = (0..SIDE).flat_map(|i| {
        [
            outline.led(0, i).minus(column),
            outline.led(last, i).plus(column),
            outline.led(i, 0).minus(row),
            outline.led(i, last).plus(row),
        ]
    });
    let (sum, count) = beyond
        .filter_map(|point| super::samples::light(change, point))
        .fold((0, 0), |(sum, count), light| (sum + light, count + 1));
    2 * sum < mean * count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For each tile size that a frame can have, and each place in it.
    #[test]
    fn places_are_in_the_tiles_that_a_division_gives() {
        for tile in 1..=LONGEST_SIDE.div_ceil(TILES) {
            let tiles = Tiles::of_pixels(tile);
            for place in 0..LONGEST_SIDE {
                assert_eq!(tiles.of_place(place), place / tile, "{place} {tile}");
            }
        }
    }
}
