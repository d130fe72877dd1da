//! Statistics that take one value at a time, merge, and stay exact: memory does not grow with the number of frames.

use rand::Rng;
use rand_distr::{Binomial, Distribution};
use serde::{Deserialize, Serialize};

use sim::random::{Purpose, stream};

/// Count, mean and scatter of pairs of numbers, each at most 10¹⁵⁰ in size, so that squares are finite.
///
/// Values are taken relative to the first one, so that a large common offset does not eat the digits, by Welford's updates;
/// two such sums merge by Chan's formula (Chan, Golub & LeVeque 1983).
///
/// ```
/// use studies::statistics::Moments;
/// let mut moments = Moments::default();
/// [[1.0, 10.0], [3.0, 30.0]].into_iter().for_each(|x| moments.push(x));
/// assert_eq!(moments.mean(), [2.0, 20.0]);
/// assert_eq!(moments.covariance(), [[1.0, 10.0], [10.0, 100.0]]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenMoments")]
pub struct Moments {
    count: u64,
    first: [f64; 2],
    /// Mean less `first`.
    mean: [f64; 2],
    /// Sums of squares and products about the mean: xx, xy, yy.
    scatter: [f64; 3],
}

/// As a file has them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenMoments {
    count: u64,
    first: [f64; 2],
    mean: [f64; 2],
    scatter: [f64; 3],
}

/// Moments of no pairs that can be.
#[derive(Debug, thiserror::Error)]
#[error(
    "{} pairs that begin with {:?}, with a mean {:?} from there and a scatter of {:?}: at most {MOST_PAIRS} pairs of numbers up to {MOST_SIZE:e} in size are counted, whose squares sum to no less than 0; the file is damaged",
    .0.count, .0.first, .0.mean, .0.scatter
)]
struct ImpossibleMoments(WrittenMoments);

/// The most pairs that a file may speak of: one for each LED of each frame.
const MOST_PAIRS: u64 = 64 * MOST_FRAMES;
/// The largest number, by size.
const MOST_SIZE: f64 = 1e150;

impl TryFrom<WrittenMoments> for Moments {
    type Error = ImpossibleMoments;

    fn try_from(written: WrittenMoments) -> Result<Self, ImpossibleMoments> {
        let WrittenMoments {
            count,
            first,
            mean,
            scatter,
        } = written;
        // Two numbers are at most twice their size apart; leave a little to rounding.
        let most_apart = 2.001 * MOST_SIZE;
        let most_scatter = count as f64 * most_apart.powi(2);
        let is_possible = count <= MOST_PAIRS
            && first.iter().all(|first| first.abs() <= MOST_SIZE)
            && mean.iter().all(|mean| mean.abs() <= most_apart)
            && scatter.iter().all(|scatter| scatter.abs() <= most_scatter)
            && scatter[0] >= 0.0
            && scatter[2] >= 0.0;
        if !is_possible {
            return Err(ImpossibleMoments(written));
        }
        Ok(Self {
            count,
            first,
            mean,
            scatter,
        })
    }
}

impl Moments {
    /// Those of a few pairs at once, in two passes: first the mean, then what is left about it.
    pub fn of(values: &[[f64; 2]]) -> Self {
        let Some(&first) = values.first() else {
            return Self::default();
        };
        let from_first = values.iter().map(|v| [v[0] - first[0], v[1] - first[1]]);
        let share = 1.0 / values.len() as f64;
        let sum = from_first
            .clone()
            .fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
        let mean = sum.map(|sum| sum * share);
        let scatter = from_first.fold([0.0; 3], |scatter, x| {
            let [a, b] = [x[0] - mean[0], x[1] - mean[1]];
            [scatter[0] + a * a, scatter[1] + a * b, scatter[2] + b * b]
        });
        Self {
            count: values.len() as u64,
            first,
            mean,
            scatter,
        }
    }

    /// Takes one pair.
    pub fn push(&mut self, value: [f64; 2]) {
        if self.count == 0 {
            self.first = value;
        }
        self.count += 1;
        let x = [value[0] - self.first[0], value[1] - self.first[1]];
        let before = [x[0] - self.mean[0], x[1] - self.mean[1]];
        let share = 1.0 / self.count as f64;
        self.mean = [
            self.mean[0] + before[0] * share,
            self.mean[1] + before[1] * share,
        ];
        let after = [x[0] - self.mean[0], x[1] - self.mean[1]];
        self.scatter[0] += before[0] * after[0];
        self.scatter[1] += before[0] * after[1];
        self.scatter[2] += before[1] * after[1];
    }

