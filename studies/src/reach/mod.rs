//! The best LED-to-ambient ratio by reach, the distance at which messages are still read.
//!
//! A vehicle gains distance from the right ratio. The **reach** of a ratio is the farthest distance at which a [`Demand`] (48 bytes within
//! 1 s, 95 of 100 times) is met, and is met at all nearer distances. This criterion is defined in any light: at night, and also by day,
//! when no bit is wrong at 50 m over nearly all ratios.
//!
//! 1. [`Demand::raw_error_rate`]: the share of bits that may be wrong, by the real framing and codes.
//! 2. For each of [`RATIOS`] ratios, and some between them near the best: the distance from which on too many bits are wrong, first with
//!    few frames, then with many at the two distances next to it, 4.4 % apart. Between these the log-odds of an error are interpolated.
//!    Half octaves from 5 m on, or from where the panel is 110 px wide, show that nothing is lost at nearer distances.
//! 3. The [`Curve`] of the reach over the ratio: a parabola through its top gives the best ratio, straight lines those that lose no more
//!    than 1 % of its reach ([`NOTHING`]). A [`Choice`] selects one of these.
//!
//! All ratios and distances use the same frames, in rounds of doubling size as in [`crate::optimum`], so that neighbours differ by their
//! settings and not by chance. Intervals are those of the same steps on resampled batches. Errors at the reach are frequent (several in a
//! hundred bits), so that nothing rare has to be counted.
//!
//! LEDs closer than the receiver's limit are indistinguishable. If bits are read well up to that limit, the reach is the last distance
//! before it, at any ratio.
//!
//! The panel's position counts as known, as for a receiver that follows the panel. A receiver that must find it first is limited to
//! [`found_to_m`]; [`crate::random_scenes`] measures how many are found.
//!
//! With a carrier, its phase counts as known, too: complements are inverted, and readings of little contrast are erased
//! ([`Demand::raw_error_rate_with_carrier`]). Phases are those of the scene's clocks. All wrong bits count alike, although a decoder gives
//! those of little contrast less weight, so that the reach is a lower estimate.
//!
//! ```
//! use sim::scene::Scene;
//! use studies::detectors::DetectorChoice;
//! use studies::reach::{ReachSearch, reach};
//! let settings = ["ambient.illuminance_lx=50", "panel.interval=0.5"].map(String::from);
//! let search = ReachSearch { frames: 64, detector: DetectorChoice::KMeans, ..ReachSearch::default() };
//! let found = reach(&Scene::load("night", &settings)?, &search)?;
//! assert!((1.5..3.0).contains(&found.judged.verdict.best));
//! assert!((55.0..70.0).contains(&found.judged.verdict.reach_m));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod crossing;
mod curve;
mod demand;
#[cfg(test)]
mod tests;

pub use crossing::{Crossing, found_to_m};
pub use curve::{Choice, Curve, FLAT, Judgement, NOTHING, Verdict};
pub use demand::{Demand, DemandError};
pub use rx_pipeline::locate::LEAST_PITCH_PX;

use crossing::{Guess, Probe};

use std::sync::{Mutex, PoisonError};

use crate::parallel::try_map;
use sim::accuracy::Level;
use sim::scene::Scene;

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Settings};
use crate::optimum::{RANGE, SearchError, check_limits, rounds};
use crate::stop::Stop;

/// Ratios over the whole range, at equal factors: 22 % apart in the paper's range.
pub const RATIOS: usize = 16;
/// Ratios on either side of the best, half as far apart.
const FINE: usize = 3;
/// The order of the ratios over the whole range: the first of these, and every fifth ratio after it, are tried in parallel; then those from
/// the next one on.
const WIDE_ORDER: [usize; 5] = [0, 2, 4, 1, 3];

/// The settings of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachSearch {
    /// The tolerable share of wrong bits, more than 0 and less than 0.5: see [`Demand::raw_error_rate`].
    pub raw_error_rate: f64,
    /// The range of ratios, within [`crate::optimum::RANGE_MAX`].
    pub range: [f64; 2],
    /// The most frames at one ratio and distance, at least [`crate::optimum::FRAMES_MIN`].
    pub frames: u64,
    /// The search ends if the 95 % interval of the chosen ratio is no wider than ± this share of it; 0: it uses all frames.
    pub tolerance: f64,
    /// The ratio to choose on a plateau.
    pub choice: Choice,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Whether each frame's reflectance is drawn from [`crate::monte_carlo::REFLECTANCES`].
    pub random_reflectance: bool,
    /// The detector whose bit errors are counted.
    pub detector: DetectorChoice,
    /// The accuracy of frames.
    pub level: Level,
    /// The flag that ends the search early.
    pub stop: Stop,
}

impl Default for ReachSearch {
    /// For the best detector, at most 4096 frames, a twentieth of the ratio; one bit in 13 may be wrong, as 48 bytes within 1 s allow.
    fn default() -> Self {
        Self {
            raw_error_rate: 0.078,
            range: RANGE,
            frames: 4096,
            tolerance: 0.05,
            choice: Choice::default(),
            seed: 1,
            random_reflectance: true,
            detector: DetectorChoice::Best,
            level: Level::Fast,
            stop: Stop::NEVER,
        }
    }
}

