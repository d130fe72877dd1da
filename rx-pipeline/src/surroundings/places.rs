//! The places of a panel's LEDs and of its known surroundings.

use super::tiles::{SAMPLES, TILES};
use super::{Level, Sums};
use crate::frame::Frame;
use crate::lattice::Lattice;
use link::panel::{LEDS, SIDE};

/// Lines of places around the LEDs (count). More: surer among clutter, and slower.
const RINGS: usize = 3;
/// Places along a side, those of LEDs among them.
pub(super) const SPAN: usize = SIDE + 2 * RINGS;
/// Places around the LEDs.
pub(super) const AROUND: usize = SPAN * SPAN - LEDS;
/// The number of places next to the LEDs, and so on a panel's board: the first ones of those around.
pub(super) const ON_BOARD: usize = (SIDE + 2) * (SIDE + 2) - LEDS;

/// A place of the model.
pub(super) enum Place {
    Led(usize),
    Around(usize),
}

/// All places, row by row, with their columns and rows on the lattice.
pub(super) fn places() -> impl Iterator<Item = (Place, [f32; 2])> {
    let inside = 0..SIDE as i32;
    let (mut beside, mut beyond) = (0..ON_BOARD, ON_BOARD..AROUND);
    (0..SPAN * SPAN).map(move |i| {
        let [column, row] = [i % SPAN, i / SPAN].map(|line| line as i32 - RINGS as i32);
        let place = if inside.contains(&column) && inside.contains(&row) {
            Place::Led(row as usize * SIDE + column as usize)
        } else {
            let is_beside = [column, row].iter().all(|line| (-1..=SIDE as i32).contains(line));
            let one = if is_beside { &mut beside } else { &mut beyond };
            Place::Around(one.next().unwrap_or_default())
        };
        (place, [column as f32, row as f32])
    })
}

/// The mean grey level of a place, half a pitch wide, and the variance of the grey levels in it.
pub(super) fn level(frame: &Frame<'_>, lattice: &Lattice, [column, row]: [f32; 2]) -> Level {
    let [x, y] = lattice.position(column, row);
    let samples = 2 * samples(lattice);
    let mut sums = Sums::default();
    for i in 0..samples * samples {
        let part = |i: usize| ((i as f32 + 0.5) / samples as f32 - 0.5) * 2.0 / TILES as f32;
        let (u, v) = (part(i % samples), part(i / samples));
        let at = |axis: usize| u * lattice.column[axis] + v * lattice.row[axis];
        let mean = f32::from(pixel(frame, x + at(0), y + at(1)));
        sums.add(Level { mean, variance: 0.0 });
    }
    sums.level()
}

/// The levels of the places around the LEDs.
pub(super) fn around(frame: &Frame<'_>, lattice: &Lattice) -> [Level; AROUND] {
    let mut around = [Level::NONE; AROUND];
    for (place, at) in places() {
        if let Place::Around(i) = place {
            around[i] = level(frame, lattice, at);
        }
    }
    around
}

/// Samples along a tile's side.
pub(super) fn samples(lattice: &Lattice) -> usize {
    let [across, down] = lattice.pitch();
    (libm::ceilf(across.max(down) / TILES as f32) as usize).clamp(1, SAMPLES)
}

/// The nearest pixel; beyond its edges a frame continues with its outermost pixels.
pub(super) fn pixel(frame: &Frame<'_>, x: f32, y: f32) -> u8 {
    let nearest = |at: f32, count: usize| ((at + 0.5) as usize).min(count - 1);
    let row = frame.row(nearest(y, frame.height())).unwrap_or_default();
    row.get(nearest(x, frame.width())).copied().unwrap_or_default()
}
