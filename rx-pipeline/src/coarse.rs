//! Frames in larger pixels, in which a near panel is as large as a far one in the camera's own pixels.
//!
//! A larger pixel is the root mean square of at most 4×2 grey levels from its square. Its cost therefore does not grow with the square's
//! side. Grey levels are about the root of light, so the root mean square averages light, and an LED's rim counts fully. Neighbours are
//! then mixed by the binomial 1, 2, 1 along both axes: a sharp disc many pixels wide becomes a round spot, as under a lens.

use crate::approximate::root;
use crate::corners::{Corners, CornersError};
use crate::frame::Frame;
use crate::lattice::Lattice;
use crate::spots::SIGMA_PX;
use crate::spots::{LatticeModel, PIXEL_VARIANCE};
use core::ops::Range;

/// Samples along a larger pixel's row, at most (count); every column is sampled in pixels of up to that width. More: less noise, and
/// slower.
const SAMPLES_ACROSS: usize = 4;
/// Samples along a larger pixel's column, at most (count). As above.
const SAMPLES_DOWN: usize = 2;

/// The variance of the binomial 1, 2, 1.
const MIXING_VARIANCE: f32 = 0.5;
/// Larger pixels per pass (count).
const SEGMENT: usize = 256;

/// Larger pixels in a frame: `side` × `side` of its pixels each, from `origin` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    pub side: usize,
    pub origin: [i32; 2],
}

/// Mean squares of a row of larger pixels, with one more on either side.
type Row = [u32; SEGMENT + 2];

impl Grid {
    /// The frame's own pixels.
    pub const FRAME: Self = Self { side: 1, origin: [0; 2] };

    /// Larger pixels that start at the frame's first pixel.
    pub const fn of_side(side: usize) -> Self {
        Self { side, origin: [0; 2] }
    }

    /// Converts a position from larger pixels to the frame.
    pub fn place_in_frame(&self, at: [f32; 2]) -> [f32; 2] {
        let middle = 0.5 * (self.side as f32 - 1.0);
        core::array::from_fn(|i| at[i] * self.side as f32 + middle + self.origin[i] as f32)
    }

    /// Converts a position from the frame to larger pixels.
    pub fn place_of_frame(&self, at: [f32; 2]) -> [f32; 2] {
        let middle = 0.5 * (self.side as f32 - 1.0);
        core::array::from_fn(|i| (at[i] - middle - self.origin[i] as f32) / self.side as f32)
    }

    /// Converts a standard deviation in the frame to larger pixels.
    pub fn sigma_from_frame(&self, sigma_px: f32) -> f32 {
        let side = self.side as f32;
        let variance = (sigma_px * sigma_px - PIXEL_VARIANCE).max(0.0) / (side * side);
        libm::sqrtf(variance + self.own_variance())
    }

    /// The blur in larger pixels if the lens has this blur in the frame.
    pub fn blur_from_frame(&self, blur_sigma_px: f32) -> f32 {
        let in_frame = libm::sqrtf(blur_sigma_px * blur_sigma_px + PIXEL_VARIANCE);
        let sigma = self.sigma_from_frame(in_frame);
        libm::sqrtf((sigma * sigma - PIXEL_VARIANCE).max(0.0))
    }

    /// The variance that mixing with neighbours adds.
    pub fn mixing_variance(&self) -> f32 {
        if self.side > 1 { MIXING_VARIANCE } else { 0.0 }
    }

    /// The variance of a point in larger pixels.
    fn own_variance(&self) -> f32 {
        PIXEL_VARIANCE + self.mixing_variance()
    }

    /// Converts corners from larger pixels to the frame.
    pub fn corners_to_frame(&self, corners: &Corners) -> Result<Corners, CornersError> {
        Corners::new(corners.points().map(|at| self.place_in_frame(at)))
    }

    /// Converts corners from the frame to larger pixels.
    pub fn corners_from_frame(&self, corners: &Corners) -> Result<Corners, CornersError> {
        Corners::new(corners.points().map(|at| self.place_of_frame(at)))
    }

    pub fn lattice_to_frame(&self, lattice: &Lattice) -> Lattice {
        lattice.scaled(self.place_in_frame(lattice.centre), self.side as f32)
    }

    pub fn lattice_from_frame(&self, lattice: &Lattice) -> Lattice {
        lattice.scaled(self.place_of_frame(lattice.centre), 1.0 / self.side as f32)
    }