/// Why there is no best ratio.
#[derive(Debug, thiserror::Error)]
pub enum ReachError {
    /// The search is invalid.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// The error rate is invalid.
    #[error("a share of {rate} of the bits may be wrong: it must be more than 0 and less than 0.5")]
    RawErrorRate {
        /// The rate.
        rate: f64,
    },
    /// A ratio cannot be evaluated.
    #[error("at L2A {l2a:.3} and {distance_m} m: {source}")]
    Evaluate {
        /// The ratio.
        l2a: f64,
        /// The distance, m.
        distance_m: f64,
        /// The cause.
        source: Box<EvaluateError>,
    },
    /// Hardly any ratio is readable.
    #[error(
        "at no more than {ratios} of the ratios tried from {low:.3} to {high:.3} are messages read at the nearest distance: give another \
         range, more light or a camera that sees more"
    )]
    Unread {
        /// Readable ratios.
        ratios: usize,
        /// The lowest ratio.
        low: f64,
        /// The highest ratio.
        high: f64,
    },
    /// [`ReachSearch::stop`] ended the search.
    #[error("interrupted before the reach was known")]
    Interrupted,
}

/// The best ratio by reach, and its evidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// The best ratio, the chosen one, and their intervals.
    pub judged: Judgement,
    /// Whether the best ratio is an end of the range: the true one may lie beyond.
    pub at_border: bool,
    /// The nearest distance before the reach at which too many bits are wrong at the chosen ratio, m, if there is one.
    pub lost_at_m: Option<f64>,
    /// The reach over the ratio.
    pub curve: Curve,
    /// Frames at each ratio and distance.
    pub frames: u64,
}

/// Finds the best ratio of a scene's first panel by reach; the scene's distance is ignored.
///
/// # Errors
/// If the search or the scene is invalid, or [`ReachSearch::stop`] ended it: see [`ReachError`].
pub fn reach(scene: &Scene, search: &ReachSearch) -> Result<Reach, ReachError> {
    reach_from(scene, search, &[], |_| {})
}

/// As [`reach`], continued from the crossings that an earlier run of the same search reported, in any order.
///
/// # Errors
/// As [`reach`].
pub(crate) fn reach_from(
    scene: &Scene,
    search: &ReachSearch,
    known: &[Crossing],
    mut tell: impl FnMut(&Crossing) + Send,
) -> Result<Reach, ReachError> {
    check(search)?;
    let mut work = Work {
        scene,
        search,
        known,
        found: Vec::new(),
    };
    let borders = rounds(search.frames);
    let mut round = 1;
    let judged = loop {
        let judged = work.after(round, &mut tell)?;
        let [low, high] = judged.chosen_95;
        let is_sure = (high - low) / 2.0 <= search.tolerance * judged.verdict.chosen;
        if is_sure || round + 1 == borders.len() {
            break judged;
        }
        round += 1;
    };
    let is_at = |end: f64| (judged.verdict.best / end - 1.0).abs() < 1e-6;
    Ok(Reach {
        lost_at_m: work.lost_before_reach(judged.verdict.chosen)?,
        at_border: search.range.into_iter().any(is_at),
        judged,
        curve: work.curve(round),
        frames: borders[round],
    })
}

/// A search in progress.
struct Work<'a> {
    scene: &'a Scene,
    search: &'a ReachSearch,
    known: &'a [Crossing],
    /// By ascending ratio.
    found: Vec<Crossing>,
}

