//! Sets of LEDs to flip, and their gain.

use link::panel::LEDS;

/// LEDs of a group that grows by couplings, at most (count).
const GROUP_LEDS: usize = 8;

/// The LEDs that flip, one bit each, and the gain of log-likelihood, in nats.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FlipSet {
    pub flips: u64,
    pub gain: f32,
}

impl FlipSet {
    /// Sorts by falling gain.
    // Not inlined, so that a microcontroller's flash holds it once.
    #[inline(never)]
    pub fn sort(sets: &mut [Self]) {
        sets.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain));
    }
}

/// The gain of flips, in nats, as a quadratic form: Σ slope·δ + ½·Σ pair·δ·δ over the LEDs, δ = 1 for those that flip.
pub(super) struct FlipGains {
    /// The slope of each flip alone: its gain minus half the pair with itself.
    pub slope: [f32; LEDS],
    pub pair: [[f32; LEDS]; LEDS],
}

impl FlipGains {
    pub const fn new() -> Self {
        Self {
            slope: [0.0; LEDS],
            pair: [[0.0; LEDS]; LEDS],
        }
    }

    /// For each LED the group of flips with it that gains most, one bit an LED, and that gain. Groups grow by the flip that gains most or
    /// loses least (Kernighan & Lin 1970).
    pub fn groups(&self) -> [FlipSet; LEDS] {
        core::array::from_fn(|led| {
            let mut next = self.slope;
            let (mut group, mut total) = (0u64, 0.0);
            let mut best = (0, f32::NEG_INFINITY);
            let (mut other, mut value) = (led, self.slope[led]);
            for _ in 0..GROUP_LEDS {
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
            FlipSet {
                flips: best.0,
                gain: best.1,
            }
        })
    }
}
