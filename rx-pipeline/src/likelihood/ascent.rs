//! Likelihood ascent search (Vardhan, Mohammed, Chockalingam & Rajan 2008): the bits of greatest likelihood, reached LED by LED.

use super::estimate::hard;
use super::flips::FlipGains;
use super::gauss_newton::SchurFactor;
use super::image::{Image, SIDE_MAX, censored_loss, root};
use super::leds::LedLevels;
use super::levels::Levels;
use crate::spots::SPOT_PX;
use crate::spots::{LANES, SpotTable, dot};
use link::panel::{LEDS, SIDE};

/// Rounds of flipping single LEDs, at most (count): an ascent has always ended in far fewer.
const ASCENT_ROUNDS: usize = 12;
/// LEDs of a group of neighbours, at most (count). More: slower.
const NEIGHBOURS: usize = 4;
/// Smaller gains are rounding (nats).
pub(super) const LEAST_GAIN: f32 = 1e-2;
/// The residuals of an LED's image count up to this for the misfit of the model (multiple of the noise). Higher: a single broken LED makes
/// all others doubtful.
pub(super) const MISFIT_MAX: f32 = 100.0;
/// Sweeps over the LEDs for a measurement of their light (count).
const LIGHT_SWEEPS: usize = 2;

/// An ascent in progress: the image holds the expectation of `share` and `levels`.
pub(super) struct Ascent<'a, const PIXELS: usize> {
    pub image: &'a mut Image<PIXELS>,
    pub spots: &'a SpotTable,
    pub levels: &'a Levels,
    pub leds: &'a LedLevels,
    /// The share of the exposure for which each LED is On: 0 or 1, except during [`Ascent::cancel_interference`].
    pub share: &'a mut [f32; LEDS],
}

