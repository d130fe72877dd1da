//! A picture in tiles, a quarter of the LEDs' pitch wide, rotated with the panel.

use super::places::{AROUND, Place, SPAN, pixel, places, samples};
use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use link::panel::LEDS;

/// Tiles in a pitch (count). More: finer places, and slower.
pub(super) const TILES: usize = 4;
/// Samples along a tile's side, at most (count). More: less noise, and slower.
pub(super) const SAMPLES: usize = 2;
/// Tiles along a side of the picture (count). More: panels that have moved farther are found, and slower.
const ACROSS: usize = 88;
/// The range of the search from the middle of the picture (tiles).
pub(super) const ROOM: i32 = ((ACROSS - TILES * (SPAN + 1)) / 2) as i32;

/// The picture, row by row.
pub(crate) struct Tiles([u8; ACROSS * ACROSS]);

impl Tiles {
    pub const EMPTY: Self = Self([0; ACROSS * ACROSS]);

    /// Draws a panel's surroundings, with the panel's middle in the middle: each tile is the mean of half a pitch around it.
    pub fn draw(&mut self, frame: &Frame<'_>, lattice: &Lattice) {
        let samples = samples(lattice);
        let step = 1.0 / (TILES * samples) as f32;
        let [column, row] = [lattice.column, lattice.row].map(|axis| axis.map(|c| c * step));
        let middle = (ACROSS / 2 * samples) as f32 - 0.5;
        for (j, line) in self.0.chunks_exact_mut(ACROSS).enumerate() {
            for (i, tile) in line.iter_mut().enumerate() {
                let mut sum = 0;
                for sample in 0..samples * samples {
                    let u = (i * samples + sample % samples) as f32 - middle;
                    let v = (j * samples + sample / samples) as f32 - middle;
                    let at = |axis: usize| lattice.centre[axis] + u * column[axis] + v * row[axis];
                    sum += u32::from(pixel(frame, at(0), at(1)));
                }
                *tile = (sum / (samples * samples) as u32) as u8;
            }
        }
        for j in (1..ACROSS).rev() {
            for i in (1..ACROSS).rev() {
                let at = |dx: usize, dy: usize| u32::from(self.0[(j - dy) * ACROSS + i - dx]);
                self.0[j * ACROSS + i] = ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8;
            }
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = u8> + '_ {
        self.0.iter().copied()
    }

    pub const fn len(&self) -> usize {
        self.0.len()
    }

    /// The tiles at the places of a panel that far from the middle.
    pub fn at<'a>(&'a self, [i, j]: [i32; 2], offsets: &'a [isize]) -> impl Iterator<Item = u8> + 'a {
        let middle = (ACROSS / 2 * ACROSS + ACROSS / 2) as i32;
        let start = (middle + j * ACROSS as i32 + i) as usize;
        offsets.iter().map(move |&offset| self.0[start.wrapping_add_signed(offset)])
    }
}

/// The places in tiles, from the panel's middle.
pub(super) struct Offsets {
    pub leds: [isize; LEDS],
    pub around: [isize; AROUND],
}

/// The places of a panel on `lattice` that has rotated further.
pub(super) fn offsets(lattice: &Lattice, roll_rad: f32) -> Offsets {
    let flat = Lattice {
        tilt: [0.0; 2],
        ..*lattice
    };
    let seen = lattice.rolled(roll_rad);
    let most = (ACROSS / 2) as f32 - ROOM as f32 - 1.0;
    let mut offsets = Offsets {
        leds: [0; LEDS],
        around: [0; AROUND],
    };
    for (place, [column, row]) in places() {
        let at = flat.coordinates(seen.position(column, row)).unwrap_or([MIDDLE; 2]);
        let [across, down] = at.map(|at| libm::roundf((at - MIDDLE) * TILES as f32).clamp(-most, most) as isize);
        let offset = down * ACROSS as isize + across;
        match place {
            Place::Led(led) => offsets.leds[led] = offset,
            Place::Around(i) => offsets.around[i] = offset,
        }
    }
    offsets
}