    /// Converts spots from larger pixels to the frame.
    pub fn spots_to_frame(&self, spots: &LatticeModel) -> LatticeModel {
        let side = self.side as f32;
        let variance = (spots.sigma * spots.sigma - self.own_variance()).max(0.0) * side * side;
        let sigma = libm::sqrtf(variance + PIXEL_VARIANCE);
        let lattice = self.lattice_to_frame(&spots.lattice);
        widened(spots, lattice, sigma, side)
    }

    /// Converts spots from the frame to larger pixels.
    pub fn spots_from_frame(&self, spots: &LatticeModel) -> LatticeModel {
        let sigma = self.sigma_from_frame(spots.sigma).clamp(*SIGMA_PX.start(), *SIGMA_PX.end());
        let lattice = self.lattice_from_frame(&spots.lattice);
        widened(spots, lattice, sigma, 1.0 / self.side as f32)
    }

    /// The same larger pixels in a frame with another origin, in which positions change by `shift`.
    pub fn shifted(&self, shift: [i32; 2]) -> Self {
        Self {
            origin: core::array::from_fn(|i| self.origin[i].saturating_add(shift[i])),
            ..*self
        }
    }

    /// The `width` × `height` larger pixels, drawn into `buffer`; `None` if they do not fit into it or if the frame holds no whole one.
    /// Beyond its edges the frame continues with its outermost pixels.
    pub fn draw<'a>(&self, frame: &Frame<'_>, size: [usize; 2], buffer: &'a mut [u8]) -> Option<Frame<'a>> {
        let [width, height] = size;
        let inside = Inside::of(self, frame, size)?;
        let pixels = buffer.get_mut(..width.checked_mul(height)?)?;
        for start in (0..width).step_by(SEGMENT) {
            let columns = start..(start + SEGMENT).min(width);
            self.draw_columns(&inside, columns, width, pixels);
        }
        Frame::new(pixels, width, height).ok()
    }

    /// Draws some columns of larger pixels.
    fn draw_columns(&self, inside: &Inside<'_>, columns: Range<usize>, width: usize, pixels: &mut [u8]) {
        let mut rows: [Row; 3] = [[0; SEGMENT + 2]; 3];
        self.sum_row(inside, 0, &columns, &mut rows[0]);
        rows[2] = rows[0];
        let samples = (self.samples(SAMPLES_ACROSS) * self.samples(SAMPLES_DOWN)) as f32;
        let scale = 1.0 / (16.0 * samples);
        for (y, to) in pixels.chunks_exact_mut(width).enumerate() {
            self.sum_row(inside, y + 1, &columns, &mut rows[(y + 1) % 3]);
            let [above, here, below] = [2, 0, 1].map(|offset| &rows[(y + offset) % 3]);
            let mut mixed: Row = [0; SEGMENT + 2];
            for i in 0..SEGMENT + 2 {
                mixed[i] = above[i] + 2 * here[i] + below[i];
            }
            for (i, to) in to[columns.clone()].iter_mut().enumerate() {
                let sum = mixed[i] + 2 * mixed[i + 1] + mixed[i + 2];
                *to = (root(sum as i32 as f32 * scale) + 0.5) as u8;
            }
        }
    }

    /// Sums of squares of a row of larger pixels, and of one more on either side.
    fn sum_row(&self, inside: &Inside<'_>, y: usize, columns: &Range<usize>, sums: &mut Row) {
        let [whole, rows] = inside.size;
        let y = y.saturating_sub(inside.before[1]).min(rows - 1);
        let wanted = columns.start as i32 - 1 - inside.before[0] as i32;
        let from = wanted.clamp(0, whole as i32 - 1);
        let to = (wanted + columns.len() as i32 + 2).clamp(from + 1, whole as i32);
        let first = (from - wanted).max(0) as usize;
        let end = first + (to - from) as usize;
        let Some(inner) = sums.get_mut(first..end) else {
            return;
        };
        inner.fill(0);
        for down in self.offsets(SAMPLES_DOWN) {
            let part = inside.part.row(y * self.side + down);
            let part = part.and_then(|row| row.get(from as usize * self.side..to as usize * self.side));
            let row = part.unwrap_or_default();
            match self.side {
                2 => add_all::<2>(row, inner),
                4 => add_all::<4>(row, inner),
                side => {
                    for across in self.offsets(SAMPLES_ACROSS) {
                        let samples = row.get(across..).unwrap_or_default().iter().step_by(side);
                        for (sum, &grey) in inner.iter_mut().zip(samples) {
                            *sum += u32::from(grey) * u32::from(grey);
                        }
                    }
                }
            }
        }
        let (left, right) = (sums[first], sums[end - 1]);
        sums[..first].fill(left);
        sums[end..].fill(right);
    }

