//! α that grows from line to line, and two symbols that share an exposure so.

use super::super::mixture::{LEFT, PARABOLA, SHARE, STEP_MAX};
use super::split::agreement_nats;
use super::{LineDelay, Rows};
use crate::detect::{DetectError, Detection, Mixture, bits_where, soft_panel};
use crate::frame::Frame;
use crate::likelihood::crop::Crop;
use crate::likelihood::estimate::Estimate;
use crate::likelihood::level_prior::LevelPrior;
use crate::likelihood::mixture::{Guess, Shares, TwoSymbols, within_range};
use crate::likelihood::model::Model;
use link::panel::{LEDS, SoftPanel};

/// Values of α in the panel's middle that are tried with each (count).
const MIDDLES: usize = 32;
/// Half the width of the parabola by which the slope is improved (share of it).
const LINE_STEP: f32 = 0.05;
/// The most that one step changes the slope (share of it).
const SLOPE_STEP_MAX: f32 = 0.4;
/// How sure an LED must be read to tell whether it is the symbol's before (nats).
const TELLING_NATS: f32 = 4.0;

/// α of each LED: that of one in the panel's middle, and by how much it grows from one image pixel to the one below it.
#[derive(Clone, Copy)]
pub(super) struct LineShare {
    middle: f32,
    pub slope: f32,
    rows: Rows,
    /// What is known of the slope.
    delay: LineDelay,
    /// 1 over the variance that the frame alone leaves the slope.
    pub precision: f32,
}

impl LineShare {
    /// By how much α differs between the panel's ends and its middle.
    fn spread(&self) -> f32 {
        self.slope.abs() * self.rows.half
    }

    /// The α that explains best by how much each LED's light has changed, if something is `known` of it: that of those whose state is the
    /// same in both symbols not at all, that of the others by their α.
    fn first(changed: &[f32; LEDS], known: u64, rows: &Rows, delay: &LineDelay) -> Option<Self> {
        let mut best: Option<(f32, Self)> = None;
        for slope in delay.slopes(rows) {
            let spread = slope.abs() * rows.half;
            for step in 0..=MIDDLES {
                let middle = (1.0 + 2.0 * spread) * step as f32 / MIDDLES as f32 - spread;
                let share = Self {
                    middle,
                    slope,
                    rows: *rows,
                    delay: *delay,
                    precision: 0.0,
                };
                let leds = (0..LEDS).filter(|led| known >> led & 1 == 1);
                let left: f32 = leds
                    .map(|led| {
                        let off = changed[led] - share.of(led);
                        (off * off).min(changed[led] * changed[led])
                    })
                    .sum();
                if best.is_none_or(|(least, _)| left < least) {
                    best = Some((left, share));
                }
            }
        }
        best.map(|(_, share)| share)
    }
}

impl Shares for LineShare {
    fn of(&self, led: usize) -> f32 {
        (self.middle + self.slope * self.rows.below[led]).clamp(0.0, 1.0)
    }

    fn plus(&self, step: f32) -> Self {
        Self {
            middle: self.middle + step,
            ..*self
        }
    }

    fn within_range(self) -> Self {
        Self {
            middle: within_range(self.middle, self.spread()),
            ..self
        }
    }

    fn is_of_two(&self) -> bool {
        let mut shares = (0..LEDS).map(|led| self.of(led));
        shares.clone().any(|share| share >= *SHARE.start()) && shares.any(|share| share <= *SHARE.end())
    }

