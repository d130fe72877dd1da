//! The bits of greatest likelihood, climbed to by flipping LEDs alone and in groups.

use super::image::{Image, censored_loss, root};
use super::levels::{Levels, Pull};
use super::spots::{LANES, Spots};
use link::panel::{LEDS, SIDE};

/// Rounds over all LEDs; a climb has always ended in far fewer.
const ROUNDS: usize = 12;
/// The most LEDs of a group, from couplings and pixel by pixel.
const DEPTH: usize = 8;
const GROWN_DEPTH: usize = 4;
/// Smaller gains, in nats, are rounding.
pub(super) const LEAST_GAIN: f32 = 1e-2;

/// What flips gain, alone and in pairs, in nats.
pub(super) struct Couplings {
    gain: [f32; LEDS],
    pair: [[f32; LEDS]; LEDS],
}

impl Couplings {
    pub const fn new() -> Self {
        Self {
            gain: [0.0; LEDS],
            pair: [[0.0; LEDS]; LEDS],
        }
    }

    /// For each LED the group of flips with it that gains most, one bit an LED, and that gain. Groups grow by the flip that
    /// gains most or loses least (Kernighan & Lin 1970).
    pub fn groups(&self) -> [(u64, f32); LEDS] {
        core::array::from_fn(|led| {
            let mut next = self.gain;
            let (mut group, mut total) = (0u64, 0.0);
            let mut best = (0, f32::NEG_INFINITY);
            let (mut other, mut value) = (led, self.gain[led]);
            for _ in 0..DEPTH {
                group |= 1 << other;
                total += value;
                if total > best.1 {
                    best = (group, total);
                }
                for (next, pair) in next.iter_mut().zip(&self.pair[other]) {
                    *next += pair;
                }
                (other, value) = (0, f32::NEG_INFINITY);
                for (candidate, &rise) in next.iter().enumerate() {
                    if rise > value && group >> candidate & 1 == 0 {
                        (other, value) = (candidate, rise);
                    }
                }
            }
            best
        })
    }
}

/// A climb in progress: the image holds what is expected of `share` and `levels`.
pub(super) struct Climb<'a, const PIXELS: usize> {
    pub image: &'a mut Image<PIXELS>,
    pub spots: &'a Spots,
    pub levels: &'a Levels,
    /// For which share of the exposure each LED is On: 0 or 1 but where [`Climb::soften`] is at work.
    pub share: &'a mut [f32; LEDS],
}

impl<const PIXELS: usize> Climb<'_, PIXELS> {
    /// Gives each LED the share that is to be expected of it, given those of the others.
    pub fn soften(&mut self) {
        for led in 0..LEDS {
            let share = self.share[led];
            let on = self.gain_of(led, (1.0 - share) * self.levels.contrast);
            let off = self.gain_of(led, -share * self.levels.contrast);
            self.set(led, 1.0 / (1.0 + libm::expf(off - on)));
        }
    }

    /// Makes every LED On or Off, whichever is nearer.
    pub fn harden(&mut self) {
        for led in 0..LEDS {
            let share = if self.share[led] > 0.5 { 1.0 } else { 0.0 };
            self.set(led, share);
        }
    }

    /// Flips single LEDs as long as the likelihood rises.
    pub fn settle(&mut self) {
        for _ in 0..ROUNDS {
            let mut settled = true;
            for led in 0..LEDS {
                if self.gain(led) > LEAST_GAIN {
                    self.flip(led);
                    settled = false;
                }
            }
            if settled {
                return;
            }
        }
    }

    /// What the likelihood would lose by each LED's flip alone, in nats.
    pub fn losses(&self) -> [f32; LEDS] {
        core::array::from_fn(|led| (-self.gain(led)).max(0.0))
    }

    /// Flips groups of neighbours that raise the likelihood, each grown pixel by pixel from one LED; whether there was any.
    pub fn grow(&mut self) -> bool {
        let mut risen = false;
        for led in 0..LEDS {
            let mut members = [led; GROWN_DEPTH];
            let (mut total, mut best) = (self.gain(led), (0, LEAST_GAIN));
            self.flip(led);
            let mut count = 1;
            loop {
                if total > best.1 {
                    best = (count, total);
                }
                if count == GROWN_DEPTH {
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

    /// The LED beside a group whose flip gains most, and that gain.
    fn best_beside(&self, members: &[usize]) -> Option<(usize, f32)> {
        (0..LEDS)
            .filter(|led| {
                !members.contains(led) && members.iter().any(|&m| are_neighbours(m, *led))
            })
            .map(|led| (led, self.gain(led)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Works out what flips gain when the levels follow them.
    pub fn couple(&mut self, pull: &Pull, couplings: &mut Couplings) {
        let inner =
            |a: usize, b: usize| -> f32 { pull[a].iter().zip(&pull[b]).map(|(a, b)| a * b).sum() };
        let alone: [f32; LEDS] = core::array::from_fn(|led| self.gain(led));
        couplings.gain = core::array::from_fn(|led| alone[led] + 0.5 * inner(led, led));
        for led in 0..LEDS {
            self.flip(led);
            for (other, alone) in alone.iter().enumerate().skip(led + 1) {
                let through_pixels = if self.spots.overlap(led, other) {
                    self.gain(other) - alone
                } else {
                    0.0
                };
                let pair = through_pixels + inner(led, other);
                couplings.pair[led][other] = pair;
                couplings.pair[other][led] = pair;
            }
            self.flip(led);
        }
    }

    pub fn flip(&mut self, led: usize) {
        self.set(led, 1.0 - self.share[led]);
    }

    fn set(&mut self, led: usize, share: f32) {
        let change = (share - self.share[led]) * self.levels.contrast;
        self.share[led] = share;
        let [x, y] = self.spots.first[led];
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
        self.gain_of(led, (1.0 - 2.0 * self.share[led]) * self.levels.contrast)
    }

    /// By how much the log-likelihood rises if the light of an LED changes, in nats.
    fn gain_of(&self, led: usize, change: f32) -> f32 {
        let [x, y] = self.spots.first[led];
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
                        let below = censored_loss((full - before) * per_deviation)
                            - censored_loss((full - after) * per_deviation);
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

/// Whether two LEDs stand side by side or corner to corner.
fn are_neighbours(a: usize, b: usize) -> bool {
    (a / SIDE).abs_diff(b / SIDE) <= 1 && (a % SIDE).abs_diff(b % SIDE) <= 1
}
