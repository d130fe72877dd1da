//! The place of a panel after the camera has moved, from its surroundings.
//!
//! A panel's bits change from frame to frame, but its surroundings move with the camera. A place is likely if each LED there is at either
//! of its two levels, and if everything around them looks as before. Its rating is the log odds against a part of the picture without a
//! panel, with the grey levels of the whole picture's histogram.
//!
//! A panel may also move by itself while the camera rests. Then only its LEDs and the places next to them, which are on its board, reveal
//! its place, and the ground is compared at the panel's last place.
//!
//! The picture is drawn in tiles a quarter of the LEDs' pitch wide, rotated with the panel. The odds of a candidate are then a sum of table
//! look-ups: over the 64 LEDs for every candidate, and over the surroundings for those that the LEDs leave likely.

mod exposure;
mod odds;
mod places;
mod tiles;

use crate::frame::Frame;
use crate::lattice::Lattice;
use link::panel::PanelFrame;
use odds::{Odds, PEAKS, Peak};
use places::{AROUND, ON_BOARD, Place, places};
pub(crate) use tiles::Tiles;
use tiles::{ROOM, TILES};

/// The least spread of the expected place (pitches).
const LEAST_SPREAD: f32 = 0.15;
/// Number of nats that count as one in the odds between two places, because the evidence is not independent.
const DEPENDENCE: f32 = 4.0;
/// The least probability that a panel is on the lattice that explains its light, whatever its surroundings. Lower: rivals are accepted
/// sooner, and readings before a changing ground lose more weight.
const LEAST: f32 = 0.75;
/// Minimum lead of another place over the expected one (nats).
const CLEARLY: f32 = 25.0;
/// Minimum distance of a corner from its expected place for a panel that has moved (pitches). Tiles do not resolve less.
const OFF: f32 = 0.25;
/// The same in pixels (px).
const OFF_PX: f32 = 1.0;
/// Places closer to each other count as one (pitches).
const SAME: f32 = 0.35;
/// The least deviation of an LED's level (share of the contrast), because its place may lie between two tiles.
const DEVIATION: f32 = 0.03;
/// The same for a place around the LEDs, in addition to the slope of the light there.
const DEVIATION_AROUND: f32 = 0.02;
/// Addition to both for the sensor's noise (grey levels).
const DEVIATION_GREY: f32 = 1.5;
/// The initial deviation of a place after one frame (share of the contrast), and of one that LEDs light, because they are On or Off.
const DEVIATION_AT_FIRST: [f32; 2] = [0.05, 0.2];
/// The weight of a frame in the averages (share).
const GAIN: f32 = 0.15;
/// LEDs of either state in a frame that teaches, at least (count).
const LEAST_LEDS: f32 = 3.0;
/// Number of places next to the LEDs that may differ by more than [`FAR`] before the panel counts as moved (count).
const DIFFERING: usize = 2;
/// Difference of such a place that counts (deviations).
const FAR: f32 = 3.5;

/// The levels of a panel and of its surroundings, in grey levels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings {
    around: [Level; AROUND],
    off: Level,
    on: Level,
    /// The number of frames behind these, up to 255 (count).
    frames: u8,
}

/// A grey level and its variance.
#[derive(Clone, Copy, Debug)]
struct Level {
    mean: f32,
    variance: f32,
}

/// The candidate places of a panel.
#[derive(Clone, Debug)]
pub(crate) struct Placement {
    /// The likeliest place first.
    peaks: heapless::Vec<Peak, PEAKS>,
    /// The log odds of the expected place.
    as_expected: f32,
}

impl Placement {
    /// Its place, if that is clearly likelier than the expected one, and too far from it for a fit to converge. A fit is more precise.
    pub fn elsewhere(&self, expected: &Lattice) -> Option<&Lattice> {
        let Peak { lattice, odds, .. } = self.peaks.first()?;
        let limit = (OFF * expected.pitch()[0]).max(OFF_PX);
        let mut off = lattice.corners().into_iter().zip(expected.corners());
        let is_off = off.any(|(a, b)| libm::hypotf(a[0] - b[0], a[1] - b[1]) > limit);
        (is_off && odds - self.as_expected >= CLEARLY).then_some(lattice)
    }

    /// The probability that it is on `lattice` rather than in the likeliest place elsewhere.
    pub fn confidence(&self, lattice: &Lattice) -> f32 {
        let is_here = |peak: &&Peak| peak.lattice.is_beside(lattice, SAME);
        let here = self.peaks.iter().find(is_here).map_or(self.as_expected, |peak| peak.odds);
        let elsewhere = self.peaks.iter().find(|peak| !is_here(peak));
        elsewhere.map_or(1.0, |peak| (1.0 / (1.0 + libm::expf((peak.odds - here) / DEPENDENCE))).max(LEAST))
    }

