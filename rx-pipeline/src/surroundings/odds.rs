//! The odds of a panel in one place of a picture against another.

use super::places::{AROUND, ON_BOARD};
use super::tiles::{Offsets, ROOM, TILES, Tiles, offsets};
use super::{DEVIATION, DEVIATION_AROUND, Level, Surroundings};
use crate::lattice::{Lattice, MIDDLE};
use core::ops::Range;

/// Grey levels per bin of the picture's histogram.
const BIN: usize = 8;
/// Probability that a place around has changed, because something passes or the panel leaves its ground.
const CHANGED: f32 = 0.04;
/// Probability that an LED was switched in the exposure, so that it is neither On nor Off.
const BETWEEN: f32 = 0.4;
/// The least density of an LED's grey level (per grey level): a lamp in its place.
const OUTLIER: f32 = 1e-5;
/// The weight of each place around the LEDs (share), because neighbouring places are not independent.
const NEW: f32 = 0.9;
/// The log odds against a panel that moves by itself, before a ground at rest (nats). Higher: such a panel is followed a line off; lower:
/// readings in clutter lose weight.
const APART: f32 = 12.0;
/// The uniform part of the distribution of grey levels elsewhere in the picture (share). Less: places of rare grey levels count for more,
/// such as those halfway between LEDs.
const ANY: f32 = 0.5;
/// The decay of the prior with the distance from the expected place (power of its square). Lower: panels that jump are followed sooner, and
/// clutter is too.
const STEEPNESS: f32 = 2.0;
/// Maximum deficit of a candidate by its LEDs alone before its surroundings are ignored (nats).
const BEHIND: f32 = 30.0;
/// Candidates whose surroundings are used, at most (count).
const CANDIDATES: usize = 48;
/// Candidates that climb to the likeliest neighbour, at most (count).
pub(super) const PEAKS: usize = 6;
/// The steps of a climb (count).
const CLIMBS: usize = 3;
/// Candidates this close to a likelier one are left out (tiles).
const BESIDE: i32 = 1;
/// The step between tried rotations (rad).
const TURN_RAD: f32 = 0.03;
/// The number of tried rotations either way (count). More: faster rotations are followed, and slower.
const TURNS: i32 = 4;
/// The usual deviation of a panel's rotation from the expected one (rad).
const TURNED_RAD: f32 = 0.04;

/// A place that is likelier than its neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    /// Tiles from the expected place.
    pub at: [i32; 2],
    pub lattice: Lattice,
    /// Its log odds.
    pub odds: f32,
    /// A neighbour that is likelier still.
    higher: Option<[i32; 2]>,
}

/// The odds of places in a picture.
pub(super) struct Odds<'a> {
    tiles: &'a Tiles,
    expected: Lattice,
    /// The known places in a panel rotated by an angle (rad).
    turns: [(f32, Offsets); 2 * TURNS as usize + 1],
    usual: Histogram,
    /// For each grey level, the log odds of an LED.
    led: [f32; 256],
    around: [AroundOdds; AROUND],
    /// The least log odds of a place around.
    changed: f32,
    /// The log odds of the ground if the panel moves before it.
    ground_at_rest: f32,
    /// The usual distance of the panel from its expected place (tiles).
    spread: f32,
}

impl<'a> Odds<'a> {
    /// For a panel with those surroundings that is usually `spread` pitches from its expected place, and was last seen on `last`.
    pub fn new(known: &Surroundings, tiles: &'a Tiles, expected: &Lattice, last: &Lattice, spread: f32) -> Self {
        let usual = Histogram::of(tiles);
        let [least, least_around] = [DEVIATION, DEVIATION_AROUND].map(|share| known.least_variance(share));
        let [off, on] = [known.off, known.on].map(|level| level.with_variance_from(least));
        let (low, high) = (off.mean.min(on.mean), off.mean.max(on.mean));
        let between = BETWEEN / (high - low + 1.0);
        let led = core::array::from_fn(|level| {
            let grey = level as f32;
            let switched = if (low..=high).contains(&grey) { between } else { 0.0 };
            let density = 0.5 * (1.0 - BETWEEN) * (off.density(grey) + on.density(grey)) + switched;
            libm::logf(density + OUTLIER) - usual.log_density(level as u8)
        });
        let turns = core::array::from_fn(|i| {
            let roll = (i as i32 - TURNS) as f32 * TURN_RAD;
            (roll, offsets(expected, roll))
        });
        let mut odds = Self {
            tiles,
            expected: *expected,
            turns,
            usual,
            led,
            around: known.around.map(|level| AroundOdds::of(level.with_variance_from(least_around))),
            changed: libm::logf(CHANGED),
            ground_at_rest: f32::NEG_INFINITY,
            spread: spread * TILES as f32,
        };
        odds.ground_at_rest = odds.of_ground_at_rest(last) - APART;
        odds
    }

