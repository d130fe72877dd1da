//! Carriers: the sign of each frame whose bits are the phase of a carrier.
//!
//! A symbol may be a whole number of cycles of a square carrier, with the bits as its phase, instead of a still panel. An exposure of T
//! sees bit b = ±1 as ½ + c·b/2 of full light. The contrast c depends on the phase of the carrier f at which the exposure falls: it shows
//! the panel or its complement, and with a global shutter |c| is common to all LEDs. Frames are too far apart to follow the carrier itself.
//! They sample it at an alias of its frequency (undersampling; Roberts 2013, UPSOOK: Luo et al. 2015).
//!
//! The receiver learns the carrier from the frames alone. It uses two measurements: the share of the light that the bits modulate, which is
//! |c| times a constant, and whether two frames of the same symbol show it alike or in complement, which is the sign of the product of
//! their c. [`Carrier`] finds the frequency, phase and waveform that explain both, tracks them, and gives each reading its sign. The sign
//! common to all frames comes from the sync panel: [`Deframer`](link::framing::Deframer) reads messages in complement, too.
//!
//! If no frame shows the complement of another, as with still panels, the carrier changes only the rows that sync panels show inverted.

mod change;
mod fit;
mod history;
mod lines;
mod readings;
mod rows;
#[cfg(test)]
mod tests;
mod turn;
mod waveform;

use crate::corners::Corners;
use crate::detect::{Detection, correlation};
use crate::symbols::is_sure;
use change::{CHANGED, Change, change};
pub use fit::BLIND;
use fit::{ALL_SHAPES, AtFrequency, Fit, ShownSign, mean_modulation, step, still_losses, still_score};
use history::{History, Sighting};
use lines::{Lines, WaveState};
use link::panel::SoftPanel;
use readings::{Candidate, Readings, Source};
pub use readings::{CarrierCandidate, Reread};
use rows::Rows;
use waveform::PHASES;

/// Two readings show the same symbol if their correlation is above this, and complements if it is below its negative. Higher: fewer pairs.
/// Lower: different symbols match.
const SAME: f32 = 0.7;
/// Maximum time between such frames (frame periods): a panel is shown again in complement after five symbols at the earliest.
const NEAR: f64 = 3.5;
/// Number of frames that show the complement of another before a search begins (count).
const REVERSALS_MIN: usize = 2;
/// Frames between searches while no carrier is known (count).
const SEARCH_FRAMES: u32 = 4;
/// Frames between searches while a proven carrier is followed (count).
const CHECK_FRAMES: u32 = 32;
/// Frames between searches while a carrier is followed that is not proven (count).
const UNPROVEN_FRAMES: u32 = 16;
/// Minimum number of frames from which a carrier is found (count).
const SIGHTINGS_MIN: usize = 12;
/// Frames in the first, coarse step of a search (count).
const COARSE_FRAMES: usize = 48;
/// Candidates that are refined (count).
const CANDIDATES: usize = 12;
/// Minimum margin in log-likelihood over every carrier with other signs and over a still panel (nats).
const CLEARLY: f32 = 5.0;
/// Minimum share of frames with other signs for two carriers to count as different (share).
const OTHER: f32 = 0.06;
/// Maximum number of frequencies that are tried (count): if frames are far apart, more would take too long.
const FREQUENCIES_MAX: u32 = 20_000;
/// A longer gap, or time that runs backwards, resets the carrier (frame periods).
pub const GAP_MAX: f64 = 64.0;
/// Older sightings are dropped (frame periods).
const MEMORY_PERIODS: f64 = 256.0;
/// The fastest carrier in the search if frame times are not steady (cycles a frame period).
const CYCLES_MAX: f64 = 64.0;
/// Maximum number of equally likely carriers that are tried on the readings (count).
const RIVALS: usize = 6;
/// Failed searches between two such trials (count).
const TRIED_SEARCHES: u32 = 4;
/// Without complements, a search begins only if a still panel explains the frames this badly on average (nats a frame).
const UNEVEN: f32 = 1.2;
/// Carriers are tried on the readings if they are less likely than the best by less than this multiple of the margin. Waveforms that no
/// shape fits exactly can cost that much.
const UNLIKELY: f32 = 5.0;
/// The margin [`CLEARLY`] of a carrier that is found without complements (nats).
const BY_CONTRAST: f32 = 25.0;
/// The alias of such a carrier is at least this far from 0 and from ½, so that it is faster than wipers (cycles a frame period).
const ALTERNATES: f64 = 0.025;