    /// The number of samples along an axis, at most `most`.
    fn samples(&self, most: usize) -> usize {
        self.side.min(most)
    }

    /// The positions of samples along an axis of a larger pixel: evenly spread and symmetric.
    fn offsets(&self, most: usize) -> impl Iterator<Item = usize> {
        let (side, count) = (self.side, self.samples(most));
        (0..count).map(move |i| {
            let place = |i: usize| (2 * i + 1) * side / (2 * count);
            if 2 * i < count { place(i) } else { side - 1 - place(count - 1 - i) }
        })
    }
}

/// The larger pixels that lie wholly within a frame.
struct Inside<'a> {
    part: Frame<'a>,
    /// Columns and rows of larger pixels before the first whole one.
    before: [usize; 2],
    /// Columns and rows of whole larger pixels.
    size: [usize; 2],
}

impl<'a> Inside<'a> {
    fn of(grid: &Grid, frame: &Frame<'a>, size: [usize; 2]) -> Option<Self> {
        let side = i32::try_from(grid.side).ok()?;
        let limit = [frame.width(), frame.height()];
        let (mut before, mut first, mut whole) = ([0; 2], [0; 2], [0; 2]);
        for axis in 0..2 {
            let origin = grid.origin[axis];
            let limit = i32::try_from(limit[axis]).ok()?;
            let skipped = origin.checked_neg()?.max(0).checked_add(side - 1)? / side;
            let start = origin.checked_add(skipped.checked_mul(side)?)?;
            let there = i32::try_from(size[axis]).ok()? - skipped;
            let count = there.min((limit - start) / side);
            if count <= 0 {
                return None;
            }
            (before[axis], first[axis]) = (skipped as usize, start as usize);
            whole[axis] = count as usize;
        }
        let [width, height] = whole.map(|count| count * grid.side);
        let part = frame.region(first[0], first[1], width, height).ok()?;
        Some(Self { part, before, size: whole })
    }
}

/// Adds the squares of every `SIDE` neighbours.
fn add_all<const SIDE: usize>(row: &[u8], sums: &mut [u32]) {
    /// Sums per pass, so that the compiler vectorises the loop.
    const SUMS: usize = 8;
    fn add<const SIDE: usize>(pixels: &[[u8; SIDE]], sums: &mut [u32]) {
        for (sum, pixels) in sums.iter_mut().zip(pixels) {
            *sum += pixels
                .map(|grey| i32::from(i16::from(grey)) * i32::from(i16::from(grey)))
                .iter()
                .sum::<i32>() as u32;
        }
    }
    let pixels = row.as_chunks::<SIDE>().0;
    for (sums, pixels) in sums.chunks_mut(SUMS).zip(pixels.chunks(SUMS)) {
        add(pixels, sums);
    }
}