    /// The log odds of the ground around the panel's last place, if the camera is at rest.
    fn of_ground_at_rest(&self, last: &Lattice) -> f32 {
        let tiles = |c: f32| libm::roundf((c - MIDDLE) * TILES as f32) as i32;
        let at = self.expected.coordinates(last.centre).map(|at| at.map(tiles));
        let Some(at) = at.filter(|at| at.iter().all(|c| c.abs() <= ROOM)) else {
            return f32::NEG_INFINITY;
        };
        let upright = &self.turns[TURNS as usize].1;
        let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| within(at, [dx, dy])));
        near.map(|at| self.of_around(upright, at, ON_BOARD..AROUND))
            .fold(f32::NEG_INFINITY, f32::max)
    }

    /// The log prior of a panel this many tiles from its expected place.
    fn before(&self, [i, j]: [i32; 2]) -> f32 {
        -STEEPNESS * libm::logf(1.0 + (i * i + j * j) as f32 / (self.spread * self.spread))
    }

    /// The same plus the evidence of its LEDs.
    fn of_leds(&self, offsets: &Offsets, at: [i32; 2]) -> f32 {
        let greys = self.tiles.at(at, &offsets.leds);
        self.before(at) + greys.map(|grey| self.led[usize::from(grey)]).sum::<f32>()
    }

    /// The same plus the evidence of its surroundings: of its board, and of the ground, before which it may move by itself.
    fn of_all(&self, offsets: &Offsets, at: [i32; 2]) -> f32 {
        let board = self.of_around(offsets, at, 0..ON_BOARD);
        let ground = self.of_around(offsets, at, ON_BOARD..AROUND);
        self.of_leds(offsets, at) + board + ground.max(self.ground_at_rest)
    }

    /// The evidence of some places around.
    fn of_around(&self, offsets: &Offsets, at: [i32; 2], some: Range<usize>) -> f32 {
        let greys = self.tiles.at(at, &offsets.around[some.clone()]);
        let around = greys.zip(&self.around[some]).map(|(grey, odds)| {
            let odds = odds.log_density(grey) - self.usual.log_density(grey);
            odds.max(self.changed)
        });
        NEW * around.sum::<f32>()
    }

    /// The likely places by their LEDs.
    fn likeliest_by_leds(&self, offsets: &Offsets) -> heapless::Vec<([i32; 2], f32), CANDIDATES> {
        let mut likeliest = heapless::Vec::<([i32; 2], f32), CANDIDATES>::new();
        let mut highest = f32::NEG_INFINITY;
        for at in (-ROOM..=ROOM).flat_map(|j| (-ROOM..=ROOM).map(move |i| [i, j])) {
            let odds = self.of_leds(offsets, at);
            highest = highest.max(odds);
            if odds < highest - BEHIND {
                continue;
            }
            if likeliest.is_full() {
                likeliest.retain(|(_, odds)| *odds > highest - BEHIND);
            }
            if let Err(one_more) = likeliest.push((at, odds)) {
                let least = likeliest.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1));
                if let Some(least) = least.filter(|least| least.1 < one_more.1) {
                    *least = one_more;
                }
            }
        }
        likeliest
    }

    /// The log odds of the expected place.
    pub fn as_expected(&self) -> f32 {
        let turned = self.turns.iter().map(|turn| turn_odds(turn.0) + self.of_all(&turn.1, [0; 2]));
        turned.fold(f32::NEG_INFINITY, f32::max)
    }

    /// The likeliest places, no two of them neighbours.
    pub fn peaks(&self) -> heapless::Vec<Peak, PEAKS> {
        let upright = &self.turns[TURNS as usize].1;
        let mut places = self.likeliest_by_leds(upright);
        for (at, odds) in &mut places {
            *odds = self.of_all(upright, *at);
        }
        let mut peaks = heapless::Vec::new();
        while let Some(&(at, _)) = places.iter().max_by(|a, b| a.1.total_cmp(&b.1))
            && peaks.push(self.peak_about(at)).is_ok()
        {
            places.retain(|(other, _)| (0..2).any(|axis| (other[axis] - at[axis]).abs() > BESIDE));
        }
        peaks
    }

    /// The likeliest place within reach of this one, at its likeliest rotation.
    pub fn peak_about(&self, mut at: [i32; 2]) -> Peak {
        let mut peak = self.peak_at(at);
        for _ in 0..CLIMBS {
            let Some(higher) = peak.higher else { break };
            at = higher;
            peak = self.peak_at(at);
        }
        peak
    }

    /// The likeliest rotation in a place, and the position to a fraction of a tile.
    fn peak_at(&self, at: [i32; 2]) -> Peak {
        let turned = self.turns.iter().map(|(roll, offsets)| {
            let odds = [-1, 0, 1].map(|dy| [-1, 0, 1].map(|dx| self.of_all(offsets, within(at, [dx, dy]))));
            let highest = odds.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
            (highest + turn_odds(*roll), *roll, odds)
        });
        let (odds, roll, around) = turned
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f32::NEG_INFINITY, 0.0, [[0.0; 3]; 3]));
        let [[_, above, _], [left, here, right], [_, below, _]] = around;
        let ([dx, across], [dy, down]) = (peak(left, here, right), peak(above, here, below));
        let mut lattice = self.expected.rolled(roll);
        for axis in 0..2 {
            let [column, row] = [self.expected.column[axis], self.expected.row[axis]];
            lattice.centre[axis] += ((at[0] as f32 + dx) * column + (at[1] as f32 + dy) * row) / TILES as f32;
        }
        let highest = around.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
        let step = (0..9).find(|i| around[i / 3][i % 3] == highest).filter(|&i| i != 4);
        let higher = step
            .map(|i| within(at, [i as i32 % 3 - 1, i as i32 / 3 - 1]))
            .filter(|higher| *higher != at);
        Peak {
            at,
            lattice,
            odds: if higher.is_none() { odds + across + down } else { odds },
            higher,
        }
    }
}

