//! The bits of least cost in a quadratic form, by a sphere decoder of bounded width (K-best; Guo & Nilsson 2006).
//!
//! Around the current bits, flips δ = 0 or 1 of the 64 LEDs cost ½·δᵀHδ − gᵀδ. With H = RᵀR and R triangular the cost is a sum over rows,
//! each of which depends only on its own LED and later ones. So the decoder decides on the LEDs from the last to the first, and keeps the
//! cheapest sets of decisions at each step. The undecided LEDs count as continuous, with the mean and variance of a fair bit; this adds the
//! same to the cost of all sets.

use super::flips::{FlipGains, FlipSet};
use link::panel::LEDS;

/// The most sets that the sphere decoder keeps (count).
const LIST_SETS: usize = 64;
/// Margin by which a set may cost more than the current bits before it is given up (nats): soft values need not be surer than that. Lower:
/// faster, and bits on which all sets agree lose their soft values.
const LIST_MARGIN: f32 = 24.0;

/// The inverse variance of a fair bit.
const PRECISION: f32 = 4.0;
/// LEDs per look-up of a row's sum.
const AT_ONCE: usize = 4;

/// The result of the decoder: the cheapest sets of flips, best first.
pub(super) struct Candidates {
    sets: [FlipSet; 2 * LIST_SETS],
    count: usize,
}

impl Candidates {
    pub fn as_mut_slice(&mut self) -> &mut [FlipSet] {
        &mut self.sets[..self.count]
    }

    /// The log odds against each LED's flip: of all sets without it against all sets with it; `None` for LEDs on which all sets agree.
    pub fn log_odds(&self) -> [Option<f32>; LEDS] {
        let sets = &self.sets[..self.count];
        let best = sets.iter().map(|set| set.gain).fold(f32::NEG_INFINITY, f32::max);
        let (mut flipped, mut kept) = ([0.0f32; LEDS], [0.0f32; LEDS]);
        for set in sets {
            let weight = libm::expf(set.gain - best);
            for (led, (flipped, kept)) in flipped.iter_mut().zip(&mut kept).enumerate() {
                let flips = set.flips >> led & 1 == 1;
                *(if flips { flipped } else { kept }) += weight;
            }
        }
        core::array::from_fn(|led| (flipped[led] > 0.0 && kept[led] > 0.0).then(|| libm::logf(kept[led] / flipped[led])))
    }
}

/// The `list_sets` cheapest sets of flips, at most [`LIST_SETS`]; `None` if the form has no minimum. The gains are overwritten.
pub(super) fn candidates(flip_gains: &mut FlipGains, list_sets: usize) -> Option<Candidates> {
    let list_sets = list_sets.clamp(1, LIST_SETS);
    let target = factorise(flip_gains)?;
    let rows = &flip_gains.pair;
    let nothing: f32 = target.iter().map(|t| 0.5 * t * t).sum();
    let mut sets = [FlipSet::default(); 2 * LIST_SETS];
    let mut count = 1;
    sets[0].gain = nothing;
    for led in (0..LEDS).rev() {
        let (row, target) = (&rows[led], target[led]);
        let sums = sums_by_part(row, led);
        for at in 0..count {
            let set = sets[at];
            let rest = sum_of(&sums, set.flips, led) - target;
            let flipped = rest + row[led];
            sets[at].gain -= 0.5 * rest * rest;
            sets[count + at] = FlipSet {
                flips: set.flips | 1 << led,
                gain: set.gain - 0.5 * flipped * flipped,
            };
        }
        count *= 2;
        if count > list_sets {
            sets[..count].select_nth_unstable_by(list_sets, |a, b| b.gain.total_cmp(&a.gain));
            count = list_sets;
        }
        // Drops sets that cost more than no flips by the margin.
        let mut kept = 0;
        for at in 0..count {
            if sets[at].gain > -LIST_MARGIN {
                sets[kept] = sets[at];
                kept += 1;
            }
        }
        count = kept;
        if count == 0 {
            return None;
        }
    }
    FlipSet::sort(&mut sets[..count]);
    Some(Candidates { sets, count })
}

