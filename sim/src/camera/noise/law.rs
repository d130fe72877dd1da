//! The distribution of grey levels: Poisson electrons and normal read noise, compared with thresholds.

use libm::erfc;

/// Expected electrons from which on the Edgeworth series replaces the sum over electrons.
const MANY: f64 = 200.0;
/// Smaller tails are left out.
const NEGLIGIBLE: f64 = 1e-13;
/// A normal number exceeds this many standard deviations with less than the negligible probability.
const FAR: f64 = 7.5;

/// Probabilities of consecutive levels, without negligible ones at both ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// The first level.
    pub first: usize,
    /// The probability of each level from there on.
    pub probabilities: Vec<f64>,
}

/// The distribution of levels between ascending thresholds, in electrons, for Poisson electrons with normal read noise.
#[derive(Clone, Debug)]
pub struct Law {
    thresholds_e: Vec<f64>,
    read_noise_e: f64,
}

impl Law {
    /// For levels with these ascending thresholds.
    pub fn new(thresholds_e: Vec<f64>, read_noise_e: f64) -> Self {
        Self {
            thresholds_e,
            read_noise_e,
        }
    }

    /// The probabilities of all levels, one more than there are thresholds, by the sum over electrons.
    pub fn exact(&self, expected_e: f64) -> Vec<f64> {
        let mut law = vec![0.0; self.thresholds_e.len() + 1];
        poisson(expected_e, |electrons, weight| {
            let given = self.of_electrons(electrons as f64);
            for (p, q) in law[given.first..].iter_mut().zip(&given.probabilities) {
                *p += weight * q;
            }
        });
        law
    }

    /// The level of a pixel, given its electrons.
    pub fn of_electrons(&self, electrons: f64) -> Band {
        let reach = FAR * self.read_noise_e;
        let [first, last] = [-reach, reach].map(|r| self.thresholds_e.partition_point(|&t| t <= electrons + r));
        let below = self.thresholds_e[first..last]
            .iter()
            .map(|threshold| 0.5 * erfc((electrons - threshold) / self.read_noise_e * std::f64::consts::FRAC_1_SQRT_2));
        Band {
            first,
            probabilities: differences(below),
        }
    }
}

/// Distributions for many expectations, faster than one by one.
///
/// Up to 200 expected electrons they are sums over electrons, with a cache of each electron number's levels. Beyond, they are the Edgeworth
/// series to the order 1/variance (Kolassa 2006, section 3.6). Its error in the probability of being below a threshold is less than 2·10⁻⁵
/// there.
#[derive(Clone, Debug)]
pub struct ManyLaws {
    law: Law,
    of_electrons: Vec<Band>,
    /// For each threshold, the arguments of the series, each with its weight.
    places: Vec<Vec<(f64, f64)>>,
    /// Addition to the variance of the Poisson part.
    extra_variance: f64,
    sum: Vec<f64>,
}

impl ManyLaws {
    /// For the levels of `law`.
    pub fn new(law: Law) -> Self {
        let most = poisson_range(MANY).end;
        let sigma = law.read_noise_e;
        let smooth = sigma >= 1.0;
        let places = law.thresholds_e.iter().map(|&threshold| {
            if smooth {
                vec![(threshold, 1.0)]
            } else {
                half_integers(threshold, sigma)
            }
        });
        Self {
            of_electrons: (0..most).map(|n| law.of_electrons(n as f64)).collect(),
            places: places.collect(),
            // A smooth distribution with the same integrals over unit intervals has less variance than the discrete one (Sheppard's
            // correction).
            extra_variance: if smooth { sigma * sigma } else { -1.0 / 12.0 },
            sum: vec![0.0; law.thresholds_e.len() + 1],
            law,
        }
    }

    /// The distribution for `expected_e` electrons.
    pub fn of(&mut self, expected_e: f64) -> Band {
        if expected_e <= MANY {
            self.by_electrons(expected_e)
        } else {
            self.by_series(expected_e)
        }
    }

    fn by_electrons(&mut self, expected_e: f64) -> Band {
        self.sum.fill(0.0);
        poisson(expected_e, |electrons, weight| {
            let given = &self.of_electrons[electrons];
            for (p, q) in self.sum[given.first..].iter_mut().zip(&given.probabilities) {
                *p += weight * q;
            }
        });
        let heavy = |p: &f64| *p > NEGLIGIBLE;
        let first = self.sum.iter().position(heavy).unwrap_or(0);
        let last = self.sum.iter().rposition(heavy).unwrap_or(0);
        Band {
            first,
            probabilities: self.sum[first..=last].to_vec(),
        }
    }