/// The log prior of a panel rotated by that angle.
fn turn_odds(roll_rad: f32) -> f32 {
    let share = roll_rad / TURNED_RAD;
    -0.5 * share * share
}

/// A place moved by a few tiles, within the limits.
fn within(at: [i32; 2], by: [i32; 2]) -> [i32; 2] {
    core::array::from_fn(|axis| (at[axis] + by[axis]).clamp(-ROOM, ROOM))
}

/// The density of grey levels in an unchanged place around the panel.
struct AroundOdds {
    mean: f32,
    height: f32,
    curvature: f32,
}

impl AroundOdds {
    fn of(level: Level) -> Self {
        Self {
            mean: level.mean,
            height: libm::logf((1.0 - CHANGED) / libm::sqrtf(core::f32::consts::TAU * level.variance)),
            curvature: 0.5 / level.variance,
        }
    }

    fn log_density(&self, grey: u8) -> f32 {
        let off = f32::from(grey) - self.mean;
        self.height - self.curvature * off * off
    }
}

/// The distribution of grey levels.
struct Histogram {
    log_density: [f32; 256 / BIN],
}

impl Histogram {
    fn of(tiles: &Tiles) -> Self {
        let mut counts = [1u32; 256 / BIN];
        tiles.iter().for_each(|grey| counts[usize::from(grey) / BIN] += 1);
        let all = (tiles.len() + counts.len()) as f32 * BIN as f32;
        Self {
            log_density: counts.map(|count| libm::logf((1.0 - ANY) * count as f32 / all + ANY / 256.0)),
        }
    }

    fn log_density(&self, grey: u8) -> f32 {
        self.log_density[usize::from(grey) / BIN]
    }
}

/// The maximum of a parabola through three neighbours, with the middle one the highest: its offset from the middle, and its height above.
fn peak(before: f32, here: f32, after: f32) -> [f32; 2] {
    let (slope, curvature) = (0.5 * (after - before), before - 2.0 * here + after);
    if curvature < 0.0 {
        let at = (-slope / curvature).clamp(-0.5, 0.5);
        [at, at * (slope + 0.5 * curvature * at)]
    } else {
        [0.0; 2]
    }
}