/// Replaces the upper triangle of the pairs by R (Cholesky), and returns Rᵀ⁻¹g for the slopes g.
fn factorise(FlipGains { slope, pair }: &mut FlipGains) -> Option<[f32; LEDS]> {
    let mut target = slope.map(|slope| slope + 0.5 * PRECISION);
    for row in 0..LEDS {
        let (above, rest) = pair.split_at_mut(row);
        let this = &mut rest[0];
        this[row..].iter_mut().for_each(|pair| *pair = -*pair);
        this[row] += PRECISION;
        let mut explained = 0.0;
        for (above, target) in above.iter().zip(&target) {
            let factor = above[row];
            explained += factor * target;
            for (to, from) in this[row..].iter_mut().zip(&above[row..]) {
                *to -= factor * from;
            }
        }
        if this[row] <= 0.0 || this[row].is_nan() {
            return None;
        }
        let scale = 1.0 / libm::sqrtf(this[row]);
        this[row..].iter_mut().for_each(|to| *to *= scale);
        target[row] = (target[row] - explained) * scale;
    }
    Some(target)
}

/// For every four LEDs, the sum of each subset of them.
type Sums = [[f32; 1 << AT_ONCE]; LEDS / AT_ONCE];

/// For each part of a row from `led + 1` on, the sums of the entries of all subsets of LEDs.
fn sums_by_part(row: &[f32; LEDS], led: usize) -> Sums {
    let mut sums = [[0.0; 1 << AT_ONCE]; LEDS / AT_ONCE];
    for part in (led + 1) / AT_ONCE..LEDS / AT_ONCE {
        let entries = &row[part * AT_ONCE..][..AT_ONCE];
        for set in 1..1usize << AT_ONCE {
            let lowest = set.trailing_zeros() as usize;
            sums[part][set] = sums[part][set & (set - 1)] + entries[lowest];
        }
    }
    sums
}

/// A row's sum over the LEDs in `flips`, all of which follow `led`.
fn sum_of(sums: &Sums, flips: u64, led: usize) -> f32 {
    let first = (led + 1) / AT_ONCE;
    (first..LEDS / AT_ONCE)
        .map(|part| sums[part][(flips >> (part * AT_ONCE)) as usize & ((1 << AT_ONCE) - 1)])
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;
    use std::boxed::Box;

    /// LEDs whose flips may gain.
    const DOUBTFUL: usize = 10;

    /// A form in which `mixing` couples the doubtful LEDs, and the others must not flip.
    fn form(mixing: &[[f32; DOUBTFUL]; DOUBTFUL], slope: &[f32; DOUBTFUL]) -> Box<FlipGains> {
        let mut flip_gains = Box::new(FlipGains::new());
        for led in 0..LEDS {
            flip_gains.slope[led] = slope.get(led).copied().unwrap_or(-100.0);
            flip_gains.pair[led][led] = -1.0;
        }
        for (a, one) in mixing.iter().enumerate() {
            for (b, other) in mixing.iter().enumerate() {
                flip_gains.pair[a][b] -= one.iter().zip(other).map(|(x, y)| x * y).sum::<f32>();
            }
        }
        flip_gains
    }

    fn gain(flip_gains: &FlipGains, flips: u64) -> f32 {
        let flipped = || (0..LEDS).filter(move |led| flips >> led & 1 == 1);
        flipped()
            .map(|a| {
                let pairs: f32 = flipped().map(|b| flip_gains.pair[a][b]).sum();
                flip_gains.slope[a] + 0.5 * pairs
            })
            .sum()
    }

    properties! {
        #[test]
        fn the_cheapest_way_of_all_is_found(
            mixing in prop::array::uniform10(prop::array::uniform10(-3.0f32..3.0)), slope in prop::array::uniform10(-10.0f32..10.0),
        ) {
            let flip_gains = form(&mixing, &slope);
            let most = (0..1 << DOUBTFUL).map(|flips| gain(&flip_gains, flips)).fold(f32::NEG_INFINITY, f32::max);
            let mut sets = candidates(&mut form(&mixing, &slope), LIST_SETS).unwrap();
            let best = sets.as_mut_slice()[0];
            prop_assert!((best.gain - gain(&flip_gains, best.flips)).abs() < 1e-2, "{best:?}");
            prop_assert!((best.gain - most).abs() < 1e-2, "{} of {most}", best.gain);
        }
    }
}
