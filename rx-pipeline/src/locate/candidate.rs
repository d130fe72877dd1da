//! Bright patches of a panel's size.

use super::outline::Outline;
use crate::cells::MAX_WIDTH_PX;
use crate::corners::MIN_PITCH_PX;
use crate::frame::Frame;
use core::ops::Range;
use heapless::Vec;

/// A patch narrower than seven of the smallest pitches is no panel.
pub(super) const MIN_SIZE_PX: usize = (7.0 * MIN_PITCH_PX) as usize;
/// A wider one has no room in a [`crate::cells::CellMap`].
pub(super) const MAX_SIZE_PX: usize = MAX_WIDTH_PX;

/// Tiles along one side of the frame, at most.
const TILES: usize = 128;
/// Side of a tile in frames of up to 2048 px: wider than the dark between two LEDs, so that a panel's tiles touch.
const TILE_PX: usize = 16;
/// Brighter pixels that make a tile bright.
const TILE_COUNT: u32 = 3;
/// Candidates kept, the brightest ones.
const CANDIDATES: usize = 3;

/// Pixels `x.0` to before `x.1`, `y.0` to before `y.1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub x: (usize, usize),
    pub y: (usize, usize),
}

impl Window {
    /// Columns and rows.
    pub fn size(self) -> (usize, usize) {
        (self.x.1 - self.x.0, self.y.1 - self.y.0)
    }

    /// The window's rows with their y, as far as they are in the frame.
    pub fn rows<'a>(self, frame: &Frame<'a>) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        let frame = *frame;
        (self.y.0..self.y.1).filter_map(move |y| Some((y, frame.row(y)?.get(self.x.0..self.x.1)?)))
    }
}

/// The candidates, brightest first, and how many patches there were in all.
pub(super) struct Found {
    pub outlines: Vec<Outline, CANDIDATES>,
    pub patches: u32,
}

/// Looks for connected patches of bright pixels, as [`sums_of_nine`] has them.
pub(super) fn find(frame: &Frame<'_>, threshold: u16, background: u8) -> Found {
    let tile_px = TILE_PX * frame.width().max(frame.height()).div_ceil(TILE_PX * TILES);
    let mut bright = bright_tiles(frame, threshold, tile_px);
    let mut found = Found {
        outlines: Vec::new(),
        patches: 0,
    };
    while let Some(tiles) = take_patch(&mut bright) {
        found.patches += 1;
        // A tile more on each side: what reaches into it may be too little to make it bright.
        let grown = |(first, last): (usize, usize), limit: usize| {
            (
                (first.saturating_sub(1)) * tile_px,
                ((last + 2) * tile_px).min(limit),
            )
        };
        let window = Window {
            x: grown(tiles.x, frame.width()),
            y: grown(tiles.y, frame.height()),
        };
        if let Some(outline) = Outline::of(frame, window, threshold, background) {
            keep_brightest(&mut found.outlines, outline);
        }
    }
    found
}

fn keep_brightest(outlines: &mut Vec<Outline, CANDIDATES>, outline: Outline) {
    let place = outlines
        .iter()
        .position(|other| other.excess < outline.excess)
        .unwrap_or(outlines.len());
    if outlines.is_full() && place < outlines.len() {
        outlines.pop();
    }
    // Fails only for the dimmest one when the list is full of brighter ones.
    let _dimmest = outlines.insert(place, outline);
}

/// One bit a tile: whether it is bright. Bit x of word y.
fn bright_tiles(frame: &Frame<'_>, threshold: u16, tile_px: usize) -> [u128; TILES] {
    let mut tiles = [0; TILES];
    let mut counts = [0; TILES];
    for y in 1..frame.height().saturating_sub(1) {
        if let (Some(above), Some(here), Some(below)) =
            (frame.row(y - 1), frame.row(y), frame.row(y + 1))
        {
            count_bright([above, here, below], threshold, tile_px, &mut counts);
        }
        if (y + 1) % tile_px == 0 || y + 2 == frame.height() {
            let bits = counts
                .iter()
                .enumerate()
                .filter(|&(_, &count)| count >= TILE_COUNT);
            if let Some(tiles) = tiles.get_mut(y / tile_px) {
                *tiles = bits.fold(0, |bits, (x, _)| bits | 1 << x);
            }
            counts = [0; TILES];
        }
    }
    tiles
}

/// Pixels whose sums are worked out together.
const SEGMENT_PX: usize = 512;