    /// The log odds of the likeliest place.
    fn highest(&self) -> f32 {
        self.peaks.first().map_or(self.as_expected, |peak| peak.odds)
    }

    /// Whether it may lie beyond the searched area.
    fn is_at_edge(&self) -> bool {
        let is_at_edge = |peak: &Peak| peak.at.iter().any(|c| c.abs() > ROOM - TILES as i32);
        self.peaks.first().is_some_and(is_at_edge)
    }
}

impl Surroundings {
    pub const UNKNOWN: Self = Self {
        around: [Level::NONE; AROUND],
        off: Level::NONE,
        on: Level::NONE,
        frames: 0,
    };

    pub fn is_known(&self) -> bool {
        self.frames > 0
    }

    /// Updates the levels from a frame in which the panel on `lattice` shows `bits`.
    pub fn learn(&mut self, frame: &Frame<'_>, lattice: &Lattice, bits: PanelFrame) {
        let mut leds = [Sums::default(); 2];
        for (place, at) in places() {
            if let Place::Led(led) = place {
                leds[usize::from(bits.led(led))].add(places::level(frame, lattice, at));
            }
        }
        if leds.iter().any(|sums| sums.count < LEAST_LEDS) {
            return;
        }
        let is_known = self.is_known();
        let around = places::around(frame, lattice);
        if let Some(brighter) = exposure::change(&self.around, &around) {
            *self = self.brightened(brighter);
        }
        let gain = GAIN.max(1.0 / (f32::from(self.frames) + 1.0));
        let [off, on] = leds.map(Sums::level);
        self.off.go_on(off, gain);
        self.on.go_on(on, gain);
        for (i, (before, now)) in self.around.iter_mut().zip(around).enumerate() {
            let at_first = DEVIATION_AT_FIRST[usize::from(i < ON_BOARD)];
            let off = if is_known {
                now.mean - before.mean
            } else {
                at_first * (self.on.mean - self.off.mean)
            };
            let variance = now.variance + off * off;
            before.go_on(Level { variance, ..now }, gain);
        }
        self.frames = self.frames.saturating_add(1);
    }

    /// The levels in exposures that make grey levels `factor` times as high.
    fn brightened(&self, factor: f32) -> Self {
        Self {
            around: self.around.map(|level| level.brightened(factor)),
            off: self.off.brightened(factor),
            on: self.on.brightened(factor),
            ..*self
        }
    }

    /// The change of grey levels since the last frames, if the exposure has changed.
    fn exposure_change(&self, frame: &Frame<'_>, lattice: &Lattice) -> Option<f32> {
        exposure::change(&self.around, &places::around(frame, lattice))
    }

    /// Whether the places next to the LEDs of a panel on `lattice` are unchanged, except for the exposure.
    pub fn agrees(&self, frame: &Frame<'_>, lattice: &Lattice) -> bool {
        self.agrees_as_exposed(frame, lattice) || {
            let change = self.exposure_change(frame, lattice);
            change.is_some_and(|change| self.brightened(change).agrees_as_exposed(frame, lattice))
        }
    }

    fn agrees_as_exposed(&self, frame: &Frame<'_>, lattice: &Lattice) -> bool {
        let least = self.least_variance(DEVIATION);
        let differs = |level: &Level, at: [f32; 2]| {
            let off = places::level(frame, lattice, at).mean - level.mean;
            off * off > FAR * FAR * level.variance.max(least)
        };
        let differing = places().filter(|&(ref place, at)| match place {
            Place::Around(i @ 0..ON_BOARD) => differs(&self.around[*i], at),
            _ => false,
        });
        differing.count() <= DIFFERING
    }

    /// The least variance for that share of the contrast.
    fn least_variance(&self, share: f32) -> f32 {
        let deviation = share * (self.on.mean - self.off.mean).abs() + DEVIATION_GREY;
        deviation * deviation
    }

    /// The likeliest place of a panel that was last seen on `last` and is usually `spread` pitches from its expected place, in the same
    /// exposure or a changed one.
    pub fn place(&self, frame: &Frame<'_>, expected: &Lattice, last: &Lattice, spread: f32, tiles: &mut Tiles) -> Placement {
        let placement = self.place_as_exposed(frame, expected, last, spread, tiles);
        let Some(change) = self.exposure_change(frame, expected) else {
            return placement;
        };
        let changed = self.brightened(change).place_as_exposed(frame, expected, last, spread, tiles);
        if changed.highest() > placement.highest() {
            changed
        } else {
            placement
        }
    }