/// The certainty of the signs of a carrier that a decoded segment has proven (nats).
const PROVEN: f32 = 20.0;
/// The trust in bits of lines whose signs are not known yet (1: as read, 0: none).
const UNSIGNED_LINES: f32 = 0.5;
/// Maximum assumed error of a carrier's phase (steps of 1/256 cycle).
const PHASE_ERROR_MAX: i32 = 32;

/// The current knowledge of one panel's carrier.
#[derive(Clone, Debug)]
pub(crate) struct Carrier {
    history: History,
    /// The time of the last frame.
    time: Option<f64>,
    /// The last reading that shows a single symbol, with the sign as seen, and its time.
    last: Option<(SoftPanel, f64)>,
    /// Number of sightings since `last`.
    since_last: u8,
    fit: Option<Fit>,
    wait: u32,
    /// Whether it was found, or found again, in the last frame.
    is_new: bool,
    /// Whether its readings have proven it. Until then, other carriers are tried, too, because the frames alone may favour a wrong one.
    is_proven: bool,
    /// Whether the last frames contradict it.
    is_contradicted: bool,
    /// The last readings, with the signs as seen.
    readings: Readings,
    /// Carriers that explain the frames about equally well. `is_tried` says whether to try them on the readings.
    rivals: heapless::Vec<Fit, RIVALS>,
    is_tried: bool,
    /// Number of failed searches.
    searches: u32,
    /// The carrier of a camera that exposes its lines one after another.
    lines: Lines,
    /// The rows of LEDs that are inverted in all frames.
    rows: Rows,
}

impl Carrier {
    pub const NONE: Self = Self {
        history: History::EMPTY,
        time: None,
        last: None,
        since_last: 0,
        fit: None,
        wait: 0,
        is_new: false,
        is_proven: false,
        is_contradicted: false,
        readings: Readings::NONE,
        rivals: heapless::Vec::new(),
        is_tried: false,
        searches: 0,
        lines: Lines::NONE,
        rows: Rows::NONE,
    };

    /// Whether a carrier is known, or frames have shown the complement of others, which a still panel's never do.
    pub fn is_likely(&self) -> bool {
        self.fit.is_some() || self.lines.is_known() || self.is_reversed()
    }

    /// Whether the carrier is known and each line has its own sign.
    pub fn reads_by_lines(&self) -> bool {
        self.lines.is_known()
    }

    /// Whether an outer line of LEDs lacks the carrier that the others show.
    pub fn misses_a_line(&self) -> bool {
        self.lines.misses_one()
    }

    /// Forgets the LEDs' light after the panel has been followed to another place, because the last frames belong to other LEDs.
    pub fn move_panel(&mut self) {
        self.lines.forget_lights();
    }

    /// Continues with a carrier that its readings have proven.
    pub fn confirm(&mut self, carrier: &CarrierCandidate) {
        match carrier.carrier {
            Candidate::Frames(fit) => {
                let proven = self.fit.filter(|_| carrier.is_followed).unwrap_or(fit);
                (self.fit, self.wait, self.is_proven) = (Some(Fit { sure: PROVEN, ..proven }), CHECK_FRAMES, true);
                self.rivals.clear();
            }
            Candidate::Lines(wave) => self.lines.confirm(wave),
        }
    }

    /// The appearance of a symbol in a frame, from the symbol's bits.
    pub fn as_seen(&self, time: f64, symbol: SoftPanel) -> SoftPanel {
        let symbol = symbol.flipped(self.rows.leds());
        match &self.fit {
            _ if self.reads_by_lines() => SoftPanel::ERASED,
            Some(fit) if fit.contrast_at(time) < 0.0 => symbol.flipped(u64::MAX),
            _ => symbol,
        }
    }

