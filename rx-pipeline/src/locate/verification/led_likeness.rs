//! Which lines are the panel's? The light at single places of the lattice, and a line beyond it.
//!
//! An On LED is brighter than the points halfway to its neighbours, along rows and along columns. If the board is brighter than Off LEDs,
//! these are darker than those points. Edges, a board's end and gradients are curved along one direction at most.

use super::shows_off;
use crate::frame::Frame;
use crate::locate::verification::Observation;
use crate::spots::LatticeModel;
use crate::spots::REACH_FITTED;
use heapless::Vec;
use link::panel::{LEDS, SIDE};

/// What a lattice holds more than those a line beside it, at least (count: 2 for an LED that is On, 3 if it is just
/// like one, 1 for one that is Off and shows): else their fits are compared. Higher: slower, and lines that one LED shows are doubted.
const LEAST_LINES_LEAD: i32 = 3;
/// A place is just like an LED that stands out if it differs from these by less (share of what they have). Higher: a hot
/// pixel or a corner may make a line; lower: lines that one LED shows are doubted.
const JUST_LIKE: f32 = 0.3;
/// An LED of a line that is dimmer than the others shows more than these, being Off, usually do, at least by this (share of an LED
/// that is On). Higher: panels with a dim outer line are a line off; lower: noise makes lines.
const LEAST_DIM: f32 = 0.25;
/// LEDs that are Off show if their places stand out by more (share of an LED that is On).
pub(super) const LEAST_OFF: f32 = 0.1;
/// The same (multiple of their median deviation, for eight of them together).
const SEEN: f32 = 4.0;
/// A place looks like an LED that is Off if it differs from what these usually show by less (share of it).
const OFF_WITHIN: f32 = 0.5;

/// Places along a side: the lattice's, and one more at either end.
const PLACES: usize = SIDE + 2;

/// How much each place looks like an LED that stands out, being On or, on a bright board, Off: about 1 where one is.
pub(super) struct LedLikeness {
    place: [[f32; PLACES]; PLACES],
    /// What an LED in the other state has.
    other: f32,
}

impl LedLikeness {
    pub fn of(observation: Observation<'_, '_>, spots: &LatticeModel) -> Self {
        let on = spots.off + spots.contrast;
        let (most, least) = if shows_off(spots) { (spots.off, on) } else { (on, spots.off) };
        let place = core::array::from_fn(|row| {
            core::array::from_fn(|column| {
                let (column, row) = (column as f32 - 1.0, row as f32 - 1.0);
                let lit = curvature(observation, spots, column, row, most);
                let inside = 0.0..SIDE as f32;
                if inside.contains(&column) && inside.contains(&row) {
                    let led = row as usize * SIDE + column as usize;
                    lit + spots.amplitude(led) / most
                } else {
                    lit
                }
            })
        });
        Self {
            place,
            other: least / most,
        }
    }

    fn stands_out(&self, column: usize, row: usize) -> bool {
        self.place[row][column] > 0.5 + 0.5 * self.other.max(0.0)
    }

    /// Places around the lattice that look like an LED that stands out.
    pub fn lit_around(&self) -> u32 {
        let places = || (0..PLACES).flat_map(|row| (0..PLACES).map(move |column| (column, row)));
        let outside = |&(column, row): &(usize, usize)| !((1..=SIDE).contains(&column) && (1..=SIDE).contains(&row));
        places()
            .filter(outside)
            .map(|(column, row)| u32::from(self.stands_out(column, row)))
            .sum()
    }

    /// By how many columns and rows a lattice has to move to hold the most LEDs: one that stands out counts as much as two others, where
    /// these show, or as one of a dim line, and as three if nothing else looks so. All that hold nearly as many, the best first.
    pub fn best_lines(&self) -> Vec<(i32, i32), 9> {
        let others = self.others();
        let dimmest = self.dimmest();
        let worth = |column: usize, row: usize| {
            let looks_like = |other: f32| (self.place[row][column] / other - 1.0).abs() < OFF_WITHIN;
            if self.stands_out(column, row) {
                let is_just_like = (self.place[row][column] - 1.0).abs() < JUST_LIKE;
                if is_just_like { 3 } else { 2 }
            } else {
                i32::from(self.place[row][column] > dimmest || others.is_some_and(looks_like))
            }
        };
        let held = |(column, row): (i32, i32)| -> i32 {
            let from = |lines: i32| (lines + 1) as usize..(lines + 1) as usize + SIDE;
            from(row).flat_map(|row| from(column).map(move |column| worth(column, row))).sum()
        };
        let mut lines: Vec<(i32, i32), 9> = (0..9).map(|i| (i % 3 - 1, i / 3 - 1)).collect();
        // Where lattices hold as many, that which is there comes first.
        lines.sort_unstable_by_key(|&(column, row)| (-held((column, row)), column.abs() + row.abs()));
        let most = lines.first().map_or(0, |&best| held(best));
        lines.retain(|&lines| held(lines) > most - LEAST_LINES_LEAD);
        lines
    }

