//! Where a panel has gone from one frame to the next, by what stands around it.
//!
//! A panel's bits change from frame to frame, but its surroundings move with the camera. A place is likely if each LED there is at one of
//! two levels, no matter which, and if everything around them looks as it did. Each place is rated by the logarithm of its odds against a
//! part of the picture that has nothing to do with the panel, where grey levels are as frequent as in the whole picture.
//!
//! The picture is drawn in tiles that are a quarter of the LEDs' pitch wide and turned with the panel. A candidate's odds are then a sum of
//! table look-ups: over the 64 LEDs for every candidate, and over the surroundings for those that the LEDs leave likely.

use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use link::panel::{LEDS, PanelFrame, SIDE};

/// Lines of places around the LEDs that are known (count). More: surer among clutter, and slower.
const RINGS: usize = 3;
/// Places along a side, those of LEDs among them.
const SPAN: usize = SIDE + 2 * RINGS;
/// Places around the LEDs.
const AROUND: usize = SPAN * SPAN - LEDS;
/// Tiles in a pitch (count). More: finer places, and slower.
const TILES: usize = 4;
/// Samples along a tile's side, at most (count).
const SAMPLES: usize = 2;
/// The most tiles along a side of the picture.
const SIDE_MAX: usize = 88;
/// Panels are never expected nearer to their place (pitches).
const LEAST_SPREAD: f32 = 0.15;
/// How far from the middle of the picture a panel is looked for (tiles).
const ROOM: i32 = ((SIDE_MAX - TILES * (SPAN + 1)) / 2) as i32;
/// Turns that are tried (rad), so many either way. More: panels that turn faster are followed, and slower.
const TURN_RAD: f32 = 0.03;
/// See there (count).
const TURNS: i32 = 4;
/// How far panels usually turn otherwise than before (rad).
const TURNED_RAD: f32 = 0.04;
/// A panel that is not likelier in one place than in another by more is in neither (nats).
const AMBIGUOUS: f32 = 3.0;
/// A panel that is not likelier elsewhere by more is where it was expected (nats).
const CLEARLY: f32 = 15.0;
/// One that is not likelier by more may be in the other (nats).
const RIVAL: f32 = 15.0;
/// A panel with no corner farther off is where it was expected (pitches), nor is one that is off by less than a tile tells (px).
const OFF: f32 = 0.25;
/// See there.
const OFF_PX: f32 = 1.0;
/// Greys that count as one in the picture's histogram.
const BIN: usize = 8;
/// Probability that a place around is not as it was, since something passes or the panel leaves its ground.
const CHANGED: f32 = 0.04;
/// Probability that an LED is neither On nor Off, but was switched in the exposure.
const BETWEEN: f32 = 0.4;
/// The least deviation of a place, and of an LED's level (share of the contrast): a place between two tiles.
const DEVIATION: f32 = 0.08;
/// What a place around the LEDs adds to what its neighbours have said (share): they are not independent.
const NEW: f32 = 0.9;
/// Logarithm of the odds by which a candidate may lie behind by its LEDs and still be looked at with its surroundings (nats).
const BEHIND: f32 = 30.0;
/// Candidates looked at with their surroundings, at most (count).
const CANDIDATES: usize = 48;
/// Candidates nearer than that to the best are the same place (tiles).
const SAME: i32 = 3;
/// What a frame changes of what is known (share).
const GAIN: f32 = 0.15;
/// Places just around the LEDs that may differ by more than [`FAR`] before the panel has moved (count).
const DIFFERING: usize = 2;
/// See there (deviations).
const FAR: f32 = 3.5;

/// Room for a picture in tiles.
pub(crate) struct Tiles([u8; SIDE_MAX * SIDE_MAX]);

impl Tiles {
    pub const EMPTY: Self = Self([0; SIDE_MAX * SIDE_MAX]);
}

/// What is known of a panel's levels and its surroundings, in grey levels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    around: [Level; AROUND],
    off: Level,
    on: Level,
    is_known: bool,
}

