//! Unequal, dim, dead and stuck LEDs.
//!
//! Over frames of random bits the light of an LED has two levels. The first three moments of such a mixture of two points determine both
//! levels and their frequencies: with mean μ, deviation σ and skewness γ they lie at μ + σ·(γ ± √(γ² + 4))/2. This needs no known
//! bits. Decided bits would confirm themselves: an LED so dim that it is always read as Off still has two levels, and an LED that does not
//! follow the message has one.
//!
//! Only panels that differ from the recent ones count. A short message that repeats may leave many LEDs in one state, which is not a
//! defect.

use core::ops::RangeInclusive;
use link::panel::{LEDS, PanelFrame};

/// Light that is neither On nor Off (contrasts).
const BETWEEN: RangeInclusive<f32> = 0.25..=0.75;
/// If more LEDs have such light, it is a mixture of symbols (count).
const BETWEEN_MAX: usize = 18;
/// Recent panels in memory, so that they do not count twice (count).
const SEEN_PANELS: usize = 16;
/// A panel is new if at least this many LEDs differ from each of those (count).
const NEW_LEDS: u32 = 16;
/// The average of the light of LEDs spans about this many new panels (count).
const MEMORY_PANELS: u32 = 48;
/// New panels before LEDs get levels of their own (count).
const LEARN_PANELS: u32 = 5;
/// New panels without any change before an LED counts as broken (count): a sound one stays the same once in 2¹⁵.
const BROKEN_PANELS: u32 = 16;
/// The spread of brightness among the LEDs of one panel (share). Lower: a stronger prior that they are alike.
const SPREAD: f32 = 0.15;
/// The growth of uncertainty with the order of a moment (per contrast² of noise). Lower: in noise, LEDs get wrong levels.
const HIGH_MOMENTS: f32 = 20.0;
/// Gains this close to 1 need no proof (share).
const USUAL_GAIN: f32 = 0.35;
/// LEDs of other gains must have been in either state in more panels than this (count), because one may have been a mixture.
const SEEN_IN_BOTH: f32 = 1.5;
/// Levels closer than this count as one (contrasts).
const GAP_MIN: f32 = 0.15;
/// The limit of an LED's light (contrasts): more is not its own.
const LIT_MAX: f32 = 3.0;
/// The limit of skewness (no unit): one state in a dozen panels.
const SKEWNESS_MAX: f32 = 3.0;

/// The light of each LED in terms of the panel's levels: `offset` above Off and, if On, `gain` times the contrast more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LedLevels {
    pub offset: [f32; LEDS],
    pub gain: [f32; LEDS],
}

impl LedLevels {
    /// LEDs without light; all zeros.
    pub const DARK: Self = Self {
        offset: [0.0; LEDS],
        gain: [0.0; LEDS],
    };

    /// Equal LEDs.
    pub const ALIKE: Self = Self {
        offset: [0.0; LEDS],
        gain: [1.0; LEDS],
    };

    /// The light of LEDs that are On for a `share` of the exposure, in contrasts above Off.
    pub fn lit(&self, share: &[f32; LEDS]) -> [f32; LEDS] {
        core::array::from_fn(|led| self.offset[led] + self.gain[led] * share[led])
    }

    /// The share of the exposure for which LEDs of that light were On; a half if it is unknown.
    pub fn shares(&self, lit: &[f32; LEDS]) -> [f32; LEDS] {
        core::array::from_fn(|led| {
            if self.follows(led) {
                ((lit[led] - self.offset[led]) / self.gain[led]).clamp(0.0, 1.0)
            } else {
                0.5
            }
        })
    }

    /// Whether an LED follows the message.
    pub fn follows(&self, led: usize) -> bool {
        self.gain[led] > 0.0
    }

    /// The LEDs that do not follow the message.
    pub fn broken(&self) -> u64 {
        (0..LEDS).fold(0, |broken, led| broken | u64::from(!self.follows(led)) << led)
    }
}

/// Whether most LEDs are clearly On or Off, as those of a single symbol are.
pub(super) fn is_clear_cut(lit: &[f32; LEDS]) -> bool {
    lit.iter().filter(|lit| BETWEEN.contains(*lit)).count() <= BETWEEN_MAX
}

/// The moments of each LED's light, over panels that differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LedMoments {
    /// Means of the light, its square and its cube, in contrasts above Off.
    moments: [[f32; 3]; LEDS],
    /// The number of panels.
    panels: u32,
    /// The most recent panels.
    seen: [u64; SEEN_PANELS],
    next: usize,
}

