//! Where a sampled curve is highest, and how sure that is.

use serde::{Deserialize, Serialize};

use super::criterion::Criterion;
use super::parabola::Parabola;
use super::samples::Samples;

/// The best ratio of sampled ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// The best ratio: the top of a parabola fitted to the objective near its highest point.
    pub l2a: f64,
    /// Its 95 % interval: percentiles of the tops of the same fit to bootstrap resamples of the batches.
    pub l2a_95: [f64; 2],
    /// Whether the best ratio is the end of the range: the true one may lie beyond.
    pub at_border: bool,
    /// The criterion's value there, by the fit.
    pub value: f64,
    /// The sampled ratios about the best that are not significantly worse than it (paired, one-sided, 5 %).
    pub not_worse: [f64; 2],
}

/// The points to be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// All of them.
    All,
    /// Those near the highest: for error rates all about it with less than four times its odds, else two on either side.
    NearHighest,
}

/// How much worse an objective may be to count as near: ln 4 of the odds.
const NEAR: f64 = 1.386;
/// The points on either side of the highest that are always fitted.
const BESIDE: usize = 2;

impl Peak {
    /// The highest place of `samples`, within `range`; none where the criterion is not defined at some point, or of fewer than three.
    pub fn of(
        samples: &Samples,
        criterion: Criterion,
        window: Window,
        range: [f64; 2],
        seed: u64,
    ) -> Option<Self> {
        let objectives = samples.objectives(criterion);
        if objectives.iter().any(|objective| !objective.is_finite()) {
            return None;
        }
        let highest = index_of_highest(&objectives)?;
        let fitted = match window {
            Window::All => 0..objectives.len(),
            Window::NearHighest => near(&objectives, highest, criterion),
        };
        let l2a: Vec<f64> = samples.points().iter().map(|point| point.l2a).collect();
        let weights: Vec<f64> = samples
            .points()
            .iter()
            .map(|point| criterion.weight(&point.total()))
            .collect();
        let fit = |objectives: &[f64]| {
            let points = fitted.clone().map(|k| (l2a[k], objectives[k], weights[k]));
            Parabola::fit(points)
        };
        let parabola = fit(&objectives)?;
        let top = parabola.top(range);
        let resampled = samples.resampled(criterion, seed);
        let mut tops: Vec<f64> = resampled
            .iter()
            .filter_map(|objectives| Some(fit(objectives)?.top(range)))
            .collect();
        let level = parabola.at(top);
        Some(Self {
            l2a: top,
            l2a_95: percentiles(&mut tops, 0.025),
            at_border: top <= range[0] || top >= range[1],
            value: match criterion {
                Criterion::Ber => 1.0 / (1.0 + level.exp()),
                Criterion::B2w | Criterion::Fisher => level.exp(),
            },
            not_worse: not_worse(&resampled, &l2a, highest),
        })
    }
}

/// The place of the highest value.
pub fn index_of_highest(values: &[f64]) -> Option<usize> {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b]))
}

/// The points near the highest.
fn near(objectives: &[f64], highest: usize, criterion: Criterion) -> std::ops::Range<usize> {
    let is_near =
        |&&objective: &&f64| criterion == Criterion::Ber && objective >= objectives[highest] - NEAR;
    let after = objectives[highest + 1..].iter().take_while(is_near).count();
    let before = objectives[..highest]
        .iter()
        .rev()
        .take_while(is_near)
        .count();
    highest.saturating_sub(before.max(BESIDE))
        ..(highest + after.max(BESIDE) + 1).min(objectives.len())
}

/// The values that a share of them is below, and above; they are sorted.
fn percentiles(values: &mut [f64], share: f64) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let outside = (values.len() as f64 * share) as usize;
    let at = |place: usize| values.get(place).copied().unwrap_or(f64::NAN);
    [
        at(outside),
        at((values.len().max(1) - 1).saturating_sub(outside)),
    ]
}

/// The ends of the row of points about the highest that are as high in at least 5 % of the resamples.
fn not_worse(resampled: &[Vec<f64>], l2a: &[f64], highest: usize) -> [f64; 2] {
    let as_good = |point: usize| {
        let times = resampled
            .iter()
            .filter(|row| row[point] >= row[highest])
            .count();
        times * 20 >= resampled.len()
    };
    let mut ends = [highest, highest];
    while ends[0] > 0 && as_good(ends[0] - 1) {
        ends[0] -= 1;
    }
    while ends[1] + 1 < l2a.len() && as_good(ends[1] + 1) {
        ends[1] += 1;
    }
    ends.map(|end| l2a[end])
}