/// A grey level and its variance.
#[derive(Clone, Copy, Debug)]
struct Level {
    mean: f32,
    variance: f32,
}

/// Where a panel is likeliest to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub lattice: Lattice,
    /// By how much likelier it is there than where it is expected (nats).
    gain: f32,
    /// The likeliest place elsewhere if that is not much less likely, and by how much it is (nats).
    pub rival: Option<(Lattice, f32)>,
    /// Whether it is at the end of what was looked at.
    is_at_edge: bool,
}

impl Placement {
    /// Whether the panel is so far from where it was expected that a fit would not find it from there, and hardly anywhere else. A fit is
    /// finer.
    pub fn is_off(&self, expected: &Lattice) -> bool {
        let is_ambiguous = self.rival.is_some_and(|(_, behind)| behind < AMBIGUOUS);
        if is_ambiguous || self.gain < CLEARLY {
            return false;
        }
        let limit = (OFF * expected.pitch()[0]).max(OFF_PX);
        let pairs = self.lattice.corners().into_iter().zip(expected.corners());
        pairs.into_iter().any(|(a, b)| libm::hypotf(a[0] - b[0], a[1] - b[1]) > limit)
    }
}

impl Surroundings {
    pub const UNKNOWN: Self = Self {
        around: [Level::NONE; AROUND],
        off: Level::NONE,
        on: Level::NONE,
        is_known: false,
    };

    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// Learns from a frame in which the panel on `lattice` shows `bits`.
    pub fn learn(&mut self, frame: &Frame<'_>, lattice: &Lattice, bits: PanelFrame) {
        let mut levels = [Sums::default(); 2];
        let mut around = [0.0; AROUND];
        for (place, grey) in places().zip(greys(frame, lattice)) {
            match place {
                Place::Led(led) => levels[usize::from(bits.led(led))].add(grey),
                Place::Around(i) => around[i] = grey,
            }
        }
        let [off, on] = levels.map(|sums| sums.level());
        let (Some(off), Some(on)) = (off, on) else { return };
        if self.is_known {
            self.off.go_on(off.mean, off.variance);
            self.on.go_on(on.mean, on.variance);
        } else {
            (self.off, self.on) = (off, on);
        }
        let contrast = (self.on.mean - self.off.mean).abs();
        for (level, grey) in self.around.iter_mut().zip(around) {
            if self.is_known {
                let off = grey - level.mean;
                level.go_on(grey, off * off);
            } else {
                *level = Level {
                    mean: grey,
                    variance: (0.2 * contrast) * (0.2 * contrast),
                };
            }
        }
        self.is_known = true;
    }

    /// Whether the places just around a panel on `lattice` are as they were.
    pub fn agrees(&self, frame: &Frame<'_>, lattice: &Lattice) -> bool {
        let least = self.least_variance();
        let differing = places()
            .zip(coordinates())
            .filter(|(_, [column, row])| {
                let near = -1.5..SIDE as f32 + 0.5;
                near.contains(column) && near.contains(row)
            })
            .filter_map(|(place, at)| match place {
                Place::Around(i) => Some((self.around[i], at)),
                Place::Led(_) => None,
            })
            .filter(|(level, at)| {
                let off = grey(frame, lattice, *at) - level.mean;
                off * off > FAR * FAR * level.variance.max(least)
            })
            .count();
        differing <= DIFFERING
    }

    fn least_variance(&self) -> f32 {
        let deviation = DEVIATION * (self.on.mean - self.off.mean).abs() + 1.5;
        deviation * deviation
    }

    /// The likeliest place of a panel that is usually `spread` pitches off where it is expected.
    pub fn place(&self, frame: &Frame<'_>, expected: &Lattice, spread: f32, tiles: &mut Tiles) -> Placement {
        let placement = self.place_near(frame, expected, spread, tiles);
        if placement.is_at_edge {
            // It may be farther off.
            return self.place_near(frame, &placement.lattice, spread, tiles);
        }
        placement
    }

