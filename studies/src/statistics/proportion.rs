//! The 95 % interval of an error rate: one rule for all counts, zero included.
//!
//! The unit is the random sample: a frame with its share of wrong bits, a film that arrived or not. Bits of a frame share phase,
//! reflectance and noise level and are wrong together, with an unknown correlation. For the upper end, one unit as bad as the worst is
//! added to the sample; for the lower end, one without error. Each end is a 2.5 % quantile of the rate if the units are weighted at random,
//! uniformly among all weights that sum to 1 (Gaffke 2005; Learned-Miller & Thomas 2019). The upper end is at least 1 − 0.025^(1/n), about
//! 3.7/n, which is that of n units without any error. So
//!
//! - more errors never lower an end, and zero is a count like any other;
//! - for units that are wholly right or wholly wrong, the interval is that of Clopper & Pearson 1934;
//! - few errors have a wide upper end, because only many units can exclude that one in a thousand fails wholly.

/// The probability outside an interval on either side.
const TAIL: f64 = 0.025;
/// The normal deviate with that probability above it.
const Z: f64 = 1.959_964;
/// Halvings of an interval: down to rounding.
const HALVINGS: usize = 64;

/// The 95 % interval of the mean wrong share of units, from (wrong share of a unit, number of such units). Without units 0 to 1.
///
/// ```
/// use studies::statistics::mean_95;
/// // 300 frames, none wrong; then three of them with one bit wrong of 64; then three wholly.
/// let [low, none] = mean_95(&[(0.0, 300.0)]);
/// assert!(low == 0.0 && (none * 300.0 - 3.7).abs() < 0.05);
/// let [low, few] = mean_95(&[(0.0, 297.0), (1.0 / 64.0, 3.0)]);
/// assert!(low > 0.0 && few == none);
/// assert!(mean_95(&[(0.0, 297.0), (1.0, 3.0)])[1] > 2.0 * none);
/// ```
pub fn mean_95(units: &[(f64, f64)]) -> [f64; 2] {
    let count: f64 = units.iter().map(|(_, count)| count).sum();
    if count <= 0.0 {
        return [0.0, 1.0];
    }
    let seen = units.iter().filter(|&&(_, count)| count > 0.0);
    let worst = seen.map(|&(share, _)| share).fold(0.0, f64::max);
    let none = 1.0 - TAIL.powf(1.0 / count);
    if worst == 0.0 {
        return [0.0, none];
    }
    let turned: Vec<(f64, f64)> = units.iter().map(|&(share, count)| (1.0 - share, count)).collect();
    [1.0 - upper(&turned, 1.0), upper(units, worst).max(none)]
}

/// The 95 % interval of a share: `wrong` of `count` units, each wholly right or wrong.
pub fn share_95(wrong: f64, count: f64) -> [f64; 2] {
    mean_95(&[(0.0, count - wrong), (1.0, wrong)])
}

/// The 97.5 % quantile of the mean over random weights of the units and of one more.
fn upper(units: &[(f64, f64)], one_more: f64) -> f64 {
    let seen = units.iter().copied().filter(|&(_, count)| count > 0.0);
    let units: Vec<(f64, f64)> = seen.chain([(one_more, 1.0)]).collect();
    let count: f64 = units.iter().map(|(_, count)| count).sum();
    let mean = units.iter().map(|(share, count)| share * count).sum::<f64>() / count;
    let worst = units.iter().map(|&(share, _)| share).fold(0.0, f64::max);
    if units.iter().all(|&(share, _)| share == worst) {
        return worst;
    }
    halved([mean, worst], |rate| deviations(&units, rate, worst) < Z)
}

/// The distance, in normal deviations, of `rate`, which is between the mean of the units and their greatest, above the mean under random
/// weights. Weights of n units are exponential over their sum, so that this asks whether Σ Gamma(nᵢ)·(shareᵢ − rate) is negative
/// (saddlepoint approximation of Lugannani & Rice 1980 in the form of Barndorff-Nielsen 1991; within 2.5 %).
fn deviations(units: &[(f64, f64)], rate: f64, worst: f64) -> f64 {
    let of = |value: fn(f64, f64) -> f64, at: f64| -> f64 {
        let each = units.iter().map(|&(share, count)| count * value(share - rate, at));
        each.sum()
    };
    let slope = |at| of(|over, at| over / (1.0 - at * over), at);
    let saddle = halved([0.0, 1.0 / (worst - rate)], |at| slope(at) < 0.0);
    let height = of(|over, at| (-at * over).ln_1p(), saddle);
    let curvature = of(|over, at| (over / (1.0 - at * over)).powi(2), saddle);
    let (root, slope) = ((2.0 * height).max(0.0).sqrt(), saddle * curvature.sqrt());
    if root > 0.0 && slope > 0.0 {
        root + (slope / root).ln() / root
    } else {
        0.0
    }
}

