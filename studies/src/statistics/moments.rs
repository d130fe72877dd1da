//! Mean and scatter of pairs of numbers.

use serde::{Deserialize, Serialize};

use super::MOST_FRAMES;

/// Count, mean and scatter of pairs of numbers, each at most 10¹⁵⁰ in size, so that squares are finite.
///
/// Values are relative to the first one, so that a large common offset costs no digits, with Welford's updates; two such sums merge by
/// Chan's formula (Chan, Golub & LeVeque 1983).
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
    pub(super) count: u64,
    pub(super) first: [f64; 2],
    /// Mean minus `first`.
    pub(super) mean: [f64; 2],
    /// Sums of squares and products about the mean: xx, xy, yy.
    scatter: [f64; 3],
}

/// The file format.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenMoments {
    count: u64,
    first: [f64; 2],
    mean: [f64; 2],
    scatter: [f64; 3],
}

/// Invalid moments.
#[derive(Debug, thiserror::Error)]
#[error(
    "{} pairs that begin with {:?}, with a mean {:?} from there and a scatter of {:?}: at most {MOST_PAIRS} pairs of numbers up to \
     {MOST_SIZE:e} in size are counted, whose squares sum to no less than 0; the file is damaged",
    .0.count, .0.first, .0.mean, .0.scatter
)]
struct ImpossibleMoments(WrittenMoments);

/// The most pairs in a file: one for each LED of each frame.
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
        // Two numbers differ by at most twice their magnitude; some room is left for rounding.
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
    /// The moments of a few pairs at once, in two passes: first the mean, then the residuals.
    pub fn of(values: &[[f64; 2]]) -> Self {
        let Some(&first) = values.first() else {
            return Self::default();
        };
        let from_first = values.iter().map(|v| [v[0] - first[0], v[1] - first[1]]);
        let share = 1.0 / values.len() as f64;
        let sum = from_first.clone().fold([0.0; 2], |sum, x| [sum[0] + x[0], sum[1] + x[1]]);
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

    /// Adds one pair.
    pub fn push(&mut self, value: [f64; 2]) {
        if self.count == 0 {
            self.first = value;
        }
        self.count += 1;
        let x = [value[0] - self.first[0], value[1] - self.first[1]];
        let before = [x[0] - self.mean[0], x[1] - self.mean[1]];
        let share = 1.0 / self.count as f64;
        self.mean = [self.mean[0] + before[0] * share, self.mean[1] + before[1] * share];
        let after = [x[0] - self.mean[0], x[1] - self.mean[1]];
        self.scatter[0] += before[0] * after[0];
        self.scatter[1] += before[0] * after[1];
        self.scatter[2] += before[1] * after[1];
    }

    /// Adds all pairs of `other`.
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
        let apart = [0, 1].map(|i| (other.first[i] - self.first[i]) + (other.mean[i] - self.mean[i]));
        let weight = own * others / total;
        let products = [apart[0] * apart[0], apart[0] * apart[1], apart[1] * apart[1]];
        for ((scatter, others), product) in self.scatter.iter_mut().zip(other.scatter).zip(products) {
            *scatter += others + product * weight;
        }
        self.mean = [0, 1].map(|i| self.mean[i] + apart[i] * others / total);
        self.count += other.count;
    }

    /// The number of pairs.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; zeros without pairs.
    pub fn mean(&self) -> [f64; 2] {
        [self.first[0] + self.mean[0], self.first[1] + self.mean[1]]
    }

    /// Their covariance (over n); zeros without pairs.
    pub fn covariance(&self) -> [[f64; 2]; 2] {
        let [xx, xy, yy] = self.scatter.map(|s| s / (self.count.max(1)) as f64);
        [[xx, xy], [xy, yy]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;
    use sim::random::{Purpose, stream};

    #[test]
    fn a_large_offset_does_no_harm_though_the_naive_sum_fails() {
        let mut random = stream(3, 0, Purpose::Phase);
        let values: Vec<f64> = (0..10_000).map(|_| 1e12 + sim::random::uniform(&mut random)).collect();
        let n = values.len() as f64;
        let exact_mean = values.iter().map(|v| v - 1e12).sum::<f64>() / n;
        let exact = values.iter().map(|v| (v - 1e12 - exact_mean).powi(2)).sum::<f64>() / n;
        let naive = values.iter().map(|v| v * v).sum::<f64>() / n - (values.iter().sum::<f64>() / n).powi(2);
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
            let text = format!(r#"{{"count":{count},"first":[0.0,0.0],"mean":[{mean},0.0],"scatter":[{scatter},0.0,0.0]}}"#);
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
            assert!(fault.as_ref().is_err_and(|text| text.contains("damaged")), "{fault:?}");
        }
    }

    properties! {
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
}