    fn place_as_exposed(&self, frame: &Frame<'_>, expected: &Lattice, last: &Lattice, spread: f32, tiles: &mut Tiles) -> Placement {
        let placement = self.place_near(frame, expected, last, spread, tiles);
        let Some(Peak { lattice, odds, .. }) = placement.peaks.first().filter(|_| placement.is_at_edge()) else {
            return placement;
        };
        let farther = self.place_near(frame, lattice, last, spread, tiles);
        let as_expected = farther.as_expected + placement.as_expected - odds;
        Placement { as_expected, ..farther }
    }

    fn place_near(&self, frame: &Frame<'_>, expected: &Lattice, last: &Lattice, spread: f32, tiles: &mut Tiles) -> Placement {
        tiles.draw(frame, expected);
        let odds = Odds::new(self, tiles, expected, last, spread.max(LEAST_SPREAD));
        let mut peaks = odds.peaks();
        peaks.sort_unstable_by(|a, b| b.odds.total_cmp(&a.odds));
        Placement {
            peaks,
            as_expected: odds.as_expected(),
        }
    }
}

impl Level {
    const NONE: Self = Self { mean: 0.0, variance: 0.0 };

    fn go_on(&mut self, now: Self, gain: f32) {
        self.mean += gain * (now.mean - self.mean);
        self.variance += gain * (now.variance - self.variance);
    }

    fn brightened(self, factor: f32) -> Self {
        Self {
            mean: (factor * self.mean).min(f32::from(u8::MAX)),
            variance: factor * factor * self.variance,
        }
    }

    fn density(&self, grey: f32) -> f32 {
        let off = grey - self.mean;
        libm::expf(-0.5 * off * off / self.variance) / libm::sqrtf(core::f32::consts::TAU * self.variance)
    }

    fn with_variance_from(self, variance: f32) -> Self {
        Self {
            variance: self.variance.max(variance),
            ..self
        }
    }
}

/// Sums over levels.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f32,
    means: f32,
    squares: f32,
}

impl Sums {
    fn add(&mut self, level: Level) {
        self.count += 1.0;
        self.means += level.mean;
        self.squares += level.mean * level.mean + level.variance;
    }

    /// The level of all of them together.
    fn level(self) -> Level {
        let mean = self.means / self.count;
        let variance = (self.squares / self.count - mean * mean).max(0.0);
        Level { mean, variance }
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

    /// The error of a panel's place (pitches): it was seen in `scene`, and is now `by` px elsewhere, showing `bits`.
    fn off(scene: Scene, by: [f32; 2], bits: u64) -> (f32, Placement) {
        let lattice = Lattice::through(&scene.corners());
        let mut surroundings = Surroundings::UNKNOWN;
        surroundings.learn(&scene.render().frame(), &lattice, PanelFrame::from_bits(scene.bits));
        assert!(surroundings.is_known());
        let centre = [scene.centre[0] + by[0], scene.centre[1] + by[1]];
        let now = Scene { centre, bits, ..scene };
        let mut tiles = Tiles::EMPTY;
        let placement = surroundings.place(&now.render().frame(), &lattice, &lattice, 0.5, &mut tiles);
        let [x, y] = placement.peaks[0].lattice.centre;
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

    /// Compared with the levels of the exposure before, no place agrees.
    #[test]
    fn a_panel_is_placed_in_another_exposure() {
        let lattice = Lattice::through(&WALL.corners());
        let mut surroundings = Surroundings::UNKNOWN;
        surroundings.learn(&WALL.render().frame(), &lattice, PanelFrame::from_bits(WALL.bits));
        let mut tiles = Tiles::EMPTY;
        for (exposure, by) in [(0.3, [0.0, 0.0]), (0.3, [3.1, -2.0]), (2.5, [0.0, 0.0]), (2.5, [-4.4, 4.4])] {
            let centre = [WALL.centre[0] + by[0], WALL.centre[1] + by[1]];
            let now = Scene { centre, exposure, ..WALL };
            let (rendered, there) = (now.render(), Lattice::through(&now.corners()));
            let frame = rendered.frame();
            assert!(!surroundings.agrees_as_exposed(&frame, &there), "{exposure}, {by:?}");
            assert!(surroundings.agrees(&frame, &there), "{exposure}, {by:?}");
            let placement = surroundings.place(&frame, &lattice, &lattice, 0.5, &mut tiles);
            let [x, y] = placement.peaks[0].lattice.centre;
            let off = (x - there.centre[0]).hypot(y - there.centre[1]) / WALL.pitch_px;
            assert!(off < 0.2, "{off} pitches off, exposure {exposure}, moved by {by:?} px");
            // Once learnt, the levels are those of the new exposure.
            let mut learnt = surroundings;
            learnt.learn(&frame, &there, PanelFrame::from_bits(now.bits));
            assert!(learnt.agrees_as_exposed(&frame, &there), "{exposure}, {by:?}");
        }
    }
}