    fn place_near(&self, frame: &Frame<'_>, expected: &Lattice, spread: f32, tiles: &mut Tiles) -> Placement {
        draw(frame, expected, &mut tiles.0);
        let usual = Histogram::of(&tiles.0);
        let odds = Odds {
            tiles: &tiles.0,
            led: self.led_odds(&usual),
            around: self.around_odds(),
            usual,
            spread: spread.max(LEAST_SPREAD),
        };
        let upright = offsets(expected, 0.0);
        let mut places = odds.likeliest_by_leds(&upright);
        for (at, of) in &mut places {
            *of = odds.of_all(&upright, *at);
        }
        let &(at, likeliest) = places.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(&([0; 2], 0.0));
        let is_elsewhere = |other: &[i32; 2]| (0..2).any(|axis| (other[axis] - at[axis]).abs() >= SAME);
        let elsewhere = places.iter().filter(|(other, _)| is_elsewhere(other));
        let rival = elsewhere.max_by(|a, b| a.1.total_cmp(&b.1));
        Placement {
            lattice: odds.refined(expected, at),
            gain: likeliest - odds.of_all(&upright, [0; 2]),
            rival: rival
                .map(|&(other, less)| (other, likeliest - less))
                .filter(|(_, behind)| *behind < RIVAL)
                .map(|(other, behind)| (odds.refined(expected, other), behind)),
            is_at_edge: at.iter().any(|c| c.abs() > ROOM - TILES as i32),
        }
    }

    /// Of each grey level, the logarithm of the odds that an LED has it.
    fn led_odds(&self, usual: &Histogram) -> [f32; 256] {
        let least = self.least_variance();
        let [off, on] = [self.off, self.on].map(|level| Level {
            variance: level.variance.max(least),
            ..level
        });
        let (low, high) = (off.mean.min(on.mean), off.mean.max(on.mean));
        let between = BETWEEN / (high - low + 1.0);
        core::array::from_fn(|grey| {
            let grey = grey as f32;
            let switched = if (low..=high).contains(&grey) { between } else { 0.0 };
            let density = 0.5 * (1.0 - BETWEEN) * (off.density(grey) + on.density(grey)) + switched;
            libm::logf(density + 1e-5) - usual.log_density(grey as u8)
        })
    }

    fn around_odds(&self) -> [AroundOdds; AROUND] {
        let least = self.least_variance();
        self.around.map(|level| {
            let variance = level.variance.max(least);
            AroundOdds {
                mean: level.mean,
                height: libm::logf((1.0 - CHANGED) / libm::sqrtf(core::f32::consts::TAU * variance)),
                curvature: 0.5 / variance,
            }
        })
    }
}

/// The odds of places in a picture.
struct Odds<'a> {
    tiles: &'a [u8],
    led: [f32; 256],
    around: [AroundOdds; AROUND],
    usual: Histogram,
    spread: f32,
}