/// The same light in spots of another width, on another lattice, in pixels `scale` times as fine.
fn widened(spots: &LatticeModel, lattice: Lattice, sigma: f32, scale: f32) -> LatticeModel {
    let ratio = spots.sigma / (sigma / scale);
    LatticeModel {
        lattice,
        sigma,
        off: spots.off * ratio * ratio,
        contrast: spots.contrast * ratio * ratio,
        ..*spots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// A frame from a grey level per pixel.
    fn frame_of(width: usize, height: usize, grey: impl Fn(usize, usize) -> u8) -> std::vec::Vec<u8> {
        (0..width * height).map(|i| grey(i % width, i / width)).collect()
    }

    #[test]
    fn samples_lie_evenly_about_the_middle() {
        for side in 1..200 {
            for most in [SAMPLES_ACROSS, SAMPLES_DOWN] {
                let grid = Grid::of_side(side);
                let offsets: std::vec::Vec<usize> = grid.offsets(most).collect();
                assert_eq!(offsets.len(), side.min(most));
                assert_eq!(2 * offsets.iter().sum::<usize>(), offsets.len() * (side - 1));
                assert!(offsets.is_sorted() && offsets.iter().all(|&offset| offset < side));
            }
        }
    }

    #[test]
    fn an_even_frame_stays_as_it_is_to_its_very_end() {
        for grey in [0u8, 1, 118, 254, 255] {
            let pixels = std::vec![grey; 700 * 90];
            let frame = Frame::new(&pixels, 700, 90).unwrap();
            let mut buffer = [0; 400 * 60];
            for (side, origin, size) in [(2, [0, 0], [350, 45]), (7, [-14, -14], [104, 16])] {
                let grid = Grid { side, origin };
                let drawn = grid.draw(&frame, size, &mut buffer).unwrap();
                assert!(drawn.rows().flatten().all(|&drawn| drawn == grey), "{grey}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_not_drawn() {
        let frame = Frame::new(&[9; 64], 8, 8).unwrap();
        let mut buffer = [0; 16];
        let grid = Grid::of_side(2);
        assert!(grid.draw(&frame, [4, 4], &mut buffer).is_some());
        assert!(grid.draw(&frame, [5, 4], &mut buffer).is_none());
        assert!(grid.draw(&frame, [0, 4], &mut buffer).is_none());
        for origin in [[-8, 0], [8, 0], [0, i32::MAX], [i32::MIN, 0]] {
            assert!(Grid { side: 2, origin }.draw(&frame, [4, 4], &mut buffer).is_none());
        }
    }

    /// The centre of gravity of the light above the darkest pixel.
    fn centre(frame: &Frame<'_>) -> [f32; 2] {
        let (mut sum, mut total) = ([0.0; 2], 0.0);
        for (y, row) in frame.rows().enumerate() {
            for (x, &grey) in row.iter().enumerate() {
                let light = f32::from(grey) * f32::from(grey);
                total += light;
                sum[0] += light * x as f32;
                sum[1] += light * y as f32;
            }
        }
        sum.map(|sum| sum / total)
    }

    properties! {
        #[test]
        fn a_spot_is_where_it_was_and_as_wide_as_said(side in 2usize..12, dx in -3.0f32..3.0, dy in -3.0f32..3.0, shift in 0i32..9) {
            let sigma_px = 3.0 * side as f32 / 2.0;
            let at = [20.0 * side as f32 + dx, 21.0 * side as f32 + dy];
            let long = 42 * side + 20;
            let pixels = frame_of(long, long, |x, y| {
                let square = (x as f32 - at[0]).powi(2) + (y as f32 - at[1]).powi(2);
                (250.0 * (-square / (4.0 * sigma_px * sigma_px)).exp()).round() as u8
            });
            let frame = Frame::new(&pixels, long, long).unwrap();
            let grid = Grid { side, origin: [shift, -shift] };
            let mut buffer = [0; 41 * 41];
            let drawn = grid.draw(&frame, [41, 41], &mut buffer).unwrap();
            let seen = grid.place_in_frame(centre(&drawn));
            for axis in 0..2 {
                prop_assert!((seen[axis] - at[axis]).abs() < 0.1 * side as f32, "{seen:?} for {at:?}");
            }
            let squares: f32 = drawn.rows().flatten().map(|&grey| f32::from(grey).powi(2)).sum();
            let peak = drawn.rows().flatten().copied().max().unwrap_or_default();
            let width = (squares / f32::from(peak).powi(2) / core::f32::consts::TAU).sqrt();
            // The spot in the frame is light alone, without the pixel's own variance.
            let own = libm::sqrtf(sigma_px * sigma_px + PIXEL_VARIANCE);
            prop_assert!((width / grid.sigma_from_frame(own) - 1.0).abs() < 0.1, "{width}");
        }

        #[test]
        fn places_and_spots_go_there_and_back(
            side in 1usize..40,
            origin in prop::array::uniform2(-50i32..2000),
            at in prop::array::uniform2(0.0f32..2000.0),
            sigma in 0.9f32..3.0,
        ) {
            let grid = Grid { side, origin };
            let back = grid.place_of_frame(grid.place_in_frame(at));
            prop_assert!((back[0] - at[0]).abs() < 1e-2 && (back[1] - at[1]).abs() < 1e-2);
            let spots = LatticeModel {
                lattice: Lattice { centre: at, column: [5.0, 0.3], row: [-0.2, 5.5], tilt: [0.01, -0.02] },
                sigma, background: 1.0, off: 0.5, contrast: 4.0, state: [0.0; 64],
            };
            let again = grid.spots_from_frame(&grid.spots_to_frame(&spots));
            prop_assert!((again.sigma - sigma).abs() < 1e-3);
            prop_assert!((again.contrast - 4.0).abs() < 1e-2 && (again.off - 0.5).abs() < 1e-2);
            prop_assert!((again.lattice.column[0] - 5.0).abs() < 1e-3);
        }
    }
}