impl<const PIXELS: usize> Ascent<'_, PIXELS> {
    /// One sweep of soft interference cancellation: gives each LED its expected share, given those of the others.
    pub fn cancel_interference(&mut self) {
        for led in 0..LEDS {
            let share = self.share[led];
            let on = self.gain_of_share(led, 1.0 - share);
            let off = self.gain_of_share(led, -share);
            self.set(led, 1.0 / (1.0 + libm::expf(off - on)));
        }
    }

    /// Makes every LED On or Off, whichever is nearer.
    pub fn decide(&mut self) {
        for led in 0..LEDS {
            self.set(led, hard(self.share[led]));
        }
    }

    /// Flips single LEDs as long as the likelihood rises.
    pub fn flip_singly(&mut self) {
        for _ in 0..ASCENT_ROUNDS {
            let mut done = true;
            for led in 0..LEDS {
                if self.gain(led) > LEAST_GAIN {
                    self.flip(led);
                    done = false;
                }
            }
            if done {
                return;
            }
        }
    }

    /// The loss of likelihood by each LED's flip alone, in nats.
    pub fn flip_costs(&self) -> [f32; LEDS] {
        core::array::from_fn(|led| (-self.gain(led)).max(0.0))
    }

    /// Flips groups of neighbours that raise the likelihood, each grown LED by LED; returns whether there was any.
    pub fn flip_groups(&mut self) -> bool {
        let mut risen = false;
        for led in 0..LEDS {
            let mut members = [led; NEIGHBOURS];
            let (mut total, mut best) = (self.gain(led), (0, LEAST_GAIN));
            self.flip(led);
            let mut count = 1;
            loop {
                if total > best.1 {
                    best = (count, total);
                }
                if count == NEIGHBOURS {
                    break;
                }
                let Some((other, gain)) = self.best_beside(&members[..count]) else {
                    break;
                };
                self.flip(other);
                members[count] = other;
                count += 1;
                total += gain;
            }
            risen |= best.0 > 0;
            for &member in &members[best.0..count] {
                self.flip(member);
            }
        }
        risen
    }

    /// The neighbour of a group whose flip gains most, and that gain.
    fn best_beside(&self, members: &[usize]) -> Option<(usize, f32)> {
        (0..LEDS)
            .filter(|led| !members.contains(led) && members.iter().any(|&m| are_neighbours(m, *led)))
            .map(|led| (led, self.gain(led)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Computes the gain of flips after the levels have adapted, with all pixels linear in the light: suitable for many simultaneous flips
    /// that compensate each other.
    pub fn gains_by_slopes(&self, schur: &SchurFactor, gains: &mut FlipGains) {
        let scale = self.levels.contrast / self.levels.noise;
        let sign: [f32; LEDS] = core::array::from_fn(|led| (1.0 - 2.0 * self.share[led]) * self.leds.gain[led]);
        let mut patch = [[0.0; SIDE_MAX]; SPOT_PX];
        for led in 0..LEDS {
            gains.slope[led] = scale * sign[led] * self.weighted_spot(led, &mut patch);
            for other in led..LEDS {
                let through_pixels = if self.spots.touch(led, other) {
                    let signs = sign[led] * sign[other];
                    scale * self.levels.contrast * signs * self.product(led, other, &patch)
                } else {
                    0.0
                };
                let curvature = through_pixels - inner(&schur[led], &schur[other]);
                gains.pair[led][other] = -curvature;
                gains.pair[other][led] = -curvature;
            }
        }
    }

    /// The same pair by pair: suitable for few flips, and valid for saturated pixels too.
    pub fn gains_by_flips(&mut self, schur: &SchurFactor, gains: &mut FlipGains) {
        let alone: [f32; LEDS] = core::array::from_fn(|led| self.gain(led));
        gains.slope = core::array::from_fn(|led| alone[led] + 0.5 * inner(&schur[led], &schur[led]));
        for led in 0..LEDS {
            self.flip(led);
            gains.pair[led][led] = 0.0;
            for (other, alone) in alone.iter().enumerate().skip(led + 1) {
                let through_pixels = if self.spots.overlap(led, other) {
                    self.gain(other) - alone
                } else {
                    0.0
                };
                let pair = through_pixels + inner(&schur[led], &schur[other]);
                gains.pair[led][other] = pair;
                gains.pair[other][led] = pair;
            }
            self.flip(led);
        }
    }

    /// Fills `patch` with the spot of an LED divided by four times the light, as far up and down as the spot reaches. If a pixel is seen
    /// and expected to be saturated, only the part of a flip counts that takes it below saturation. Returns the sum of the residuals,
    /// weighted by the spot.
    fn weighted_spot(&self, led: usize, patch: &mut [[f32; SIDE_MAX]; SPOT_PX]) -> f32 {
        let (image, across) = (&*self.image, self.spots.across(led));
        let [x, y] = self.spots.first(led);
        let flip = (self.contrast(led) * self.spots.peak()).max(f32::MIN_POSITIVE);
        let mut left = 0.0;
        for ((row, &down), to) in (y..).zip(self.spots.down(led)).zip(patch) {
            to[..image.stride].fill(0.0);
            let start = row * image.stride + x;
            for (at, (to, across)) in (start..).zip(to[x..].iter_mut().zip(across)) {
                let (seen, root) = (image.seen[at].min(image.full), image.root[at]);
                let spot = 0.5 / root * across * down;
                let is_full = image.seen[at] >= image.full;
                let beyond = if is_full { (root - seen).max(0.0) } else { 0.0 };
                let counts = (1.0 - 2.0 * root * beyond / flip).max(0.0);
                left += if beyond > 0.0 { 0.0 } else { spot * (seen - root) };
                *to = 0.5 / root * counts * counts * spot;
            }
        }
        left
    }

    /// The product of an LED's spot with another's in `patch`, whose first row is the first of `led`.
    fn product(&self, led: usize, other: usize, patch: &[[f32; SIDE_MAX]; SPOT_PX]) -> f32 {
        let top = self.spots.first(led)[1];
        let [x, _] = self.spots.first(other);
        let across = self.spots.across(other);
        let mut sum = 0.0;
        for (row, line) in (top..).zip(&patch[..self.spots.taps[1]]) {
            if let Some(down) = self.spots.down_at(other, row) {
                sum += down * dot(across, &line[x..]);
            }
        }
        sum
    }

    pub fn flip(&mut self, led: usize) {
        self.set(led, 1.0 - self.share[led]);
    }

    /// Turns an LED On for a share of the exposure.
    pub fn set(&mut self, led: usize, share: f32) {
        let change = (share - self.share[led]) * self.contrast(led);
        self.share[led] = share;
        self.add(led, change);
    }

    /// Adds light to an LED.
    fn add(&mut self, led: usize, change: f32) {
        let [x, y] = self.spots.first(led);
        let across = self.spots.across(led);
        for (row, &down) in (y..).zip(self.spots.down(led)) {
            let start = row * self.image.stride + x;
            let range = start..start + across.len();
            let expected = &mut self.image.expected[range.clone()];
            let roots = &mut self.image.root[range];
            let scale = change * down;
            for ((expected, root_light), &across) in expected.iter_mut().zip(roots).zip(across) {
                *expected += scale * across;
                *root_light = root(*expected);
            }
        }
    }

    fn gain(&self, led: usize) -> f32 {
        self.gain_of_share(led, 1.0 - 2.0 * self.share[led])
    }

    /// The light of an LED from Off to On.
    fn contrast(&self, led: usize) -> f32 {
        self.levels.contrast * self.leds.gain[led]
    }

    /// The gain of log-likelihood if an LED's share of the exposure changes by `change`, in nats.
    pub fn gain_of_share(&self, led: usize, change: f32) -> f32 {
        self.gain_of(led, change * self.contrast(led))
    }

    /// The light of each LED that explains most, given that of its neighbours, in contrasts above Off; and its variance by noise. The image
    /// then holds that light instead of the expectation of the bits.
    pub fn measure_light(&mut self) -> ([f32; LEDS], f32) {
        let mut lit = self.leds.lit(self.share);
        let mut information = 0.0;
        for _ in 0..LIGHT_SWEEPS {
            information = 0.0;
            for (led, lit) in lit.iter_mut().enumerate() {
                let [slope, curvature] = self.slope(led);
                let change = slope / (curvature + f32::MIN_POSITIVE);
                information += curvature / LEDS as f32;
                *lit += change / self.levels.contrast;
                self.add(led, change);
            }
        }
        let scale = self.levels.contrast * self.levels.contrast * self.spots.independence();
        (lit, self.levels.noise / (information * scale).max(f32::MIN_POSITIVE))
    }

    /// The variance of the residuals of LEDs' images relative to that of independent pixel noise: 1 for noise alone, more if errors of the
    /// model remain, which are as wide as an LED.
    pub fn dispersion(&self) -> f32 {
        let misfits = (0..LEDS).map(|led| {
            let [slope, curvature] = self.slope(led);
            let misfit = slope * slope / (curvature * self.levels.noise + f32::MIN_POSITIVE);
            misfit.min(MISFIT_MAX)
        });
        (misfits.sum::<f32>() / LEDS as f32).max(1.0)
    }

    /// The downward slope of half the sum of squares with an LED's light, and its curvature, without saturated pixels.
    fn slope(&self, led: usize) -> [f32; 2] {
        let [x, y] = self.spots.first(led);
        let across = self.spots.across(led);
        let (mut slope, mut curvature) = (0.0, 0.0);
        for (row, &down) in (y..).zip(self.spots.down(led)) {
            let start = row * self.image.stride + x;
            let range = start..start + across.len();
            let pixels = self.image.seen[range.clone()].iter().zip(&self.image.root[range]);
            for ((&seen, &root), &across) in pixels.zip(across) {
                let spot = if seen < self.image.full { 0.5 * down * across / root } else { 0.0 };
                slope += spot * (seen - root);
                curvature += spot * spot;
            }
        }
        [slope, curvature]
    }

    /// The gain of log-likelihood if the light of an LED changes by `change`, in nats.
    pub fn gain_of(&self, led: usize, change: f32) -> f32 {
        let [x, y] = self.spots.first(led);
        let across = self.spots.across(led);
        let full = self.image.full;
        let per_deviation = 1.0 / libm::sqrtf(self.levels.noise);
        let (mut closer, mut saturated) = ([0.0f32; LANES], [0.0f32; LANES]);
        for (row, &down) in (y..).zip(self.spots.down(led)) {
            let start = row * self.image.stride + x;
            let range = start..start + across.len();
            let lanes = self.image.seen[range.clone()]
                .chunks_exact(LANES)
                .zip(self.image.expected[range.clone()].chunks_exact(LANES))
                .zip(self.image.root[range].chunks_exact(LANES))
                .zip(across.chunks_exact(LANES));
            let scale = change * down;
            if self.image.is_saturated(row) {
                for (((seen, expected), before), across) in lanes {
                    for lane in 0..LANES {
                        let (seen, before) = (seen[lane], before[lane]);
                        let after = root(expected[lane] + scale * across[lane]);
                        let is_full = seen >= full;
                        let below = censored_loss((full - before) * per_deviation) - censored_loss((full - after) * per_deviation);
                        let plain = (after - before) * (2.0 * seen - after - before);
                        closer[lane] += if is_full { 0.0 } else { plain };
                        saturated[lane] += if is_full { below } else { 0.0 };
                    }
                }
            } else {
                for (((seen, expected), before), across) in lanes {
                    for lane in 0..LANES {
                        let (seen, before) = (seen[lane], before[lane]);
                        let after = root(expected[lane] + scale * across[lane]);
                        closer[lane] += (after - before) * (2.0 * seen - after - before);
                    }
                }
            }
        }
        0.5 * closer.iter().sum::<f32>() / self.levels.noise + saturated.iter().sum::<f32>()
    }
}

fn inner(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Whether two LEDs stand side by side or corner to corner.
fn are_neighbours(a: usize, b: usize) -> bool {
    (a / SIDE).abs_diff(b / SIDE) <= 1 && (a % SIDE).abs_diff(b % SIDE) <= 1
}