    /// Takes all that `other` has taken.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let (own, others) = (self.count as f64, other.count as f64);
        let total = own + others;
        let apart =
            [0, 1].map(|i| (other.first[i] - self.first[i]) + (other.mean[i] - self.mean[i]));
        let weight = own * others / total;
        let products = [
            apart[0] * apart[0],
            apart[0] * apart[1],
            apart[1] * apart[1],
        ];
        for ((scatter, others), product) in self.scatter.iter_mut().zip(other.scatter).zip(products)
        {
            *scatter += others + product * weight;
        }
        self.mean = [0, 1].map(|i| self.mean[i] + apart[i] * others / total);
        self.count += other.count;
    }

    /// How many pairs were taken.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; zeros of none.
    pub fn mean(&self) -> [f64; 2] {
        [self.first[0] + self.mean[0], self.first[1] + self.mean[1]]
    }

    /// Their covariance (over n); zeros of none.
    pub fn covariance(&self) -> [[f64; 2]; 2] {
        let [xx, xy, yy] = self.scatter.map(|s| s / (self.count.max(1)) as f64);
        [[xx, xy], [xy, yy]]
    }
}

/// Between- and within-class variances of the features of On and Off LEDs (Do & Yoo 2020, Eqs. 5 to 7).
///
/// Both variances are 0 where a class is empty; the ratios are then undefined, as they are where nothing varies. No number here is
/// infinite or NaN.
///
/// ```
/// use studies::statistics::{Distinguishability, Moments};
/// let on = Moments::of(&[[1.2, 30.0], [1.4, 40.0]]);
/// let off = Moments::of(&[[0.8, 10.0], [0.6, 20.0]]);
/// let variances = Distinguishability::of(&on, &off);
/// assert!((variances.wvar - 50.02).abs() < 1e-12);
/// assert!(variances.b2w.is_some_and(|b2w| (b2w - 400.36 / 50.02).abs() < 1e-12));
/// assert_eq!(Distinguishability::of(&on, &Moments::default()).b2w, None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distinguishability {
    /// |μ_on − μ_off|².
    pub bvar: f64,
    /// E|x_on − μ_on|² + E|x_off − μ_off|².
    pub wvar: f64,
    /// Their ratio; none where a class is empty or neither varies.
    pub b2w: Option<f64>,
    /// Fisher's criterion, (μ_on − μ_off)ᵀ·(Σ_on + Σ_off)⁻¹·(μ_on − μ_off): the largest such ratio of any linear combination of
    /// the features, whatever their scales (Fisher 1936). None where a class is empty, a feature tells the classes apart and never
    /// varies within them, or the features always vary together ([`COLLINEAR`]).
    pub fisher: Option<f64>,
}

/// Features are taken to vary together always where 1 − ρ² of their correlation ρ is below this: with fewer digits left, Fisher's
/// criterion would be rounding. Above it is right to 10⁻⁶ of itself.
pub const COLLINEAR: f64 = 1e-9;

impl Distinguishability {
    /// Of the two classes' moments.
    pub fn of(on: &Moments, off: &Moments) -> Self {
        if on.count == 0 || off.count == 0 {
            return Self::default();
        }
        let apart = [0, 1].map(|i| (on.first[i] - off.first[i]) + (on.mean[i] - off.mean[i]));
        let (on, off) = (on.covariance(), off.covariance());
        let within = |i: usize, j: usize| on[i][j] + off[i][j];
        let bvar = apart[0].powi(2) + apart[1].powi(2);
        let wvar = within(0, 0) + within(1, 1);
        Self {
            bvar,
            wvar,
            b2w: Some(bvar / wvar).filter(|ratio| ratio.is_finite()),
            fisher: fisher(apart, within(0, 0), within(0, 1), within(1, 1)),
        }
    }
}

/// Fisher's criterion of means that are `apart`, under a covariance: by each feature over its own deviation, so that neither their
/// scales nor a determinant of nearly equal products takes digits.
fn fisher([x, y]: [f64; 2], xx: f64, xy: f64, yy: f64) -> Option<f64> {
    let of_one = |apart: f64, variance: f64| apart * (apart / variance);
    let criterion = match (xx > 0.0, yy > 0.0) {
        (true, true) => {
            let (x, y) = (x / xx.sqrt(), y / yy.sqrt());
            let correlation = xy / xx.sqrt() / yy.sqrt();
            let rest = (1.0 - correlation) * (1.0 + correlation);
            (rest >= COLLINEAR).then(|| y * y + (x - correlation * y).powi(2) / rest)
        }
        (true, false) if y == 0.0 => Some(of_one(x, xx)),
        (false, true) if x == 0.0 => Some(of_one(y, yy)),
        _ => None,
    };
    criterion.filter(|ratio| ratio.is_finite())
}

/// Bit errors by frame: how many frames had 0, 1, … 64 of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<u64>", into = "Vec<u64>")]
pub struct FrameErrors([u64; 65]);