impl Odds<'_> {
    /// The logarithm of the odds that the panel is so many tiles off, before the picture is looked at.
    fn before(&self, [i, j]: [i32; 2]) -> f32 {
        let tiles = self.spread * TILES as f32;
        -2.0 * libm::logf(1.0 + (i * i + j * j) as f32 / (tiles * tiles))
    }

    /// The same by what its LEDs would show.
    fn of_leds(&self, offsets: &Offsets, at: [i32; 2]) -> f32 {
        let start = start(at);
        let greys = offsets.leds.iter().map(|&offset| self.tiles[start.wrapping_add_signed(offset)]);
        self.before(at) + greys.map(|grey| self.led[usize::from(grey)]).sum::<f32>()
    }

    /// The same by what is around it, too.
    fn of_all(&self, offsets: &Offsets, at: [i32; 2]) -> f32 {
        let start = start(at);
        let greys = offsets.around.iter().map(|&offset| self.tiles[start.wrapping_add_signed(offset)]);
        let around = greys.zip(&self.around).map(|(grey, odds)| odds.of(grey, &self.usual));
        self.of_leds(offsets, at) + NEW * around.sum::<f32>()
    }

    /// The places that are likely by their LEDs.
    fn likeliest_by_leds(&self, offsets: &Offsets) -> heapless::Vec<([i32; 2], f32), CANDIDATES> {
        let mut likeliest = heapless::Vec::<([i32; 2], f32), CANDIDATES>::new();
        let mut highest = f32::NEG_INFINITY;
        for j in -ROOM..=ROOM {
            for i in -ROOM..=ROOM {
                let odds = self.of_leds(offsets, [i, j]);
                highest = highest.max(odds);
                if odds < highest - BEHIND {
                    continue;
                }
                if likeliest.is_full() {
                    likeliest.retain(|(_, odds)| *odds > highest - BEHIND);
                }
                if let Err(one_more) = likeliest.push(([i, j], odds)) {
                    let least = likeliest.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1));
                    if let Some(least) = least.filter(|least| least.1 < one_more.1) {
                        *least = one_more;
                    }
                }
            }
        }
        likeliest
    }

    /// A place between tiles, and the panel turned as it is likeliest.
    fn refined(&self, expected: &Lattice, at: [i32; 2]) -> Lattice {
        let odds_of = |offsets: &Offsets| [-1, 0, 1].map(|dy| [-1, 0, 1].map(|dx| self.of_all(offsets, within(at, [dx, dy]))));
        let highest = |odds: &[[f32; 3]; 3]| odds.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
        let (mut roll, mut best) = (0.0, odds_of(&offsets(expected, 0.0)));
        for turns in -TURNS..=TURNS {
            let turned = turns as f32 * TURN_RAD;
            let odds = odds_of(&offsets(expected, turned));
            let less = 0.5 * (turned / TURNED_RAD) * (turned / TURNED_RAD);
            if highest(&odds) - less > highest(&best) - 0.5 * (roll / TURNED_RAD) * (roll / TURNED_RAD) {
                (roll, best) = (turned, odds);
            }
        }
        let [[_, above, _], [left, here, right], [_, below, _]] = best;
        let by = [at[0] as f32 + peak(left, here, right), at[1] as f32 + peak(above, here, below)];
        let mut lattice = turned(expected, roll);
        for axis in 0..2 {
            lattice.centre[axis] += (by[0] * expected.column[axis] + by[1] * expected.row[axis]) / TILES as f32;
        }
        lattice
    }
}

/// The tile that is so many from the middle.
fn start([i, j]: [i32; 2]) -> usize {
    let middle = (SIDE_MAX / 2 * SIDE_MAX + SIDE_MAX / 2) as i32;
    (middle + j * SIDE_MAX as i32 + i) as usize
}

/// A place moved by so many tiles, as far as there are tiles around it.
fn within(at: [i32; 2], by: [i32; 2]) -> [i32; 2] {
    core::array::from_fn(|axis| (at[axis] + by[axis]).clamp(-ROOM, ROOM))
}

fn turned(lattice: &Lattice, roll_rad: f32) -> Lattice {
    let (sin, cos) = (libm::sinf(roll_rad), libm::cosf(roll_rad));
    let turn = |[x, y]: [f32; 2]| [cos * x - sin * y, sin * x + cos * y];
    Lattice {
        column: turn(lattice.column),
        row: turn(lattice.row),
        ..*lattice
    }
}

/// The logarithm of the odds of a place around the panel.
struct AroundOdds {
    mean: f32,
    height: f32,
    curvature: f32,
}

impl AroundOdds {
    fn of(&self, grey: u8, usual: &Histogram) -> f32 {
        let off = f32::from(grey) - self.mean;
        // ln(CHANGED)
        (self.height - self.curvature * off * off - usual.log_density(grey)).max(-3.2)
    }
}

impl Level {
    const NONE: Self = Self { mean: 0.0, variance: 0.0 };

    fn go_on(&mut self, mean: f32, variance: f32) {
        self.mean += GAIN * (mean - self.mean);
        self.variance += GAIN * (variance - self.variance);
    }

    fn density(&self, grey: f32) -> f32 {
        let off = grey - self.mean;
        libm::expf(-0.5 * off * off / self.variance) / libm::sqrtf(core::f32::consts::TAU * self.variance)
    }
}