    fn by_series(&self, expected_e: f64) -> Band {
        let series = Edgeworth::new(expected_e, self.extra_variance);
        let reach = FAR * series.deviation + FAR * self.law.read_noise_e.min(1.0) + 1.0;
        let [first, last] = [-reach, reach].map(|r| {
            let end = expected_e + r;
            self.law.thresholds_e.partition_point(|&t| t <= end)
        });
        let below = self.places[first..last]
            .iter()
            .map(|places| places.iter().map(|&(place, weight)| weight * series.below(place)).sum());
        Band {
            first,
            probabilities: differences(below),
        }
    }
}

/// The half-integers at which to evaluate a Poisson distribution, and their weights, for the probability that its number with normal noise
/// added is below a threshold: Σₙ p(n)·Φ((t − n)/σ) summed by parts.
fn half_integers(threshold: f64, sigma: f64) -> Vec<(f64, f64)> {
    if sigma == 0.0 {
        return vec![(threshold.ceil() - 0.5, 1.0)];
    }
    let above = |n: f64| 0.5 * erfc((n - threshold) / sigma * std::f64::consts::FRAC_1_SQRT_2);
    let (from, to) = (
        (threshold - FAR * sigma).floor() as i64 - 1,
        (threshold + FAR * sigma).ceil() as i64,
    );
    (from..=to)
        .map(|n| (n as f64, above(n as f64) - above(n as f64 + 1.0)))
        .filter(|&(_, weight)| weight > NEGLIGIBLE)
        .map(|(n, weight)| (n + 0.5, weight))
        .collect()
}

/// A distribution whose cumulants beyond the second are those of a Poisson number.
struct Edgeworth {
    mean: f64,
    deviation: f64,
    skewness: f64,
    kurtosis: f64,
}

impl Edgeworth {
    fn new(expected: f64, extra_variance: f64) -> Self {
        let deviation = (expected + extra_variance).sqrt();
        Self {
            mean: expected,
            deviation,
            skewness: expected / deviation.powi(3),
            kurtosis: expected / deviation.powi(4),
        }
    }

    /// The probability of being below `place`.
    fn below(&self, place: f64) -> f64 {
        let z = (place - self.mean) / self.deviation;
        let z2 = z * z;
        let he2 = z2 - 1.0;
        let he3 = z * (z2 - 3.0);
        let he5 = z * (z2 * (z2 - 10.0) + 15.0);
        let density = (-0.5 * z2).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let series = self.skewness / 6.0 * he2 + self.kurtosis / 24.0 * he3 + self.skewness.powi(2) / 72.0 * he5;
        (0.5 * erfc(-z * std::f64::consts::FRAC_1_SQRT_2) - density * series).clamp(0.0, 1.0)
    }
}

/// The probabilities between ascending cumulative ones, from 0 and to 1.
fn differences(below: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last = 0.0;
    let mut probabilities: Vec<f64> = below
        .map(|up_to| {
            let p = (up_to - last).max(0.0);
            last = up_to.max(last);
            p
        })
        .collect();
    probabilities.push(1.0 - last);
    probabilities
}

/// The range of a Poisson distribution with that expectation, without negligible tails.
fn poisson_range(expected: f64) -> std::ops::Range<usize> {
    let reach = 8.0 * expected.sqrt();
    (expected - reach).max(0.0) as usize..(expected + reach + 20.0) as usize
}

/// Calls `tell` with each number of a Poisson distribution and its probability.
fn poisson(expected: f64, mut tell: impl FnMut(usize, f64)) {
    let range = poisson_range(expected);
    let n = range.start as f64;
    let mut weight = if n == 0.0 {
        (-expected).exp()
    } else {
        (n * expected.ln() - expected - libm::lgamma(n + 1.0)).exp()
    };
    for electrons in range {
        tell(electrons, weight);
        weight *= expected / (electrons as f64 + 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_agrees_with_the_sum() {
        for sigma in [0.0, 0.1, 0.6, 0.99, 1.0, 3.0, 40.0] {
            let thresholds: Vec<f64> = (0..40).map(|k| 100.3 + 11.7 * f64::from(k)).collect();
            let law = Law::new(thresholds, sigma);
            let mut many = ManyLaws::new(law.clone());
            for expected in [MANY * 1.001, 237.4, 320.0] {
                let band = many.of(expected);
                let mut apart = 0.0;
                for (level, exact) in law.exact(expected).iter().enumerate() {
                    let near = level.checked_sub(band.first).and_then(|k| band.probabilities.get(k));
                    apart += exact - near.unwrap_or(&0.0);
                    assert!(apart.abs() < 2e-5, "σ {sigma}, {expected} e, below level {level}: off by {apart}");
                }
            }
        }
    }

    #[test]
    fn few_electrons_are_summed_over() {
        let law = Law::new(vec![0.5, 1.5, 2.5], 0.0);
        let band = ManyLaws::new(law).of(1.0);
        let e = std::f64::consts::E;
        for (p, exact) in band.probabilities.iter().zip([1.0 / e, 1.0 / e, 0.5 / e, 1.0 - 2.5 / e]) {
            assert!((p - exact).abs() < 1e-12, "{p} for {exact}");
        }
    }
}
