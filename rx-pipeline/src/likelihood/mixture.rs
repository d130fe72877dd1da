//! Two symbols in one exposure: if a share α of it is the next symbol's, an LED is On for 0, α, 1 − α or all of it.
//!
//! Only the symbol before decides which share is which: without it, α and 1 − α are the same. The search is interference cancellation with
//! four shares instead of two, refitting α and the levels in between. Light adds up over an exposure, so the levels are those of whole
//! symbols.
//!
//! If lines are read out one after another, α grows from row to row of LEDs: `lines.rs`. One generic code serves both.

use super::ascent::Ascent;
use super::crop::Crop;
use super::estimate::Estimate;
use super::least_squares::two_groups;
use super::level_prior::LevelPrior;
use super::model::Model;
use crate::detect::{DetectError, Detection, Mixture, bits_where, correlation, lit, soft_panel};
use crate::frame::Frame;
use core::ops::RangeInclusive;
use link::panel::{LEDS, LLR_STEP, Llr, SoftPanel};

/// Fits of α and the levels, each with sweeps (count).
const ROUNDS: usize = 6;
/// Sweeps over the LEDs in each (count).
const SWEEPS: usize = 2;
/// The range of α; beyond it the exposure is one symbol's (share).
pub(super) const SHARE: RangeInclusive<f32> = 0.03..=0.97;
/// Half the width of the parabola that refines α (share).
pub(super) const PARABOLA: f32 = 0.02;
/// The most that one step changes α (share).
pub(super) const STEP_MAX: f32 = 0.2;
/// Maximum noise with two symbols (share of the noise with one): they have 65 unknowns more. Higher: noise looks like a second symbol.
pub(super) const LEFT: f32 = 0.87;
/// The same if the noise is higher than usual or the usual noise is unknown (share of the noise with one).
const NEXT_TO_NOTHING: f32 = 0.25;
/// Minimum correlation of the symbol that ended with the known one: a panel in other light looks like two symbols too, but the first of
/// them is arbitrary.
const SAME: f32 = 0.5;

/// α of each LED, the next symbol's part of its exposure: one number if all lines are exposed at once.
pub(super) trait Shares: Copy {
    /// The share of an LED.
    fn of(&self, led: usize) -> f32;

    /// The shares plus `step`.
    fn plus(&self, step: f32) -> Self;

    /// The shares within their range.
    fn within_range(self) -> Self;

    /// Whether the frame shows a part of both symbols.
    fn is_of_two(&self) -> bool;

    /// Improves the other parameters of the shares by the image.
    fn improve<const PIXELS: usize>(_model: &mut Model<PIXELS>, _estimate: &mut Estimate, _guess: &mut Guess<Self>) {}
}

impl Shares for f32 {
    fn of(&self, _led: usize) -> f32 {
        *self
    }

    fn plus(&self, step: f32) -> Self {
        self + step
    }

    fn within_range(self) -> Self {
        within_range(self, 0.0)
    }

    fn is_of_two(&self) -> bool {
        SHARE.contains(self)
    }
}

/// Two symbols that share an exposure, and how well they explain it.
pub(super) struct TwoSymbols<S = f32> {
    /// Log-likelihood ratios of the symbol that ended, from the frame alone, in nats.
    pub ending: [f32; LEDS],
    /// Log-likelihood ratios of the symbol that began, in nats.
    pub beginning: [f32; LEDS],
    /// α.
    pub share: S,
    pub noise: f32,
}

impl<S: Shares> TwoSymbols<S> {
    /// Whether they explain the frame as well as single panels explained others, and clearly better than one symbol, which leaves `noise`;
    /// and whether the first is the symbol `before`.
    pub fn explain(&self, prior: &LevelPrior, before: &SoftPanel, noise: f32) -> bool {
        let left = if prior.fits_surely(self.noise) { LEFT } else { NEXT_TO_NOTHING };
        self.share.is_of_two() && self.noise < left * noise && correlation(&soft_panel(&self.ending), before) >= SAME
    }
}

impl TwoSymbols {
    /// Whether the second is the complement of the first, as the phase of a carrier makes one symbol look.
    #[cfg(feature = "carrier")]
    pub fn is_one_by_carrier(&self) -> bool {
        correlation(&soft_panel(&self.ending), &soft_panel(&self.beginning)) < -SAME
    }

    /// The reading: the bits of the symbol that was shown longer.
    pub fn detection(&self) -> Detection {
        let longer = if self.share < 0.5 { self.ending } else { self.beginning };
        Detection {
            mixed: Some(Mixture {
                share: self.share,
                ending: soft_panel(&self.ending),
                beginning: soft_panel(&self.beginning),
                #[cfg(feature = "read-lines")]
                growth: [0.0; 2],
            }),
            ..Detection::new(bits_where(|led| longer[led] > 0.0), longer)
        }
    }
}

/// The probability of On for each LED in either symbol, and α.
pub(super) struct Guess<S> {
    pub ended: [f32; LEDS],
    pub begun: [f32; LEDS],
    pub share: S,
}

impl<S: Shares> Guess<S> {
    /// The expected share of the exposure for which each LED is On, with `share` as the next symbol's.
    pub fn lit(&self, share: S) -> [f32; LEDS] {
        core::array::from_fn(|led| lit(share.of(led), self.ended[led], self.begun[led]))
    }
}

impl<const PIXELS: usize> Model<PIXELS> {
    /// The symbol with soft values `before`, and the one after it, in a frame that shows the end of the one and the beginning of the other;
    /// `None` if `before` or the levels are unknown.
    // Not inlined: it would grow the stack of callers that never need it.
    #[inline(never)]
    pub(super) fn two_symbols(
        &mut self,
        frame: &Frame<'_>,
        crop: &Crop,
        before: &SoftPanel,
        prior: &LevelPrior,
    ) -> Result<Option<TwoSymbols>, DetectError> {
        self.two_symbols_of(frame, crop, before, prior, |changed, _| {
            let [_, share] = two_groups(*changed);
            Some(share)
        })
    }