    /// Gives the reading of frame `number`, taken at `time` (frame periods), the sign of its symbol, and erases it if the carrier is blind
    /// in that frame. If this frame makes the carrier known, returns the readings before it.
    pub fn resolve(&mut self, number: u64, time: f64, corners: &Corners, detection: &mut Detection) -> Option<Reread<'_>> {
        if self.time.is_some_and(|before| !(0.0..GAP_MAX).contains(&(time - before))) {
            *self = Self::NONE;
        }
        self.time = Some(time);
        if detection.lights.is_none() && self.lines.is_known() {
            // Rows have signs of their own, which this reading cannot be given.
            (detection.soft, detection.mixed) = (SoftPanel::ERASED, None);
            return None;
        }
        if let Some(lights) = &detection.lights {
            let known = self.lines.push(number, time, &lights.above_mean, corners);
            if let Some(by_lines) = self.lines.read(detection) {
                *detection = by_lines;
            }
            match known {
                WaveState::Nothing => {}
                // Each frame has one sign, which is known.
                WaveState::Rivals if self.fit.is_some() => {}
                WaveState::Before => return None,
                WaveState::Now | WaveState::Rivals | WaveState::Again => {
                    return Some(Reread(Source::Lines {
                        lines: &self.lines,
                        is_followed: known == WaveState::Again,
                    }));
                }
            }
        }
        self.rows.see(time, &detection.soft);
        *detection = detection.inverted(self.rows.leds());
        let is_of_one = detection.mixed.is_none() || is_sure(&detection.soft);
        let soft = if is_of_one { detection.soft } else { SoftPanel::ERASED };
        self.readings.push(number, time, &soft);
        self.is_new = false;
        let is_sighting = self.see(time, detection);
        self.follow(is_sighting);
        let is_tried = core::mem::take(&mut self.is_tried);
        let Some(fit) = self.fit else {
            if self.lines.may_have_a_wave() {
                *detection = detection.doubted(UNSIGNED_LINES);
            }
            return self.rivals_to_try(is_tried);
        };
        match fit.shown_at(time) {
            ShownSign::Symbol => {}
            ShownSign::Complement => *detection = detection.inverted(u64::MAX),
            ShownSign::Nothing => (detection.soft, detection.mixed) = (SoftPanel::ERASED, None),
        }
        // If the sign is wrong with some probability, so is each bit.
        let sure = if self.is_contradicted {
            0.0
        } else {
            fit.sure.min(self.sure_of_sign(&fit, time))
        };
        *detection = detection.doubted(libm::tanhf(0.5 * sure));
        if !self.is_new {
            return self.rivals_to_try(is_tried);
        }
        Some(Reread(Source::Frames {
            readings: &self.readings,
            fits: self.fit.as_slice(),
            is_known: true,
            followed: 1,
        }))
    }

    fn rivals_to_try(&self, is_tried: bool) -> Option<Reread<'_>> {
        let sightings = self.history.sightings();
        let is_followed = |rival: &Fit| self.fit.is_some_and(|fit| fit.differs(rival, sightings) <= OTHER);
        let followed = |(index, rival): (usize, &Fit)| u8::from(is_followed(rival)) << index;
        is_tried.then(|| {
            Reread(Source::Frames {
                readings: &self.readings,
                fits: &self.rivals,
                is_known: false,
                followed: self.rivals.iter().enumerate().map(followed).sum(),
            })
        })
    }

    /// Stores the sighting of a frame; returns false if the frame shows no single symbol.
    fn see(&mut self, time: f64, detection: &Detection) -> bool {
        let is_known = detection.modulation > 0.0 && detection.modulation.is_finite();
        if !is_known || detection.mixed.is_some() && !is_sure(&detection.soft) {
            return false;
        }
        self.history.forget_before(time - MEMORY_PERIODS);
        self.since_last = self.since_last.saturating_add(1);
        let alike = self.last.as_ref().filter(|(_, before)| time - before < NEAR);
        let alike = alike.map_or(0.0, |(before, _)| correlation(before, &detection.soft));
        self.history.push(Sighting {
            time,
            modulation: detection.modulation,
            pair: (alike.abs() > SAME).then_some((self.since_last, alike < 0.0)),
        });
        (self.last, self.since_last) = (Some((detection.soft, time)), 0);
        true
    }

    /// Searches for a carrier, or follows the known one.
    fn follow(&mut self, is_sighting: bool) {
        if let Some(fit) = self.fit {
            self.fit = Some(self.refined(fit));
        }
        if is_sighting {
            self.look_for_a_change();
        }
        self.wait = self.wait.saturating_sub(1);
        if self.wait > 0 || !self.is_suspected() {
            return;
        }
        let found = self.search();
        self.wait = if self.fit.is_some() { CHECK_FRAMES } else { SEARCH_FRAMES };
        let Some(fit) = self.fit else {
            match found {
                Some(found) => self.begin(found),
                None => {
                    self.searches += 1;
                    self.is_tried = self.searches.is_multiple_of(TRIED_SEARCHES) && !self.rivals.is_empty();
                }
            }
            return;
        };
        let is_same = |found: &Fit| fit.differs(found, self.history.sightings()) <= OTHER;
        match found {
            // A proven carrier is replaced only by one that its readings prove.
            Some(found) if found.score > fit.score + CLEARLY && self.is_proven && !is_same(&found) => self.is_proven = false,
            Some(found) if found.score > fit.score + CLEARLY => self.fit = Some(found),
            _ if self.is_proven => self.fit = Some(Fit { sure: PROVEN, ..fit }),
            _ => {
                // If another carrier is as good or better, its certainty does not apply to this one.
                let sure = found.filter(is_same).map_or(CLEARLY, |found| found.sure);
                self.fit = Some(Fit { sure, ..fit });
            }
        }
        if !self.is_proven {
            (self.is_tried, self.wait) = (!self.rivals.is_empty(), UNPROVEN_FRAMES);
        }
    }

    fn begin(&mut self, found: Fit) {
        (self.fit, self.is_new, self.is_proven, self.wait) = (Some(found), true, false, UNPROVEN_FRAMES);
    }

    /// Forgets the frames before a change of the carrier, if something else explains the frames since then clearly better.
    fn look_for_a_change(&mut self) {
        let changed = self.change();
        self.is_contradicted = changed.is_some();
        let Some(Change { first, loss }) = changed else { return };
        let since = self.history.sightings().len() - first;
        if since < SIGHTINGS_MIN || !since.is_multiple_of(SEARCH_FRAMES as usize) {
            return;
        }
        self.history.hide(first);
        let sightings = self.history.sightings();
        let still = still_score(sightings);
        let same = self.fit.map(|fit| fit.on(sightings).score(fit.phase_step(), fit.shape));
        let enough = CHANGED - loss;
        if same.is_some_and(|same| same >= enough) {
            // Only the brightness has changed.
            self.history.forget_hidden();
            self.is_contradicted = false;
            return;
        }
        let found = if still < enough { self.search() } else { None };
        let best = match found {
            None if still >= enough => still,
            _ => self.rivals.first().map_or(still, |best| best.score),
        };
        // A panel that remains still has no carrier to forget. A carrier that is contradicted for long is dropped.
        let is_over = match self.fit {
            Some(_) => best >= enough || since >= COARSE_FRAMES,
            None => still < enough && best >= enough,
        };
        if !is_over {
            self.history.show_all();
            return;
        }
        self.history.forget_hidden();
        self.readings.forget_before(self.history.sightings()[0].time);
        (self.fit, self.is_contradicted, self.searches, self.wait) = (None, false, 0, SEARCH_FRAMES);
        if let Some(found) = found {
            self.begin(found);
        }
    }

    /// A change of the carrier, or its start on a still panel.
    fn change(&self) -> Option<Change> {
        let sightings = self.history.sightings();
        let Some(fit) = &self.fit else {
            let modulation = mean_modulation(sightings.get(..SIGHTINGS_MIN)?);
            return change(still_losses(sightings, modulation)).filter(|change| change.first >= SIGHTINGS_MIN);
        };
        change(fit.on(sightings).losses(fit.phase_step(), fit.shape))
    }

    /// Whether frames have shown the complement of others.
    fn is_reversed(&self) -> bool {
        self.history.reversals() >= REVERSALS_MIN
    }

    /// The certainty of a frame's sign (nats): the loss in log-likelihood at the nearest phases that give the other sign, if the carrier's
    /// phase, its frequency or both are wrong.
    fn sure_of_sign(&self, fit: &Fit, time: f64) -> f32 {
        let crossings = [1, -1].map(|way| {
            let steps = (1..=PHASE_ERROR_MAX).map(|steps| f64::from(way * steps) / PHASES as f64);
            let moved = |by: f64| Fit {
                phase: fit.phase + by,
                ..*fit
            };
            steps
                .into_iter()
                .find(|&by| moved(by).contrast_at(time) * fit.contrast_at(time) < 0.0)
        });
        let sightings = self.history.sightings();
        let score = |by: f64, share: f64| {
            let slower = (1.0 - share) * by / (time - fit.time).max(1.0);
            let phase = fit.phase + share * by;
            let phase = step(phase - libm::floor(phase)) as u8;
            AtFrequency::new(sightings, fit.time, fit.frequency + slower).score(phase, fit.shape)
        };
        let others = crossings
            .into_iter()
            .flatten()
            .flat_map(|by| [0.0, 0.5, 1.0].map(|share| score(by, share)));
        (fit.score - others.fold(f32::NEG_INFINITY, f32::max)).max(0.0)
    }

    /// A carrier adjusted to the frames seen since.
    fn refined(&self, fit: Fit) -> Fit {
        let sightings = self.history.sightings();
        let (Some(first), Some(last)) = (sightings.first(), sightings.last()) else {
            return fit;
        };
        let time = 0.5 * (first.time + last.time);
        let fit = fit.moved_to(time);
        let step = 0.25 / (last.time - first.time).max(1.0) / 4.0;
        let phase = (fit.phase * PHASES as f64 + 0.5) as i64;
        let phases = (-6..=6).map(move |by: i64| (phase + 2 * by) as u8);
        let tries = (-3..=3).map(|by| {
            let frequency = fit.frequency + step * f64::from(by);
            AtFrequency::new(sightings, time, frequency).best(ALL_SHAPES, phases.clone())
        });
        let best = tries.max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or(fit);
        Fit { sure: fit.sure, ..best }
    }

    /// Whether a search is worthwhile: frames have shown the complement of others, or their contrasts differ much.
    fn is_suspected(&self) -> bool {
        self.is_reversed() || {
            let last = self.history.last(COARSE_FRAMES);
            last.len() == COARSE_FRAMES && still_score(last) < -UNEVEN * COARSE_FRAMES as f32
        }
    }

    /// Searches for a carrier.
    #[cold]
    #[inline(never)]
    fn search(&mut self) -> Option<Fit> {
        let coarse = self.history.last(COARSE_FRAMES);
        let (first, last) = (coarse.first()?.time, coarse.last()?.time);
        let time = 0.5 * (first + last);
        let step = 0.25 / (last - first).max(1.0);
        let most = if self.history.is_steady() { 0.5 } else { CYCLES_MAX };
        let mut candidates = heapless::Vec::<Fit, CANDIDATES>::new();
        let tried = ((most / step) as u32).min(FREQUENCIES_MAX);
        for i in 0..=tried {
            let at = AtFrequency::new(coarse, time, step * f64::from(i));
            let fit = at.best(0..3, (0..PHASES as u32 / 2).step_by(16).map(|phase| phase as u8));
            let is_near = |other: &Fit| (other.frequency - fit.frequency).abs() < 1.5 * step;
            if let Some(near) = candidates.iter_mut().find(|other| is_near(other)) {
                if fit.score > near.score {
                    *near = fit;
                }
            } else if let Err(fit) = candidates.push(fit)
                && let Some(worst) = candidates.iter_mut().min_by(|a, b| a.score.total_cmp(&b.score))
                && fit.score > worst.score
            {
                *worst = fit;
            }
        }
        for candidate in &mut candidates {
            for _ in 0..3 {
                *candidate = self.refined(*candidate);
            }
        }
        let best = *candidates.iter().max_by(|a, b| a.score.total_cmp(&b.score))?;
        let sightings = self.history.sightings();
        let still = still_score(sightings);
        let rivals = candidates.iter().filter(|other| best.differs(other, sightings) > OTHER);
        let rival = rivals.map(|other| other.score).fold(still, f32::max);
        let alternates = (ALTERNATES..0.5 - ALTERNATES).contains(&best.frequency) && best.shape > 0;
        let is_reversed = self.is_reversed();
        let margin = if is_reversed { CLEARLY } else { BY_CONTRAST };
        if !(is_reversed || alternates) || sightings.len() < SIGHTINGS_MIN || best.score < still + margin {
            self.rivals.clear();
            return None;
        }
        let is_clear = best.score > rival + margin;
        let mut rivals = heapless::Vec::new();
        candidates.sort_unstable_by(|a, b| b.score.total_cmp(&a.score));
        for other in candidates.iter().filter(|other| other.score > best.score - UNLIKELY * margin) {
            // Carriers with the same signs count as one.
            if rivals.iter().all(|fit: &Fit| fit.differs(other, sightings) > OTHER) {
                rivals.push(*other).ok();
            }
        }
        self.rivals = rivals;
        is_clear.then_some(Fit {
            sure: best.score - rival,
            ..best
        })
    }
}
