//! Where a panel has gone from one frame to the next, by what stands around it.
//!
//! A panel's bits change from frame to frame, but its surroundings move with the camera. A place is likely if each LED there is at one of
//! two levels, no matter which, and if everything around them looks as it did. Each place is rated by the logarithm of its odds against a
//! part of the picture that has nothing to do with the panel, where grey levels are as frequent as in the whole picture.
//!
//! The picture is drawn in tiles that are a quarter of the LEDs' pitch wide and turned with the panel. A candidate's odds are then a sum of
//! table look-ups: over the 64 LEDs for every candidate, and over the surroundings for those that the LEDs leave likely.

mod odds;
mod places;
mod tiles;

use crate::frame::Frame;
use crate::lattice::Lattice;
use link::panel::PanelFrame;
use odds::Odds;
use places::{AROUND, Place, places};
pub(crate) use tiles::Tiles;
use tiles::{ROOM, TILES};

/// Panels are never expected nearer to their place (pitches).
const LEAST_SPREAD: f32 = 0.15;
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
/// Candidates nearer than that to the best are the same place (tiles).
const SAME: i32 = 3;
/// The least deviation of a place, and of an LED's level (share of the contrast): a place between two tiles.
const DEVIATION: f32 = 0.08;
/// The same of panels of no contrast: the sensor's noise (grey levels).
const DEVIATION_GREY: f32 = 1.5;
/// The deviation of a place that has been seen once (share of the contrast).
const DEVIATION_AT_FIRST: f32 = 0.2;
/// What a frame changes of what is known (share).
const GAIN: f32 = 0.15;
/// LEDs of which a level is known, at least (count).
const LEAST_LEDS: f32 = 3.0;
/// Places just around the LEDs that may differ by more than [`FAR`] before the panel has moved (count).
const DIFFERING: usize = 2;
/// See there (deviations).
const FAR: f32 = 3.5;

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
        for (place, at) in places() {
            let grey = places::grey(frame, lattice, at);
            match place {
                Place::Led(led) => levels[usize::from(bits.led(led))].add(grey),
                Place::Around(i) => around[i] = grey,
            }
        }
        let [Some(off), Some(on)] = levels.map(|sums| sums.level()) else {
            return;
        };
        if self.is_known {
            self.off.go_on(off);
            self.on.go_on(on);
        } else {
            (self.off, self.on) = (off, on);
        }
        let at_first = DEVIATION_AT_FIRST * self.contrast();
        for (level, mean) in self.around.iter_mut().zip(around) {
            let off = mean - level.mean;
            if self.is_known {
                level.go_on(Level { mean, variance: off * off });
            } else {
                let variance = at_first * at_first;
                *level = Level { mean, variance };
            }
        }
        self.is_known = true;
    }

    /// Whether the places just around a panel on `lattice` are as they were.
    pub fn agrees(&self, frame: &Frame<'_>, lattice: &Lattice) -> bool {
        let least = self.least_variance();
        let differs = |level: &Level, at: [f32; 2]| {
            let off = places::grey(frame, lattice, at) - level.mean;
            off * off > FAR * FAR * level.variance.max(least)
        };
        let differing = places().filter(|&(ref place, at)| match place {
            Place::Around(i) => places::is_beside_leds(at) && differs(&self.around[*i], at),
            Place::Led(_) => false,
        });
        differing.count() <= DIFFERING
    }

    fn contrast(&self) -> f32 {
        (self.on.mean - self.off.mean).abs()
    }

    fn least_variance(&self) -> f32 {
        let deviation = DEVIATION * self.contrast() + DEVIATION_GREY;
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
        tiles.draw(frame, expected);
        let odds = Odds::new(self, tiles, spread.max(LEAST_SPREAD));
        let upright = tiles::offsets(expected, 0.0);
        let mut places = odds.likeliest_by_leds(&upright);
        for (at, of) in &mut places {
            *of = odds.of_all(&upright, *at);
        }
        let &(at, likeliest) = places.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(&([0; 2], 0.0));
        let is_elsewhere = |other: &[i32; 2]| (0..2).any(|axis| (other[axis] - at[axis]).abs() >= SAME);
        let elsewhere = places.iter().filter(|(other, _)| is_elsewhere(other));
        let rival = elsewhere.max_by(|a, b| a.1.total_cmp(&b.1));
        let rival = rival
            .map(|&(other, of)| (other, likeliest - of))
            .filter(|(_, behind)| *behind < RIVAL);
        Placement {
            lattice: odds.refined(expected, at),
            gain: likeliest - odds.of_all(&upright, [0; 2]),
            rival: rival.map(|(other, behind)| (odds.refined(expected, other), behind)),
            is_at_edge: at.iter().any(|c| c.abs() > ROOM - TILES as i32),
        }
    }
}

impl Level {
    const NONE: Self = Self { mean: 0.0, variance: 0.0 };

    fn go_on(&mut self, now: Self) {
        self.mean += GAIN * (now.mean - self.mean);
        self.variance += GAIN * (now.variance - self.variance);
    }

    fn density(&self, grey: f32) -> f32 {
        let off = grey - self.mean;
        libm::expf(-0.5 * off * off / self.variance) / libm::sqrtf(core::f32::consts::TAU * self.variance)
    }

    fn no_surer_than(self, variance: f32) -> Self {
        Self {
            variance: self.variance.max(variance),
            ..self
        }
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
        let mean = self.sum / self.count;
        let variance = (self.squares / self.count - mean * mean).max(0.0);
        (self.count >= LEAST_LEDS).then_some(Level { mean, variance })
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