/// Adds the bright pixels of the middle row to the counts of their tiles. A pixel is counted one place further left than it
/// is, which no tile minds.
fn count_bright(rows: [&[u8]; 3], threshold: u16, tile_px: usize, counts: &mut [u32; TILES]) {
    let [above, here, below] = rows;
    let width = here.len();
    let mut columns = [0; SEGMENT_PX + 2];
    let mut start = 0;
    while start + 2 < width {
        let end = (start + SEGMENT_PX + 2).min(width);
        let columns = &mut columns[..end - start];
        let sums = above[start..end]
            .iter()
            .zip(&here[start..end])
            .zip(&below[start..end]);
        for (column, ((&a, &h), &b)) in columns.iter_mut().zip(sums) {
            *column = u16::from(a) + u16::from(h) + u16::from(b);
        }
        let inner = columns.len() - 2;
        let triples = columns[..inner]
            .chunks(TILE_PX)
            .zip(columns[1..=inner].chunks(TILE_PX))
            .zip(columns[2..].chunks(TILE_PX));
        for (place, ((left, middle), right)) in triples.enumerate() {
            let sums = left
                .iter()
                .zip(middle)
                .zip(right)
                .map(|((l, m), r)| l + m + r);
            let bright: u16 = sums.map(|sum| u16::from(sum >= threshold)).sum();
            if let Some(count) = counts.get_mut((start + TILE_PX * place) / tile_px) {
                *count += u32::from(bright);
            }
        }
        start += SEGMENT_PX;
    }
}

/// The sums of the 3×3 pixels around those of `columns` in row `y`, which are no border pixels of the frame. Nothing if they
/// are.
pub(super) fn sums_of_nine(
    frame: &Frame<'_>,
    columns: Range<usize>,
    y: usize,
) -> impl DoubleEndedIterator<Item = u16> + ExactSizeIterator {
    let length = columns.len();
    let widened = columns.start.saturating_sub(1)..columns.end + 1;
    let row = |y: Option<usize>| {
        let row = y
            .and_then(|y| frame.row(y))
            .and_then(|row| row.get(widened.clone()));
        row.filter(|row| row.len() == length + 2 && length > 0)
    };
    let rows = (row(y.checked_sub(1)), row(Some(y)), row(y.checked_add(1)));
    let (above, here, below, length) = match rows {
        (Some(above), Some(here), Some(below)) => (above, here, below, length),
        _ => (&[][..], &[][..], &[][..], 0),
    };
    let triple =
        |row: &[u8], x: usize| u16::from(row[x]) + u16::from(row[x + 1]) + u16::from(row[x + 2]);
    (0..length).map(move |x| triple(above, x) + triple(here, x) + triple(below, x))
}

/// First and last tile of a patch along x and y.
struct TileBox {
    x: (usize, usize),
    y: (usize, usize),
}

/// Removes one patch of tiles that touch, also at their corners.
fn take_patch(bright: &mut [u128; TILES]) -> Option<TileBox> {
    let top = bright.iter().position(|&tiles| tiles != 0)?;
    let mut patch = [0u128; TILES];
    patch[top] = 1 << bright[top].trailing_zeros();
    loop {
        let before = patch;
        for y in 0..TILES {
            let above = if y > 0 { patch[y - 1] } else { 0 };
            let below = patch.get(y + 1).copied().unwrap_or(0);
            let near = above | patch[y] | below;
            patch[y] |= (near | near << 1 | near >> 1) & bright[y];
        }
        if patch == before {
            break;
        }
    }
    let mut columns = 0;
    let mut last = top;
    for (y, (bright, patch)) in bright.iter_mut().zip(patch).enumerate() {
        *bright &= !patch;
        columns |= patch;
        if patch != 0 {
            last = y;
        }
    }
    Some(TileBox {
        x: (columns.trailing_zeros() as usize, columns.ilog2() as usize),
        y: (top, last),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_are_taken_one_by_one() {
        let mut bright = [0; TILES];
        bright[3] = 0b0110;
        bright[4] = 0b1000;
        bright[6] = 1 << 127;
        let patch = take_patch(&mut bright).unwrap();
        assert_eq!((patch.x, patch.y), ((1, 3), (3, 4)));
        let patch = take_patch(&mut bright).unwrap();
        assert_eq!((patch.x, patch.y), ((127, 127), (6, 6)));
        assert!(take_patch(&mut bright).is_none());
    }

    #[test]
    fn small_and_large_frames_have_tiles() {
        let mut pixels = std::vec![100; 3000 * 40];
        for pixel in &mut pixels[3000 * 20 + 2984..][..5] {
            *pixel = 200;
        }
        let frame = Frame::new(&pixels, 3000, 40).unwrap();
        let tiles = bright_tiles(&frame, 1000, 32);
        assert_eq!(tiles.iter().map(|tiles| tiles.count_ones()).sum::<u32>(), 1);
        assert_eq!(tiles[0], 1 << (2984 / 32));
        assert_eq!(find(&frame, 1000, 100).patches, 1);
        assert!(find(&frame, 1000, 100).outlines.is_empty());
    }
}
