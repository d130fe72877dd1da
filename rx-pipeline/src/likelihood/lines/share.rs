//! α that grows from line to line, and two symbols that share an exposure in this way.

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

/// Values of α in the panel's middle for each slope (count).
const MIDDLES: usize = 32;
/// Half the width of the parabola that refines the slope (share of it).
const LINE_STEP: f32 = 0.05;
/// The most that one step changes the slope (share of it).
const SLOPE_STEP_MAX: f32 = 0.4;
/// Minimum certainty of an LED for its comparison with the symbol before (nats).
const TELLING_NATS: f32 = 4.0;

/// α of each LED: its value in the panel's middle, and its growth from one image pixel to the one below.
#[derive(Clone, Copy)]
pub(super) struct LineShare {
    middle: f32,
    pub slope: f32,
    rows: Rows,
    /// The known delay, a prior of the slope.
    delay: LineDelay,
    /// 1 over the variance of the slope by the frame alone.
    pub precision: f32,
}

impl LineShare {
    /// The difference of α between the panel's ends and its middle.
    fn spread(&self) -> f32 {
        self.slope.abs() * self.rows.half
    }

    /// The α that best explains the change of each `known` LED's light: LEDs of the same state in both symbols do not change, and the
    /// others change by their α.
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

    /// Moves the slope to the minimum of a parabola through the loss beside it, with the known delay as a prior.
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
            // The direction of reading does not change.
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
    /// Whether the two symbols [explain](Self::explain) the frame. It also suffices if they leave no more `noise` than one symbol, and the
    /// first agrees with the symbol `before` in the rows that the change did not catch: if it catches a row or two, there is no other
    /// evidence.
    pub fn explain_by_rows(&self, levels: &LevelPrior, before: &SoftPanel, noise: f32) -> bool {
        let is_telling = |led: usize| self.share.of(led) < *SHARE.start() && self.ending[led].abs() > TELLING_NATS;
        let telling = (0..LEDS).fold(0u64, |leds, led| leds | u64::from(is_telling(led)) << led);
        let agree = soft_panel(&self.ending).hard().bits() ^ !before.hard().bits();
        let is_before = agreement_nats(agree, telling & before.seen()) >= self.share.delay.evidence_needed();
        self.explain(levels, &self.where_seen(before), noise) || self.share.is_of_two() && self.noise <= noise && is_before
    }

    /// Whether they explain it clearly better than two symbols that all lines saw change at once.
    pub fn explain_better_than(&self, at_once: &TwoSymbols) -> bool {
        self.noise < LEFT * at_once.noise
    }

    /// The soft values of the symbol before, for the LEDs that show it in the frame.
    fn where_seen(&self, before: &SoftPanel) -> SoftPanel {
        SoftPanel(core::array::from_fn(|led| {
            if self.share.of(led) <= *SHARE.end() { before.0[led] } else { 0 }
        }))
    }

    /// The reading: each LED's bit is that of the symbol that was shown longer there.
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
    /// The symbol with soft values `before`, and the one after it, if lines are read out one after another by `delay`.
    // Not inlined: it would grow the stack of callers that never need it.
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