    /// What the LEDs within the lattice that do not stand out usually show; `None` where that is next to nothing.
    fn others(&self) -> Option<f32> {
        let Usual { middle, deviation, count } = self.usual()?;
        let spread = deviation / libm::sqrtf(count.min(SIDE) as f32);
        (middle.abs() > (SEEN * spread).max(LEAST_OFF)).then_some(middle)
    }

    /// What an LED of a dim line shows at least: more than any other that does not stand out.
    fn dimmest(&self) -> f32 {
        self.usual().map_or(f32::INFINITY, |usual| {
            usual.middle.max(0.0) + (SEEN * usual.deviation).max(LEAST_DIM)
        })
    }

    /// The LEDs within the lattice that do not stand out.
    fn usual(&self) -> Option<Usual> {
        let mut seen: Vec<f32, LEDS> = Vec::new();
        for row in 1..=SIDE {
            for column in 1..=SIDE {
                if !self.stands_out(column, row) {
                    // There are no more than that.
                    let _full = seen.push(self.place[row][column]);
                }
            }
        }
        let middle = median_of(&mut seen)?;
        seen.iter_mut().for_each(|value| *value = (*value - middle).abs());
        Some(Usual {
            middle,
            deviation: median_of(&mut seen)?,
            count: seen.len(),
        })
    }
}

/// What some places show: the median, and the median deviation from it.
struct Usual {
    middle: f32,
    deviation: f32,
    count: usize,
}

pub(super) fn median_of(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (middle > 0).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// The lesser of the second differences along the row and the column of what the model leaves at a place, over that of a spot so high.
fn curvature(observation: Observation<'_, '_>, spots: &LatticeModel, column: f32, row: f32, height: f32) -> f32 {
    let left = |at| Some(unexplained(observation, spots, at));
    let [across, down] = second_differences(spots, [column, row], left).unwrap_or_default();
    let [a, b] = spots.lattice.pitch().map(|pitch| {
        let half = 0.5 * pitch / spots.sigma;
        height * (1.0 - libm::expf(-0.5 * half * half))
    });
    (across / a).min(down / b)
}

/// The second differences of a light over half a pitch, along the row and along the column; none where it is not known.
pub(super) fn second_differences(
    spots: &LatticeModel,
    [column, row]: [f32; 2],
    light: impl Fn([f32; 2]) -> Option<f32>,
) -> Option<[f32; 2]> {
    let light = |u: f32, v: f32| light(spots.lattice.position(column + u, row + v));
    let middle = light(0.0, 0.0)?;
    let across = middle - 0.5 * (light(-0.5, 0.0)? + light(0.5, 0.0)?);
    let down = middle - 0.5 * (light(0.0, -0.5)? + light(0.0, 0.5)?);
    Some([across, down])
}

/// The light at a position less the model's.
pub(super) fn unexplained(observation: Observation<'_, '_>, spots: &LatticeModel, at: [f32; 2]) -> f32 {
    let Some((light, white)) = light_at(observation, at) else {
        return 0.0;
    };
    let reach = REACH_FITTED * spots.sigma;
    let half = 0.5 / (spots.sigma * spots.sigma);
    let mut model = spots.background;
    for led in 0..LEDS {
        let [x, y] = spots.lattice.position((led % SIDE) as f32, (led / SIDE) as f32);
        let (dx, dy) = (at[0] - x, at[1] - y);
        let squared = dx * dx + dy * dy;
        if squared < reach * reach {
            model += spots.amplitude(led) * libm::expf(-half * squared);
        }
    }
    if white && model > light { 0.0 } else { light - model }
}

/// The light between pixels, and whether it is white.
pub(super) fn light_at(observation: Observation<'_, '_>, [x, y]: [f32; 2]) -> Option<(f32, bool)> {
    let frame: &Frame<'_> = observation.frame;
    let (i, j) = (libm::floorf(x), libm::floorf(y));
    if !(i >= 0.0 && j >= 0.0) {
        return None;
    }
    let (u, v) = (x - i, y - j);
    let (i, j) = (i as usize, j as usize);
    let upper: &[u8] = frame.row(j)?.get(i..i + 2)?;
    let lower: &[u8] = frame.row(j + 1)?.get(i..i + 2)?;
    let light = |grey: u8| observation.metric.light(grey);
    let above = light(upper[0]) + u * (light(upper[1]) - light(upper[0]));
    let below = light(lower[0]) + u * (light(lower[1]) - light(lower[0]));
    let white = upper.iter().chain(lower).any(|&grey| grey == u8::MAX);
    Some((above + v * (below - above), white))
}
