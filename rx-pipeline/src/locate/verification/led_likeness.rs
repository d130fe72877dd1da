//! The light at single places of the lattice and of a line beyond it, which shows the panel's lines.
//!
//! An On LED is brighter than the points halfway to its neighbours, along rows and along columns. If the board is brighter than Off LEDs,
//! these are darker than those points. Edges, a board's end and gradients are curved along one direction at most.

use super::shows_off;
use crate::locate::verification::Observation;
use crate::spots::LatticeModel;
use crate::spots::REACH_FITTED;
use heapless::Vec;
use link::panel::{LEDS, SIDE};

/// The least lead of the best lattice over those off by a line (count: 2 for an On LED, 3 for a typical one, 1 for a visible Off LED); with
/// less, their fits are compared. Higher: slower, and lines shown by one LED are doubted.
const LEAST_LINES_LEAD: i32 = 3;
/// A place is a typical LED if its likeness differs from 1 by less (share). Higher: a hot pixel or a corner may make a line; lower: lines
/// shown by one LED are doubted.
const JUST_LIKE: f32 = 0.3;
/// The least excess of an LED of a dim line over the usual Off LED (share of an On LED). Higher: panels with a dim outer line are off by a
/// line; lower: noise makes lines.
const LEAST_DIM: f32 = 0.12;
/// Off LEDs are visible if their places stand out by more (share of an On LED).
pub(super) const LEAST_OFF: f32 = 0.1;
/// The same (multiple of their median deviation, for eight of them together).
const SEEN: f32 = 4.0;
/// A place looks like an Off LED if it differs from the usual one by less (share of it).
const OFF_WITHIN: f32 = 0.5;

/// Places along a side: the lattice's, and one more at either end.
const PLACES: usize = SIDE + 2;

/// The likeness of each place to an LED that stands out, as On or, on a bright board, as Off: about 1 at such an LED.
pub(super) struct LedLikeness {
    place: [[f32; PLACES]; PLACES],
    /// The level of an LED in the other state.
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

    /// Shifts of the lattice, in columns and rows, that make it hold the most LEDs, the best first; all within [`LEAST_LINES_LEAD`] of the
    /// best. An LED that stands out counts 2, or 3 if it is typical. A visible LED of the other state, or one of a dim line, counts 1.
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
        // Among equals, the smallest shift comes first.
        lines.sort_unstable_by_key(|&(column, row)| (-held((column, row)), column.abs() + row.abs()));
        let most = lines.first().map_or(0, |&best| held(best));
        lines.retain(|&lines| held(lines) > most - LEAST_LINES_LEAD);
        lines
    }

    /// The usual level of the LEDs within the lattice that do not stand out; `None` if it is negligible.
    fn others(&self) -> Option<f32> {
        let LevelSpread { middle, deviation, count } = self.usual()?;
        let spread = deviation / libm::sqrtf(count.min(SIDE) as f32);
        (middle.abs() > (SEEN * spread).max(LEAST_OFF)).then_some(middle)
    }

    /// The least level of an LED of a dim line: above all others that do not stand out.
    fn dimmest(&self) -> f32 {
        self.usual().map_or(f32::INFINITY, |usual| {
            usual.middle.max(0.0) + (SEEN * usual.deviation).max(LEAST_DIM)
        })
    }

    /// The LEDs within the lattice that do not stand out.
    fn usual(&self) -> Option<LevelSpread> {
        let mut seen: Vec<f32, LEDS> = Vec::new();
        for row in 1..=SIDE {
            for column in 1..=SIDE {
                if !self.stands_out(column, row) {
                    // The capacity holds all LEDs.
                    let _full = seen.push(self.place[row][column]);
                }
            }
        }
        let middle = median_of(&mut seen)?;
        seen.iter_mut().for_each(|value| *value = (*value - middle).abs());
        Some(LevelSpread {
            middle,
            deviation: median_of(&mut seen)?,
            count: seen.len(),
        })
    }
}

/// The level of some places: the median, and the median deviation from it.
struct LevelSpread {
    middle: f32,
    deviation: f32,
    count: usize,
}

pub(super) fn median_of(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (middle > 0).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// The lesser of the second differences of the residual along the row and the column, relative to a spot of that height.
fn curvature(observation: Observation<'_, '_>, spots: &LatticeModel, column: f32, row: f32, height: f32) -> f32 {
    let left = |at| Some(unexplained(observation, spots, at));
    let [across, down] = second_differences(spots, [column, row], left).unwrap_or_default();
    let [a, b] = spots.lattice.pitch().map(|pitch| {
        let half = 0.5 * pitch / spots.sigma;
        height * (1.0 - libm::expf(-0.5 * half * half))
    });
    (across / a).min(down / b)
}

/// The second differences of a light over half a pitch, along the row and along the column; `None` if the light is unknown.
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

/// The light at a position minus the model's.
pub(super) fn unexplained(observation: Observation<'_, '_>, spots: &LatticeModel, at: [f32; 2]) -> f32 {
    let Some((light, white)) = observation.light_at(at) else {
        return 0.0;
    };
    let reach = REACH_FITTED * spots.sigma;
    let half = 0.5 / (spots.sigma * spots.sigma);
    let mut model = spots.background + observation.shade.map_or(0.0, |shade| shade.at(at));
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