impl Default for FrameErrors {
    fn default() -> Self {
        Self([0; 65])
    }
}

impl From<FrameErrors> for Vec<u64> {
    /// Without the zeros at the end.
    fn from(errors: FrameErrors) -> Self {
        let used = errors.0.iter().rposition(|&frames| frames > 0);
        errors.0[..used.map_or(0, |last| last + 1)].to_vec()
    }
}

impl TryFrom<Vec<u64>> for FrameErrors {
    type Error = String;

    fn try_from(counts: Vec<u64>) -> Result<Self, String> {
        let mut errors = Self::default();
        let place = errors.0.get_mut(..counts.len()).ok_or_else(|| {
            format!(
                "{} counts of bit errors where a frame has at most 64: the file is damaged",
                counts.len()
            )
        })?;
        place.copy_from_slice(&counts);
        let sum = counts.iter().try_fold(0u64, |sum, &n| sum.checked_add(n));
        if sum.is_none_or(|frames| frames > MOST_FRAMES) {
            return Err(format!(
                "more than {MOST_FRAMES} frames are counted: the file is damaged"
            ));
        }
        Ok(errors)
    }
}

/// The most frames that a file may speak of: no sum of them overflows.
pub(crate) const MOST_FRAMES: u64 = 1 << 48;
/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

impl FrameErrors {
    /// Takes a frame with so many bit errors (more than 64 count as 64).
    pub fn push(&mut self, errors: u32) {
        self.0[(errors as usize).min(64)] += 1;
    }