#[derive(Clone, Copy, Default)]
struct Sums {
    count: f32,
    sum: f32,
    squares: f32,
}

impl Sums {
    fn add(&mut self, grey: f32) {
        self.count += 1.0;
        self.sum += grey;
        self.squares += grey * grey;
    }

    fn level(&self) -> Option<Level> {
        if self.count < 3.0 {
            return None;
        }
        let mean = self.sum / self.count;
        Some(Level {
            mean,
            variance: (self.squares / self.count - mean * mean).max(0.0),
        })
    }
}

/// How frequent grey levels are.
struct Histogram {
    log_density: [f32; 256 / BIN],
}

impl Histogram {
    fn of(tiles: &[u8]) -> Self {
        let mut counts = [1u32; 256 / BIN];
        tiles.iter().for_each(|&grey| counts[usize::from(grey) / BIN] += 1);
        let all = (tiles.len() + counts.len()) as f32 * BIN as f32;
        Self {
            log_density: counts.map(|count| libm::logf(count as f32 / all)),
        }
    }

    fn log_density(&self, grey: u8) -> f32 {
        self.log_density[usize::from(grey) / BIN]
    }
}

/// A place that is known.
enum Place {
    Led(usize),
    Around(usize),
}

/// Columns and rows of the known places, row by row.
fn coordinates() -> impl Iterator<Item = [f32; 2]> {
    (0..SPAN * SPAN).map(|i| [(i % SPAN) as f32 - RINGS as f32, (i / SPAN) as f32 - RINGS as f32])
}

/// The known places, row by row.
fn places() -> impl Iterator<Item = Place> {
    let inside = RINGS..RINGS + SIDE;
    let mut around = 0;
    (0..SPAN * SPAN).map(move |i| {
        let (column, row) = (i % SPAN, i / SPAN);
        if inside.contains(&column) && inside.contains(&row) {
            Place::Led((row - RINGS) * SIDE + column - RINGS)
        } else {
            around += 1;
            Place::Around(around - 1)
        }
    })
}

/// The grey levels of the known places.
fn greys<'a>(frame: &'a Frame<'_>, lattice: &'a Lattice) -> impl Iterator<Item = f32> + 'a {
    coordinates().map(|at| grey(frame, lattice, at))
}

/// The mean grey level of a place, half a pitch wide.
fn grey(frame: &Frame<'_>, lattice: &Lattice, [column, row]: [f32; 2]) -> f32 {
    let [x, y] = lattice.position(column, row);
    let samples = 2 * samples(lattice);
    let mut sum = 0;
    for i in 0..samples * samples {
        let part = |i: usize| ((i as f32 + 0.5) / samples as f32 - 0.5) * 2.0 / TILES as f32;
        let (u, v) = (part(i % samples), part(i / samples));
        let at = |axis: usize| u * lattice.column[axis] + v * lattice.row[axis];
        sum += u32::from(pixel(frame, x + at(0), y + at(1)));
    }
    sum as f32 / (samples * samples) as f32
}

/// Samples along a tile's side.
fn samples(lattice: &Lattice) -> usize {
    let [across, down] = lattice.pitch();
    (libm::ceilf(across.max(down) / TILES as f32) as usize).clamp(1, SAMPLES)
}

/// The nearest pixel; beyond its edges a frame goes on as it ends.
fn pixel(frame: &Frame<'_>, x: f32, y: f32) -> u8 {
    let nearest = |at: f32, count: usize| ((at + 0.5) as usize).min(count - 1);
    let row = frame.row(nearest(y, frame.height())).unwrap_or_default();
    row.get(nearest(x, frame.width())).copied().unwrap_or_default()
}

