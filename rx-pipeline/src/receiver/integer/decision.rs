//! Splits the LEDs into two groups, with the certainty of each LED's group.

use super::samples::{GREY, Samples};
use link::panel::{LEDS, LLR_STEP, SoftPanel};

/// Maximum error of a feature in integer arithmetic, in grey levels: places are rounded down to 1/256 of a pixel, and the light differs by
/// up to 120 grey levels from one pixel to the next.
#[cfg(test)]
pub const FEATURE_ERROR_GREY: f64 = 0.5;
/// Maximum number of rounds of clustering.
const ROUNDS: usize = 8;
/// Minimum difference of the groups' means, in units of a sample: six grey levels.
const LEAST_CONTRAST: i32 = 6 * GREY;
/// Minimum distance of two valid groups: noise gives 7, evenly spread light 12.
const LEAST_DISTANCE: u32 = 16;
/// Steps of a soft value per nat.
const STEPS_PER_NAT: i64 = (1.0 / LLR_STEP) as i64;
/// The contrast divided by the smallest assumed deviation within a group, which is 1/16: groups of 64 cells cannot show a smaller one.
const LEAST_DEVIATION: i64 = 16;
/// The greatest soft value.
const MOST: i64 = 127;

/// The decision about a panel's bits.
#[derive(Clone, Copy, Debug)]
pub struct Decision {
    /// Bit 8·row + column: 1 for On.
    pub bits: u64,
    /// The log-likelihood ratio of each LED.
    pub soft: SoftPanel,
    /// The squared contrast of the groups relative to their variance.
    pub distance: u32,
}

impl Decision {
    /// Two groups with a common variance; `None` if they differ too little or are one.
    pub fn of(samples: &Samples) -> Option<Self> {
        let features: [i32; LEDS] = core::array::from_fn(|led| samples.feature(led));
        let (off, on) = groups(&features)?;
        if on - off < LEAST_CONTRAST {
            return None;
        }
        let middle = (on + off) / 2;
        let contrast = i64::from(on - off);
        let scatter: i64 = features
            .iter()
            .map(|&feature| {
                let mean = if feature > middle { on } else { off };
                let deviation = i64::from(feature - mean);
                deviation * deviation
            })
            .sum();
        // Two means have been estimated from the same cells.
        let least = contrast * contrast / (LEAST_DEVIATION * LEAST_DEVIATION);
        let variance = (scatter / (LEDS as i64 - 2)).max(least).max(1);
        let mut bits = 0;
        let mut soft = SoftPanel::ERASED;
        for (led, (&feature, soft)) in features.iter().zip(&mut soft.0).enumerate() {
            bits |= u64::from(feature > middle) << led;
            let steps = i64::from(feature - middle) * contrast * STEPS_PER_NAT / variance;
            *soft = steps.clamp(-MOST, MOST) as i8;
        }
        Some(Self {
            bits,
            soft,
            distance: (contrast * contrast / variance) as u32,
        })
    }

    /// Whether the groups are farther apart than those of noise and of evenly spread light.
    pub fn is_parted(&self) -> bool {
        self.distance >= LEAST_DISTANCE
    }

    /// The mean probability of a right bit according to the soft values.
    pub fn confidence(&self) -> f32 {
        // 1/(1 + exp(x)) in 1/65 536, at x = 0, 1/4 and so on; 0 beyond the last.
        const WRONG: [u16; 45] = [
            32_768, 28_693, 24_743, 21_025, 17_625, 14_595, 11_955, 9_702, 7_812, 6_249, 4_971, 3_938, 3_108, 2_446, 1_921, 1_506, 1_179,
            922, 720, 562, 439, 342, 267, 208, 162, 126, 98, 77, 60, 47, 36, 28, 22, 17, 13, 10, 8, 6, 5, 4, 3, 2, 2, 1, 1,
        ];
        let wrong: u32 = self
            .soft
            .0
            .iter()
            .map(|&soft| u32::from(WRONG.get(usize::from(soft.unsigned_abs())).copied().unwrap_or(0)))
            .sum();
        1.0 - wrong as f32 / (65_536 * LEDS as u32) as f32
    }
}

/// The means of the dark and the bright group (Lloyd's algorithm); `None` if there is only one.
fn groups(features: &[i32; LEDS]) -> Option<(i32, i32)> {
    let mut off = features.iter().copied().min()?;
    let mut on = features.iter().copied().max()?;
    for _ in 0..ROUNDS {
        let middle = (on + off) / 2;
        let (mut sums, mut counts) = ([0i32; 2], [0i32; 2]);
        for &feature in features {
            let group = usize::from(feature > middle);
            sums[group] += feature;
            counts[group] += 1;
        }
        if counts.contains(&0) {
            return None;
        }
        let means = [sums[0] / counts[0], sums[1] / counts[1]];
        if means == [off, on] {
            break;
        }
        [off, on] = means;
    }
    Some((off, on))
}