/// The point at which a condition that holds at the low end of a range ceases to hold.
fn halved([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        *if holds(middle) { &mut low } else { &mut high } = middle;
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_distr::{Beta, Binomial, Distribution};
    use sim::random::{Purpose, stream};

    #[test]
    fn whole_units_have_the_interval_of_clopper_and_pearson() {
        // By the quantiles of Beta distributions.
        for (wrong, count, low, high) in [
            (0.0, 100.0, 0.0, 0.036_217),
            (1.0, 100.0, 0.000_253, 0.054_459),
            (10.0, 100.0, 0.049_005, 0.176_223),
            (50.0, 100.0, 0.398_321, 0.601_679),
            (0.0, 100_000.0, 0.0, 3.688_8e-5),
            (20.0, 100_000.0, 1.221_7e-4, 3.088_8e-4),
            (100.0, 100.0, 0.963_783, 1.0),
        ] {
            let [found_low, found_high] = share_95(wrong, count);
            let near = |found: f64, exact: f64| (found - exact).abs() <= 0.025 * exact.min(1.0 - exact);
            assert!(
                near(found_low, low) && near(found_high, high),
                "{wrong} of {count}: {found_low} to {found_high}"
            );
        }
        assert_eq!(share_95(0.0, 0.0), [0.0, 1.0]);
    }

    /// For many samples: one more wrong bit, in a frame that was right or in one that was wrong.
    #[test]
    fn one_more_error_never_lowers_an_end() {
        let random = &mut stream(1, 0, Purpose::Resampling);
        for frames in [1usize, 30, 1000] {
            let mut wrong = vec![0u32; frames];
            let interval = |wrong: &[u32]| {
                let units: Vec<(f64, f64)> = wrong.iter().map(|&bits| (f64::from(bits) / 64.0, 1.0)).collect();
                mean_95(&units)
            };
            let mut last = interval(&wrong);
            for _ in 0..60 {
                // Most errors are in few frames.
                let frame = (frames as f64 * random.random::<f64>().powi(8)) as usize;
                wrong[frame] = (wrong[frame] + 1).min(64);
                let next = interval(&wrong);
                assert!(
                    next[0] >= last[0] - 1e-12 && next[1] >= last[1] - 1e-12,
                    "{last:?} {next:?} {wrong:?}"
                );
                last = next;
            }
        }
    }

    /// The number of 400 runs whose interval holds the rate, for frames of 64 bits with a correlation (beta-binomial; at 1 wholly right or
    /// wrong).
    fn held(frames: u32, rate: f64, correlation: f64) -> u32 {
        let random = &mut stream((1e3 * correlation) as u64, u64::from(frames), Purpose::Resampling);
        let of_both = 1.0 / correlation - 1.0;
        let spread = (0.0 < correlation && correlation < 1.0).then(|| Beta::new(rate * of_both, (1.0 - rate) * of_both).unwrap());
        let mut holds = || {
            let mut wrong = [0u32; 65];
            for _ in 0..frames {
                let own = spread.map_or(rate, |spread| spread.sample(random).min(1.0));
                let bits = match correlation {
                    1.0 => 64 * u64::from(random.random_bool(own)),
                    _ => Binomial::new(64, own).unwrap().sample(random),
                };
                wrong[bits as usize] += 1;
            }
            let units: Vec<(f64, f64)> = wrong
                .iter()
                .zip(0..)
                .map(|(&n, bits)| (f64::from(bits) / 64.0, f64::from(n)))
                .collect();
            let [low, high] = mean_95(&units);
            u32::from((low..=high).contains(&rate))
        };
        (0..400).map(|_| holds()).sum()
    }

    #[test]
    fn intervals_hold_the_rate_whatever_the_correlation_within_a_frame() {
        for correlation in [0.0, 0.01, 0.1, 0.5, 1.0] {
            for errors in [0.5, 2.0, 10.0, 50.0] {
                // That many wrong frames, or the same number of wrong bits.
                let held = held(300, errors / 300.0, correlation);
                // 95 % minus three deviations of 400.
                assert!(held >= 367, "{held} of 400: correlation {correlation}, {errors} of 300 frames");
            }
        }
        // They are not too wide if errors are many.
        for correlation in [0.0, 0.1, 1.0] {
            assert!(
                (367..=396).contains(&held(300, 0.3, correlation)),
                "{correlation}: {}",
                held(300, 0.3, correlation)
            );
        }
    }
}