/// Draws tiles, each the mean of half a pitch around it, the panel's middle at the one in the middle.
fn draw(frame: &Frame<'_>, lattice: &Lattice, tiles: &mut [u8]) {
    let samples = samples(lattice);
    let step = 1.0 / (TILES * samples) as f32;
    let [column, row] = [lattice.column, lattice.row].map(|axis| axis.map(|c| c * step));
    let middle = (SIDE_MAX / 2 * samples) as f32 - 0.5;
    for (j, line) in tiles.chunks_exact_mut(SIDE_MAX).enumerate() {
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
    for j in (1..SIDE_MAX).rev() {
        for i in (1..SIDE_MAX).rev() {
            let at = |dx: usize, dy: usize| u32::from(tiles[(j - dy) * SIDE_MAX + i - dx]);
            tiles[j * SIDE_MAX + i] = ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8;
        }
    }
}

/// Where the known places are in tiles, from the panel's middle.
struct Offsets {
    leds: [isize; LEDS],
    around: [isize; AROUND],
}

fn offsets(lattice: &Lattice, roll_rad: f32) -> Offsets {
    let flat = Lattice {
        tilt: [0.0; 2],
        ..*lattice
    };
    let seen = turned(lattice, roll_rad);
    let most = (SIDE_MAX / 2) as f32 - ROOM as f32 - 1.0;
    let mut offsets = Offsets {
        leds: [0; LEDS],
        around: [0; AROUND],
    };
    for (place, [column, row]) in places().zip(coordinates()) {
        let at = flat.coordinates(seen.position(column, row)).unwrap_or([MIDDLE; 2]);
        let [across, down] = at.map(|at| libm::roundf((at - MIDDLE) * TILES as f32).clamp(-most, most) as isize);
        let offset = down * SIDE_MAX as isize + across;
        match place {
            Place::Led(led) => offsets.leds[led] = offset,
            Place::Around(i) => offsets.around[i] = offset,
        }
    }
    offsets
}

/// Where a parabola through three neighbours is highest, from the middle one, which is the highest of them.
fn peak(before: f32, here: f32, after: f32) -> f32 {
    let curvature = before - 2.0 * here + after;
    if curvature < 0.0 {
        (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Scene;

    const WALL: Scene = Scene {
        width: 160,
        height: 160,
        centre: [79.3, 80.6],
        noise_grey: 1.0,
        ..Scene::PLAIN
    };

    /// How far from the truth a panel is placed (pitches), which has been seen in `scene` and is now `by` px elsewhere, showing `bits`.
    fn off(scene: Scene, by: [f32; 2], bits: u64) -> (f32, Placement) {
        let lattice = Lattice::through(&scene.corners());
        let mut surroundings = Surroundings::UNKNOWN;
        surroundings.learn(&scene.render().frame(), &lattice, PanelFrame::from_bits(scene.bits));
        assert!(surroundings.is_known());
        let centre = [scene.centre[0] + by[0], scene.centre[1] + by[1]];
        let now = Scene { centre, bits, ..scene };
        let mut tiles = Tiles::EMPTY;
        let placement = surroundings.place(&now.render().frame(), &lattice, 0.5, &mut tiles);
        let [x, y] = placement.lattice.centre;
        let truth = Lattice::through(&now.corners()).centre;
        ((x - truth[0]).hypot(y - truth[1]) / scene.pitch_px, placement)
    }

    #[test]
    fn a_panel_is_placed_wherever_it_moves() {
        let moves = [
            [0.0, 0.0],
            [1.3, -0.7],
            [4.4, 0.0],
            [0.0, -4.4],
            [8.8, 4.4],
            [-13.1, 7.0],
            [14.5, -14.5],
            [-2.2, 2.2],
        ];
        for (roll_deg, pitch_px) in [(0.0, 4.4), (8.0, 4.4), (-13.0, 6.0), (3.0, 9.0)] {
            for (i, by) in moves.into_iter().enumerate() {
                let scene = Scene {
                    roll_deg,
                    pitch_px,
                    ..WALL
                };
                let bits = 0x6c1d_93a5_0b7e_f248u64.rotate_left(7 * i as u32);
                let (off, placement) = off(scene, by.map(|c| c * pitch_px / 4.4), bits);
                assert!(
                    off < 0.2,
                    "{off} pitches off, moved by {by:?} px, roll {roll_deg}, pitch {pitch_px}: {placement:?}"
                );
            }
        }
    }
}