impl LedMoments {
    /// No panels yet.
    pub const NONE: Self = Self {
        moments: [[0.0; 3]; LEDS],
        panels: 0,
        seen: [0; SEEN_PANELS],
        next: 0,
    };

    /// Whether a panel differs from all recent ones.
    pub fn is_new(&self, panel: PanelFrame) -> bool {
        let known = &self.seen[..SEEN_PANELS.min(self.panels as usize)];
        known.iter().all(|seen| (seen ^ panel.bits()).count_ones() >= NEW_LEDS)
    }

    /// Whether there are enough panels for levels.
    pub fn are_known(&self) -> bool {
        self.panels >= LEARN_PANELS
    }

    /// Continues after a change of the curve, with less weight on the old moments, which hold only roughly.
    pub fn discount(&mut self) {
        self.panels = self.panels.min(LEARN_PANELS);
    }

    /// Adds the light of the LEDs in a new panel.
    pub fn update(&mut self, panel: PanelFrame, lit: &[f32; LEDS]) {
        self.seen[self.next] = panel.bits();
        self.next = (self.next + 1) % SEEN_PANELS;
        self.panels = (self.panels + 1).min(MEMORY_PANELS);
        let gain = 1.0 / self.panels as f32;
        for (moments, lit) in self.moments.iter_mut().zip(lit) {
            let lit = lit.clamp(-LIT_MAX, LIT_MAX);
            for (moment, power) in moments.iter_mut().zip([lit, lit * lit, lit * lit * lit]) {
                *moment += gain * (power - *moment);
            }
        }
    }

    /// The levels of the LEDs, given the variance `noise` of a single measurement of light.
    pub fn levels(&self, noise: f32) -> LedLevels {
        let mut levels = LedLevels::ALIKE;
        if !self.are_known() {
            return levels;
        }
        let panels = self.panels as f32;
        // The uncertainty of moments under noise grows with their order.
        let unsure = 4.0 * noise * (1.0 + HIGH_MOMENTS * noise) / panels;
        let weight = SPREAD * SPREAD / (SPREAD * SPREAD + unsure);
        let least = GAP_MIN + 3.0 * libm::sqrtf(unsure);
        let (mut sum, mut count) = ([0.0f32; 2], 0.0f32);
        for (led, moments) in self.moments.iter().enumerate() {
            let TwoPoints { low, gap, rarer } = TwoPoints::of(moments, noise);
            let is_usual = (gap - 1.0).abs() < USUAL_GAIN;
            if gap > least && (is_usual || rarer * panels > SEEN_IN_BOTH) {
                levels.offset[led] = weight * low;
                levels.gain[led] = 1.0 + weight * (gap - 1.0);
                sum = [sum[0] + levels.offset[led], sum[1] + levels.gain[led]];
                count += 1.0;
            } else if gap <= least && self.panels >= BROKEN_PANELS && least < 0.5 {
                levels.offset[led] = moments[0];
                levels.gain[led] = 0.0;
            }
        }
        if count < LEDS as f32 / 2.0 {
            return LedLevels::ALIKE;
        }
        let [offset, gain] = sum.map(|sum| sum / count);
        for led in 0..LEDS {
            levels.offset[led] = (levels.offset[led] - offset) / gain;
            levels.gain[led] /= gain;
        }
        levels
    }
}

/// The two points of a mixture, from its moments.
struct TwoPoints {
    low: f32,
    gap: f32,
    /// The share of the rarer point.
    rarer: f32,
}

impl TwoPoints {
    /// The points for the moments of light with the variance `noise` about each.
    fn of([mean, square, cube]: &[f32; 3], noise: f32) -> Self {
        let variance = square - mean * mean - noise;
        if variance <= 0.0 {
            return Self {
                low: *mean,
                gap: 0.0,
                rarer: 0.0,
            };
        }
        let third = cube - 3.0 * mean * square + 2.0 * mean * mean * mean;
        let deviation = libm::sqrtf(variance);
        let skewness = (third / (variance * deviation)).clamp(-SKEWNESS_MAX, SKEWNESS_MAX);
        let gap = libm::sqrtf(skewness * skewness + 4.0);
        Self {
            low: mean + 0.5 * deviation * (skewness - gap),
            gap: deviation * gap,
            rarer: 0.5 * (1.0 - skewness.abs() / gap),
        }
    }
}