    /// The same for any kind of α, with a first guess from the change of each known LED's light.
    pub(super) fn two_symbols_of<S: Shares>(
        &mut self,
        frame: &Frame<'_>,
        crop: &Crop,
        before: &SoftPanel,
        prior: &LevelPrior,
        first: impl FnOnce(&[f32; LEDS], u64) -> Option<S>,
    ) -> Result<Option<TwoSymbols<S>>, DetectError> {
        let levels = match prior.mean_levels() {
            Some(levels) if *before != SoftPanel::ERASED => levels,
            _ => return Ok(None),
        };
        let seen = self.least_squares(frame, crop, &levels)?.lit(&levels);
        let seen = self.leds.shares(&seen);
        let ended = before.hard().shares();
        let changed = core::array::from_fn(|led| (seen[led] - ended[led]).abs());
        let Some(share) = first(&changed, before.seen()) else {
            return Ok(None);
        };
        let mut guess = Guess {
            ended,
            begun: core::array::from_fn(|led| {
                if changed[led] > 0.5 * share.of(led) {
                    1.0 - ended[led]
                } else {
                    ended[led]
                }
            }),
            share: share.within_range(),
        };
        let mut estimate = Estimate {
            levels,
            share: guess.lit(guess.share),
            centre: crop.centre,
        };
        self.expect_with_noise(&mut estimate);
        for _ in 0..ROUNDS {
            for _ in 0..SWEEPS {
                self.ascent(&mut estimate).cancel_interference_of_two(before, &mut guess);
            }
            self.improve_share(&mut estimate, &mut guess);
            S::improve(self, &mut estimate, &mut guess);
            self.fit(&mut estimate, prior);
        }
        let (ending, beginning) = self.ascent(&mut estimate).llrs_of_two(before, guess.share);
        Ok(Some(TwoSymbols {
            ending,
            beginning,
            share: guess.share,
            noise: estimate.levels.noise,
        }))
    }

    /// Moves α to the minimum of a parabola through the loss beside it.
    fn improve_share<S: Shares>(&mut self, estimate: &mut Estimate, guess: &mut Guess<S>) {
        let mut loss = |share: S| {
            estimate.share = guess.lit(share);
            self.expect(estimate);
            self.image.loss(estimate.levels.noise)
        };
        let [left, here, right] = [-PARABOLA, 0.0, PARABOLA].map(|step| loss(guess.share.plus(step)));
        let bend = left + right - 2.0 * here;
        if bend > 0.0 {
            let step = 0.5 * PARABOLA * (left - right) / bend;
            guess.share = guess.share.plus(step.clamp(-STEP_MAX, STEP_MAX)).within_range();
        }
        estimate.share = guess.lit(guess.share);
        self.expect_with_noise(estimate);
    }
}

impl<const PIXELS: usize> Ascent<'_, PIXELS> {
    /// Gives each LED its expected share, given those of the others and the soft values of the symbol before.
    // Not inlined, so that a microcontroller's flash holds it once.
    #[inline(never)]
    fn cancel_interference_of_two<S: Shares>(&mut self, before: &SoftPanel, guess: &mut Guess<S>) {
        for (led, &prior) in before.0.iter().enumerate() {
            let [none, next, last, both] = self.gains_of_two(led, guess.share.of(led));
            let prior = nats(prior);
            let gains = [none, next, last + prior, both + prior];
            let most = gains.into_iter().fold(f32::NEG_INFINITY, f32::max);
            let [none, next, last, both] = gains.map(|gain| libm::expf(gain - most));
            let all = none + next + last + both;
            guess.ended[led] = (last + both) / all;
            guess.begun[led] = (next + both) / all;
            let share = guess.share.of(led);
            self.set(led, lit(share, guess.ended[led], guess.begun[led]));
        }
    }

    /// The log-likelihood ratios of the symbol that ended, from the frame alone, and of the one that began, in nats.
    fn llrs_of_two<S: Shares>(&self, before: &SoftPanel, share: S) -> ([f32; LEDS], [f32; LEDS]) {
        let (mut ending, mut beginning) = ([0.0; LEDS], [0.0; LEDS]);
        for (led, &prior) in before.0.iter().enumerate() {
            let [none, next, last, both] = self.gains_of_two(led, share.of(led));
            let prior = nats(prior);
            ending[led] = log_sum(last, both) - log_sum(none, next);
            beginning[led] = log_sum(next, both + prior) - log_sum(none, last + prior);
        }
        (ending, beginning)
    }

    /// The gain of log-likelihood if an LED is On in neither symbol, in the next, in the last, and in both.
    fn gains_of_two(&self, led: usize, share: f32) -> [f32; 4] {
        [0.0, share, 1.0 - share, 1.0].map(|lit| self.gain_of_share(led, lit - self.share[led]))
    }
}

/// α within its range, if it differs by up to `spread` from LED to LED.
pub(super) fn within_range(share: f32, spread: f32) -> f32 {
    let (least, most) = (SHARE.start(), SHARE.end());
    share.clamp(0.5 * least - spread, 0.5 * (1.0 + most) + spread)
}

fn nats(llr: Llr) -> f32 {
    f32::from(llr) * LLR_STEP
}

/// ln(eᵃ + eᵇ)
fn log_sum(a: f32, b: f32) -> f32 {
    a.max(b) + libm::log1pf(libm::expf(-(a - b).abs()))
}