    /// Takes all frames of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.0
            .iter_mut()
            .zip(other.0)
            .for_each(|(own, others)| *own += others);
    }

    /// Frames taken.
    pub fn frames(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Bits of those frames.
    pub fn bits(&self) -> u64 {
        64 * self.frames()
    }

    /// Bit errors in all.
    pub fn errors(&self) -> u64 {
        self.0
            .iter()
            .zip(0..)
            .map(|(frames, errors)| frames * errors)
            .sum()
    }

    /// Bit error rate; 0 of no frames.
    pub fn rate(&self) -> f64 {
        self.errors() as f64 / self.bits().max(1) as f64
    }

    /// The 95 % interval of the bit error rate.
    ///
    /// The bits of a frame share phase, reflectance and noise level, so whole frames are resampled (percentiles of the cluster
    /// bootstrap). Where no error was seen the upper end is 3/frames, the 95 % bound of the frame error rate, which the bit
    /// error rate cannot exceed. Without frames nothing is known: 0 to 1.
    pub fn interval_95(&self) -> [f64; 2] {
        let frames = self.frames();
        if frames == 0 {
            return [0.0, 1.0];
        }
        if self.errors() == 0 {
            return [0.0, (3.0 / frames as f64).min(1.0)];
        }
        let mut random = stream(0, frames, Purpose::Resampling);
        let mut rates: Vec<f64> = (0..RESAMPLES)
            .map(|_| self.resampled_rate(&mut random))
            .collect();
        rates.sort_by(f64::total_cmp);
        [rates[RESAMPLES / 40], rates[RESAMPLES - 1 - RESAMPLES / 40]]
    }

    /// The rate of as many frames drawn from these with replacement: a multinomial draw, one binomial a bin.
    fn resampled_rate(&self, random: &mut impl Rng) -> f64 {
        let frames = self.frames();
        let (mut left_to_draw, mut left_in_bins, mut errors) = (frames, frames, 0);
        for (&count, of_each) in self.0.iter().zip(0..).filter(|(count, _)| **count > 0) {
            let share = count as f64 / left_in_bins as f64;
            let drawn = Binomial::new(left_to_draw, share.min(1.0))
                .map_or(left_to_draw, |b| b.sample(random));
            errors += drawn * of_each;
            left_to_draw -= drawn;
            left_in_bins -= count;
        }
        errors as f64 / (64 * frames) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_large_offset_does_no_harm_though_the_naive_sum_fails() {
        let mut random = stream(3, 0, Purpose::Phase);
        let values: Vec<f64> = (0..10_000)
            .map(|_| 1e12 + sim::random::uniform(&mut random))
            .collect();
        let n = values.len() as f64;
        let exact_mean = values.iter().map(|v| v - 1e12).sum::<f64>() / n;
        let exact = values
            .iter()
            .map(|v| (v - 1e12 - exact_mean).powi(2))
            .sum::<f64>()
            / n;
        let naive = values.iter().map(|v| v * v).sum::<f64>() / n
            - (values.iter().sum::<f64>() / n).powi(2);
        assert!(
            (naive - exact).abs() > exact,
            "the naive formula must fail here, or this test shows nothing"
        );
        let mut moments = Moments::default();
        values.iter().for_each(|&v| moments.push([v, -v]));
        let [[xx, xy], [_, yy]] = moments.covariance();
        for (got, want) in [(xx, exact), (xy, -exact), (yy, exact)] {
            assert!((got / want - 1.0).abs() < 1e-12, "{got} against {want}");
        }
    }

    #[test]
    fn moments_of_no_pairs_that_can_be_are_refused() {
        let read = |count: &str, mean: &str, scatter: &str| {
            let text = format!(
                r#"{{"count":{count},"first":[0.0,0.0],"mean":[{mean},0.0],"scatter":[{scatter},0.0,0.0]}}"#
            );
            serde_json::from_str::<Moments>(&text)
        };
        let moments = Moments::of(&[[1e150, -1e150], [-1e150, 3.0]]);
        let text = serde_json::to_string(&moments).unwrap();
        assert_eq!(serde_json::from_str::<Moments>(&text).unwrap(), moments);
        assert!(read("2", "1.0", "4.0").is_ok());
        for [count, mean, scatter] in [
            ["18446744073709551615", "1.0", "4.0"],
            ["2", "1e200", "4.0"],
            ["2", "1.0", "-4.0"],
            ["2", "1.0", "1e305"],
        ] {
            let fault = read(count, mean, scatter).map_err(|fault| fault.to_string());
            assert!(
                fault.as_ref().is_err_and(|text| text.contains("damaged")),
                "{fault:?}"
            );
        }
    }

    proptest! {
        #[test]
        fn merged_parts_are_the_whole(values in prop::collection::vec((-1e3..1e3f64, -1.0..1.0f64), 2..60), cut in 0usize..60) {
            let cut = cut.min(values.len());
            let of = |part: &[(f64, f64)]| {
                let mut moments = Moments::default();
                part.iter().for_each(|&(x, y)| moments.push([x, y]));
                moments
            };
            let (whole, mut merged) = (of(&values), of(&values[..cut]));
            let rest: Vec<_> = values[cut..].iter().map(|&(x, y)| [x, y]).collect();
            merged.merge(&Moments::of(&rest));
            prop_assert_eq!(whole.count(), merged.count());
            for i in 0..2 {
                prop_assert!((whole.mean()[i] - merged.mean()[i]).abs() < 1e-9);
                for j in 0..2 {
                    prop_assert!((whole.covariance()[i][j] - merged.covariance()[i][j]).abs() < 1e-6);
                }
            }
        }
    }

    proptest! {
        #[test]
        fn fishers_criterion_ignores_scales(values in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 8..40), scale in 0.01..100.0f64) {
            let of = |scale: f64| {
                let (mut on, mut off) = (Moments::default(), Moments::default());
                for (k, (x, y)) in values.iter().enumerate() {
                    if k % 2 == 0 {
                        on.push([x + y + 1.0, scale * (y + 2.0)]);
                    } else {
                        off.push([x + y, scale * y]);
                    }
                }
                Distinguishability::of(&on, &off)
            };
            let (one, other) = (of(1.0), of(scale));
            let (Some(fisher), Some(rescaled), Some(b2w)) = (one.fisher, other.fisher, one.b2w) else {
                return Err(TestCaseError::reject("features that do not vary"));
            };
            prop_assert!((fisher / rescaled - 1.0).abs() < 1e-6, "{:?} {:?}", one, other);
            // No direction separates better, the sum of both axes neither.
            prop_assert!(fisher >= b2w * (1.0 - 1e-9));
        }
    }

    #[test]
    fn no_errors_are_a_bound_and_not_a_zero() {
        let mut errors = FrameErrors::default();
        (0..300).for_each(|_| errors.push(0));
        assert_eq!(errors.interval_95(), [0.0, 0.01]);
    }

    #[test]
    fn errors_that_come_together_widen_the_interval() {
        let (mut spread, mut clustered) = (FrameErrors::default(), FrameErrors::default());
        for frame in 0..1000 {
            spread.push(u32::from(frame % 10 == 0));
            clustered.push(if frame % 100 == 0 { 10 } else { 0 });
        }
        assert_eq!(spread.errors(), clustered.errors());
        let width = |e: &FrameErrors| e.interval_95()[1] - e.interval_95()[0];
        // Binomial of frames: √10 times as wide.
        let ratio = width(&clustered) / width(&spread);
        assert!((2.4..4.2).contains(&ratio), "{ratio}");
        let [low, high] = spread.interval_95();
        let deviation = (0.1f64 * 0.9 / 1000.0).sqrt() / 64.0;
        assert!(
            (high - low - 3.92 * deviation).abs() < 0.8 * deviation,
            "{low} to {high}"
        );
    }
}