    /// Moves the slope to the lowest point of the parabola through the loss beside it, weighed against what is known.
    fn improve<const PIXELS: usize>(model: &mut Model<PIXELS>, estimate: &mut Estimate, guess: &mut Guess<Self>) {
        let at = guess.share;
        let unit = PARABOLA.max(LINE_STEP * at.spread()) / at.rows.half;
        let mut loss = |step: f32| {
            estimate.share = guess.lit(Self {
                slope: at.slope + step,
                ..at
            });
            model.expect(estimate);
            model.image.loss(estimate.levels.noise)
        };
        let seen = [-unit, 0.0, unit].map(&mut loss);
        let known = [-unit, 0.0, unit].map(|step| at.delay.loss(at.slope + step, &at.rows));
        let bend = |[left, here, right]: [f32; 3]| left + right - 2.0 * here;
        let [left, here, right] = core::array::from_fn(|i| seen[i] + known[i]);
        let all = bend([left, here, right]);
        if all > 0.0 {
            let step = 0.5 * unit * (left - right) / all;
            let most = STEP_MAX.max(at.spread() * SLOPE_STEP_MAX) / at.rows.half;
            let slope = at.slope + step.clamp(-most, most);
            // The camera does not turn round.
            if slope * at.slope > 0.0 {
                guess.share.slope = slope;
            }
        }
        guess.share.precision = bend(seen).max(0.0) / (unit * unit);
        estimate.share = guess.lit(guess.share);
        model.expect_with_noise(estimate);
    }
}

impl TwoSymbols<LineShare> {
    /// Whether they [explain](Self::explain) the frame, or at least do so no worse than one symbol, which leaves `noise`, while the first
    /// is the symbol `before` in the rows that the change did not catch: where it catches a row or two, that is all there is to tell it
    /// by.
    pub fn explain_by_rows(&self, levels: &LevelPrior, before: &SoftPanel, noise: f32) -> bool {
        let is_telling = |led: usize| self.share.of(led) < *SHARE.start() && self.ending[led].abs() > TELLING_NATS;
        let telling = (0..LEDS).fold(0u64, |leds, led| leds | u64::from(is_telling(led)) << led);
        let agree = soft_panel(&self.ending).hard().bits() ^ !before.hard().bits();
        let is_before = agreement_nats(agree, telling & before.seen()) >= self.share.delay.evidence_needed();
        self.explain(levels, &self.where_seen(before), noise) || self.share.is_of_two() && self.noise <= noise && is_before
    }

    /// Whether they explain it clearly better than if all lines are exposed at once.
    pub fn explain_better_than(&self, at_once: &TwoSymbols) -> bool {
        self.noise < LEFT * at_once.noise
    }

    /// What is known of the symbol before, of the LEDs of which the frame shows it.
    fn where_seen(&self, before: &SoftPanel) -> SoftPanel {
        SoftPanel(core::array::from_fn(|led| {
            if self.share.of(led) <= *SHARE.end() { before.0[led] } else { 0 }
        }))
    }

    /// The reading: of each LED that of the symbol which was shown for longer.
    pub fn detection(&self) -> Detection {
        let longer: [f32; LEDS] = core::array::from_fn(|led| {
            if self.share.of(led) < 0.5 {
                self.ending[led]
            } else {
                self.beginning[led]
            }
        });
        Detection {
            mixed: Some(Mixture {
                share: self.share.middle,
                growth: self.share.rows.growth(self.share.slope),
                ending: soft_panel(&self.ending),
                beginning: soft_panel(&self.beginning),
            }),
            ..Detection::new(bits_where(|led| longer[led] > 0.0), longer)
        }
    }
}

impl<const PIXELS: usize> Model<PIXELS> {
    /// The symbol of which `before` is known, and the one after it, where lines are read out one after another, as `delay` has it.
    // Not inlined: the stack of those who never call it stays as it is.
    #[inline(never)]
    pub(super) fn two_symbols_by_lines(
        &mut self,
        frame: &Frame<'_>,
        crop: &Crop,
        before: &SoftPanel,
        prior: &LevelPrior,
        delay: &LineDelay,
    ) -> Result<Option<TwoSymbols<LineShare>>, DetectError> {
        let rows = self.rows(crop);
        self.two_symbols_of(frame, crop, before, prior, |changed, known| {
            LineShare::first(changed, known, &rows, delay)
        })
    }

    /// The panel's LEDs as the camera's lines see them.
    pub(super) fn rows(&self, crop: &Crop) -> Rows {
        Rows::of(&crop.centre, self.pixels[0] * crop.scale.bin as f32)
    }
}