impl Work<'_> {
    fn settings(&self) -> Settings {
        Settings {
            frames: self.search.frames,
            seed: self.search.seed,
            random_reflectance: self.search.random_reflectance,
            detector: self.search.detector,
            level: self.search.level,
            camera: None,
            stop: self.search.stop,
        }
    }

    fn probe(&self, l2a: f64) -> Probe<'_> {
        Probe::new(self.scene, self.settings(), self.search.raw_error_rate, l2a)
    }

    /// The result of a number of rounds.
    fn after(&mut self, rounds: usize, tell: &mut (impl FnMut(&Crossing) + Send)) -> Result<Judgement, ReachError> {
        // The first group gives all others neighbours on both sides.
        for first in WIDE_ORDER {
            let group: Vec<usize> = (2 * first..=LAST).step_by(2 * WIDE_ORDER.len()).collect();
            self.cross(&group, rounds, tell)?;
        }
        let middle = nearest(self.search.range, self.judged(rounds)?.verdict.best);
        let fine = middle.saturating_sub(2 * FINE)..=(middle + 2 * FINE).min(LAST);
        let fine: Vec<usize> = fine.filter(|number| number % 2 == 1).collect();
        self.cross(&fine, rounds, tell)?;
        self.judged(rounds)
    }

    /// Finds the crossings of some ratios in parallel, and reports new ones.
    fn cross(&mut self, numbers: &[usize], rounds: usize, tell: &mut (impl FnMut(&Crossing) + Send)) -> Result<(), ReachError> {
        let tell = Mutex::new(tell);
        let cross = |&number: &usize| {
            let found = self.crossing(ratio(self.search.range, number), rounds)?;
            if let Some((crossing, false)) = &found {
                // Each as soon as it is known, because others may take long.
                let mut tell = tell.lock().unwrap_or_else(PoisonError::into_inner);
                tell(crossing);
            }
            Ok::<_, ReachError>(found.map(|(crossing, _)| crossing))
        };
        let crossed: Vec<Option<Crossing>> = try_map(numbers, cross)?;
        for crossing in crossed.into_iter().flatten() {
            match self.place(crossing.l2a) {
                Ok(place) => self.found[place] = crossing,
                Err(place) => self.found.insert(place, crossing),
            }
        }
        Ok(())
    }

    /// The position of a ratio among those found, or for its insertion.
    fn place(&self, l2a: f64) -> Result<usize, usize> {
        self.found.binary_search_by(|one| one.l2a.total_cmp(&l2a))
    }

    /// The crossing of one ratio, and whether it was known; `None` if too much is lost everywhere.
    fn crossing(&self, l2a: f64, rounds: usize) -> Result<Option<(Crossing, bool)>, ReachError> {
        let of_ratio = |crossing: &&Crossing| crossing.l2a == l2a;
        let mut known = self.known.iter().filter(of_ratio);
        if let Some(crossing) = known.clone().find(|known| known.rounds() == rounds) {
            return Ok(Some((crossing.clone(), true)));
        }
        let mut probe = self.probe(l2a);
        let before = self.found.iter().find(of_ratio);
        let before = before.or_else(|| known.find(|known| known.rounds() < rounds));
        if let Some(before) = before {
            probe.remember(before);
        }
        let guess = match before {
            Some(before) => Guess::Near(before.steps[0]),
            None => self.guess(l2a),
        };
        let crossing = probe.crossing(rounds, guess)?;
        Ok(crossing.map(|crossing| (crossing, false)))
    }

    /// The expected place of a ratio's crossing, by its neighbours.
    fn guess(&self, l2a: f64) -> Guess {
        let above = self.place(l2a).unwrap_or_else(|place| place);
        let at = |place: usize| self.found.get(place);
        match (above.checked_sub(1).and_then(at), at(above)) {
            (Some(low), Some(high)) => {
                let share = (l2a / low.l2a).ln() / (high.l2a / low.l2a).ln();
                let [from, to] = [low, high].map(|crossing| f64::from(crossing.steps[0]));
                Guess::Near((from + share * (to - from)).round() as u32)
            }
            (Some(one), None) | (None, Some(one)) => Guess::Beside(one.steps[0]),
            (None, None) => Guess::Anywhere,
        }
    }

    /// Without ratios of fewer rounds, which were near the best earlier and are not now.
    fn curve(&self, rounds: usize) -> Curve {
        let crossings = self.found.iter();
        let crossings: Vec<&Crossing> = crossings.filter(|one| one.rounds() == rounds).collect();
        Curve::of(&crossings, self.search.raw_error_rate, self.search.seed)
    }

    fn judged(&self, rounds: usize) -> Result<Judgement, ReachError> {
        let [low, high] = self.search.range;
        let curve = self.curve(rounds);
        let ratios = curve.points().count();
        let judged = curve.judged(self.search.choice);
        let judged = judged.filter(|_| ratios >= RATIOS / 2);
        judged.ok_or(ReachError::Unread { ratios, low, high })
    }

    /// The nearest distance with too many losses at a ratio before its reach, if there is one, m.
    fn lost_before_reach(&self, l2a: f64) -> Result<Option<f64>, ReachError> {
        let above = self.found.partition_point(|crossing| crossing.l2a < l2a);
        let beside = self.found.get(above).or(self.found.last());
        let Some(crossing) = beside else {
            return Ok(None);
        };
        self.probe(l2a).lost_before(crossing.steps[0])
    }
}

/// The number of the last ratio; those between two of [`RATIOS`] have numbers too.
const LAST: usize = 2 * (RATIOS - 1);

/// The ratio of a number, rounded to a millionth for readability; the ends are as given.
fn ratio([low, high]: [f64; 2], number: usize) -> f64 {
    let exact = low * (high / low).powf(number as f64 / LAST as f64);
    (exact * 1e6).round() / 1e6
}

/// The number of the nearest ratio.
fn nearest([low, high]: [f64; 2], l2a: f64) -> usize {
    ((l2a / low).ln() / (high / low).ln() * LAST as f64).round() as usize
}

fn check(search: &ReachSearch) -> Result<(), ReachError> {
    check_limits(search.range, search.frames, search.tolerance)?;
    let rate = search.raw_error_rate;
    if rate > 0.0 && rate < 0.5 {
        Ok(())
    } else {
        Err(ReachError::RawErrorRate { rate })
    }
}
