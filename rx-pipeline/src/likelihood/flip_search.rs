//! Flips of many LEDs at once, after single flips have converged; and the final cost of each bit's flip.

use super::ascent::{LEAST_GAIN, MISFIT_MAX};
use super::estimate::Estimate;
use super::flips::FlipSet;
use super::gauss_newton::{NormalEquations, SchurFactor};
use super::level_prior::LevelPrior;
use super::model::Model;
use super::sphere_decoder;
use crate::detect::wrong_bits;
use link::panel::LEDS;
use link::panel::LLR_STEP;

/// If all flips cost more, no group is tried (nats): all soft values are at their limits.
const CLEAR: f32 = 127.0 * LLR_STEP;
/// If all flips cost more, no misfit makes them doubtful (nats).
const BEYOND_DOUBT: f32 = MISFIT_MAX * CLEAR;
/// Rounds, at most (count). More: slower, and fewer wrong bits if LEDs overlap.
const ROUNDS: usize = 12;
/// Sets of flips tried in a round (count).
const TRIES: usize = 4;
/// Expected wrong bits of a panel, by its soft values (count): up to the first number the list represents the whole doubt; from the second
/// on it represents [`DOUBT_LISTED`] of it. Lower: soft values are less sure than they may be; higher: too sure.
const LIST_HOLDS: [f32; 2] = [1.0, 3.0];
/// The factor on soft values then (share). Lower, higher: as above. It minimises the surprise over 16 noisy and crowded scenes.
const DOUBT_LISTED: f32 = 0.4;

impl<const PIXELS: usize> Model<PIXELS> {
    /// Flips groups as long as the likelihood rises; returns the final cost of each LED's flip, in nats.
    pub fn ascend_in_groups(&mut self, estimate: &mut Estimate, prior: &LevelPrior) -> [f32; LEDS] {
        self.expect(estimate);
        let mut flip_cost = self.ascent(estimate).flip_costs();
        if self.is_clear(estimate, &flip_cost, prior) {
            return flip_cost;
        }
        self.fit(estimate, prior);
        for _ in 0..ROUNDS {
            let Some(schur) = NormalEquations::schur_factor(&self.image, &self.spots, &estimate.share, &self.leds, &estimate.levels, prior)
            else {
                break;
            };
            let risen = if self.image.is_overexposed() {
                self.flip_best_group(estimate, &schur, prior, &mut flip_cost)
            } else {
                self.flip_best_candidate(estimate, &schur, prior, &mut flip_cost)
            };
            if !risen {
                break;
            }
        }
        flip_cost
    }

    /// The cost of flips, reduced if errors of the model remain in the LEDs' images besides noise.
    pub fn tempered(&mut self, estimate: &mut Estimate, flip_cost: [f32; LEDS]) -> [f32; LEDS] {
        if self.least_cost(&flip_cost) > BEYOND_DOUBT {
            return flip_cost;
        }
        let dispersion = self.ascent(estimate).dispersion();
        flip_cost.map(|cost| cost / dispersion)
    }

    /// Flips the group of LEDs that gains most, and returns whether there is one. `flip_cost` becomes the cost of each LED's flip.
    fn flip_best_group(&mut self, estimate: &mut Estimate, schur: &SchurFactor, prior: &LevelPrior, flip_cost: &mut [f32; LEDS]) -> bool {
        let (mut ascent, gains) = self.ascent_and_gains(estimate);
        ascent.gains_by_flips(schur, gains);
        let mut groups = gains.groups();
        *flip_cost = groups.map(|group| (-group.gain).max(0.0));
        FlipSet::sort(&mut groups);
        self.take_best(estimate, &mut groups[..TRIES], prior)
    }

    /// The same if all pixels are linear in the bits: chooses among the likeliest sets of any number of LEDs.
    fn flip_best_candidate(
        &mut self,
        estimate: &mut Estimate,
        schur: &SchurFactor,
        prior: &LevelPrior,
        flip_cost: &mut [f32; LEDS],
    ) -> bool {
        let list_sets = self.settings.list_sets.into();
        let (ascent, gains) = self.ascent_and_gains(estimate);
        ascent.gains_by_slopes(schur, gains);
        *flip_cost = ascent.flip_costs();
        let Some(mut candidates) = sphere_decoder::candidates(gains, list_sets) else {
            return false;
        };
        let likeliest = candidates.as_mut_slice();
        let tries = TRIES.min(likeliest.len());
        let risen = self.take_best(estimate, &mut likeliest[..tries], prior);
        for (flip_cost, found) in flip_cost.iter_mut().zip(candidates.log_odds()) {
            *flip_cost = found.unwrap_or(*flip_cost);
        }
        risen
    }

    /// Flips the one of `candidates` that raises the likelihood most; returns false if none does. Replaces each promising gain by the
    /// actual one.
    fn take_best(&mut self, estimate: &mut Estimate, candidates: &mut [FlipSet], prior: &LevelPrior) -> bool {
        let before = *estimate;
        let mut best = LEAST_GAIN;
        for candidate in candidates.iter_mut().filter(|candidate| candidate.gain > LEAST_GAIN) {
            let mut tried = before;
            self.expect(&tried);
            candidate.gain = self.gain_of(&mut tried, candidate.flips, prior);
            if candidate.gain > best {
                (best, *estimate) = (candidate.gain, tried);
            }
        }
        self.expect(estimate);
        best > LEAST_GAIN
    }

    /// The least cost of a flip among LEDs that follow the message.
    pub fn least_cost(&self, flip_cost: &[f32; LEDS]) -> f32 {
        (0..LEDS)
            .filter(|&led| self.leds.follows(led))
            .map(|led| flip_cost[led])
            .fold(f32::INFINITY, f32::min)
    }

    /// Whether the frame fits the earlier ones, and no bit is near a doubt, alone or in a group.
    pub fn is_clear(&self, estimate: &Estimate, flip_cost: &[f32; LEDS], prior: &LevelPrior) -> bool {
        let least = self.least_cost(flip_cost);
        prior.fits_surely(prior.usual_noise(&estimate.levels)) && least * self.spots.independence() > CLEAR
    }

    /// Flips LEDs, refits the levels and flips further single LEDs as long as that helps; returns the gain of log-likelihood.
    fn gain_of(&mut self, estimate: &mut Estimate, flips: u64, prior: &LevelPrior) -> f32 {
        let before = *estimate;
        let noise = before.levels.noise;
        let loss_before = self.loss(&before.levels, prior, noise);
        for led in (0..LEDS).filter(|led| flips >> led & 1 == 1) {
            self.ascent(estimate).flip(led);
        }
        self.fit(estimate, prior);
        self.ascent(estimate).flip_singly();
        self.fit(estimate, prior);
        loss_before - self.loss(&estimate.levels, prior, noise)
    }
}

/// The factor on soft values: below 1 if more bits are in doubt than the sets of a list can represent. LEDs that are not read (0) do not
/// count.
pub(super) fn worth(llr: &[f32; LEDS]) -> f32 {
    let unread = llr.iter().filter(|&&llr| llr == 0.0).count() as f32;
    let [whole, most] = LIST_HOLDS;
    let beyond = (wrong_bits(llr) - 0.5 * unread - whole) / (most - whole);
    1.0 - (1.0 - DOUBT_LISTED) * beyond.clamp(0.0, 1.0)
}
