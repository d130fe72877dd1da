//! The reach over the ratio, the best ratio, and the ratios without a loss.

use serde::{Deserialize, Serialize};

use super::crossing::{Crossing, log_odds};
use crate::interpolation::interpolated;
use crate::monte_carlo::Evaluation;
use crate::optimum::{Parabola, Sample, of_resamples, percentiles};

/// The greatest loss of reach that does not count as a loss (share).
pub const NOTHING: f64 = 0.01;
/// If the ratios without a loss span this factor, the ratio hardly matters.
pub const FLAT: f64 = 2.0;
/// Points this far below the highest one are fitted too (share of the reach).
const NEAR: f64 = 0.02;

/// The choice among ratios without a loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Choice {
    /// The one in their middle, by factors: equally far from too dark and from too bright, for an inaccurate light sensor, or a camera that
    /// differs from the one of the reach.
    #[default]
    Margin,
    /// The least one, with the least power and glare.
    LeastLight,
    /// The best one.
    Best,
}

/// The reach at ascending ratios, as logarithms of both, with bootstrap resamples.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    l2a: Vec<f64>,
    /// Relative to 1 m.
    reach: Vec<f64>,
    /// One row per resample.
    resampled: Vec<Vec<f64>>,
}

/// The results of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// The best ratio.
    pub best: f64,
    /// Its reach, m.
    pub reach_m: f64,
    /// The least and the greatest ratio about the best that lose no more than [`NOTHING`] of its reach.
    pub loses_nothing: [f64; 2],
    /// The chosen ratio.
    pub chosen: f64,
}

impl Verdict {
    /// Whether the ratio hardly matters: see [`FLAT`].
    pub fn is_flat(&self) -> bool {
        self.loses_nothing[1] >= FLAT * self.loses_nothing[0]
    }
}

/// A verdict, and the 95 % interval of each of its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// From all frames.
    pub verdict: Verdict,
    /// Interval of the best ratio.
    pub best_95: [f64; 2],
    /// Interval of its reach, m.
    pub reach_m_95: [f64; 2],
    /// Interval of the chosen ratio.
    pub chosen_95: [f64; 2],
}

impl Curve {
    /// The reach at each crossing, of ascending ratios: the intersection of a straight line between the log-odds of its two distances with
    /// those of the tolerable error rate.
    pub(super) fn of(crossings: &[&Crossing], raw_error_rate: f64, seed: u64) -> Self {
        let asked = log_odds(raw_error_rate);
        let counts: Vec<Counts> = crossings.iter().map(|crossing| Counts::of(crossing)).collect();
        // The same batches for all ratios.
        let sizes = counts.first().map_or(&[][..], |first| &first.sizes);
        let resample = |drawn: Vec<usize>| {
            let reach = |counts: &Counts| counts.reach(asked, drawn.iter().copied());
            counts.iter().map(reach).collect()
        };
        Self {
            l2a: crossings.iter().map(|crossing| crossing.l2a.ln()).collect(),
            reach: counts.iter().map(|counts| counts.reach(asked, 0..counts.near.len())).collect(),
            resampled: of_resamples(sizes, seed, resample),
        }
    }

    /// The curve through exact points (ratio, reach in m), in any order. Points without a finite logarithm, and all but the first of a
    /// ratio, are left out: a file that was changed by hand may have some.
    pub fn through(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let points = points.map(|(l2a, reach)| (l2a.ln(), reach.ln()));
        let mut points: Vec<(f64, f64)> = points.filter(|(l2a, reach)| l2a.is_finite() && reach.is_finite()).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by(|after, before| after.0 == before.0);
        let (l2a, reach) = points.into_iter().unzip();
        Self {
            l2a,
            reach,
            resampled: Vec::new(),
        }
    }

    /// The ratios, the reach at each in m and its 95 % interval.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64, [f64; 2])> {
        (0..self.l2a.len()).map(|point| {
            let mut as_well: Vec<f64> = self.resampled.iter().map(|row| row[point]).collect();
            let reach = self.reach[point];
            let reach_95 = percentiles(&mut as_well, 0.025).unwrap_or([reach; 2]);
            (self.l2a[point].exp(), reach.exp(), reach_95.map(|reach| reach.exp()))
        })
    }

    /// The reach at any ratio, m, by straight lines between logarithms; beyond the ends that of the nearest end. `None` without points.
    pub fn reach_m(&self, l2a: f64) -> Option<f64> {
        let reach = interpolated(&self.l2a, &self.reach, l2a.ln());
        (!self.l2a.is_empty()).then(|| reach.exp())
    }

    /// Its results; `None` for fewer than three points.
    pub fn judged(&self, choice: Choice) -> Option<Judgement> {
        let verdict = self.verdict(&self.reach, choice)?;
        let as_well: Vec<Verdict> = self.resampled.iter().filter_map(|reach| self.verdict(reach, choice)).collect();
        let interval = |of: fn(&Verdict) -> f64| {
            let mut values: Vec<f64> = as_well.iter().map(of).collect();
            percentiles(&mut values, 0.025).unwrap_or([of(&verdict); 2])
        };
        Some(Judgement {
            verdict,
            best_95: interval(|verdict| verdict.best),
            reach_m_95: interval(|verdict| verdict.reach_m),
            chosen_95: interval(|verdict| verdict.chosen),
        })
    }

    fn verdict(&self, reach: &[f64], choice: Choice) -> Option<Verdict> {
        let highest = (0..reach.len()).max_by(|&a, &b| reach[a].total_cmp(&reach[b]))?;
        let near = self.near(reach, highest);
        let points = near.map(|point| (self.l2a[point], reach[point], 1.0));
        let parabola = Parabola::fit(points)?;
        let ends = [*self.l2a.first()?, *self.l2a.last()?];
        let best = parabola.top(ends);
        // Chance favoured the highest point; but a top between points that are far apart may be above it.
        let top = parabola.at(best);
        let enough = (top + (1.0 - NOTHING).ln()).min(reach[highest]);
        let loses_nothing = [
            self.crossing(reach, enough, highest, (0..highest).rev()),
            self.crossing(reach, enough, highest, highest + 1..reach.len()),
        ];
        let verdict = Verdict {
            best: best.exp(),
            reach_m: top.exp(),
            loses_nothing: loses_nothing.map(f64::exp),
            chosen: best.exp(),
        };
        let chosen = match choice {
            Choice::Best => verdict.best,
            Choice::LeastLight => verdict.loses_nothing[0],
            Choice::Margin => (0.5 * (loses_nothing[0] + loses_nothing[1])).exp(),
        };
        Some(Verdict { chosen, ..verdict })
    }

    /// The points about the highest that are nearly as high, at least one more on either side, and at least three.
    fn near(&self, reach: &[f64], highest: usize) -> std::ops::Range<usize> {
        let is_near = |point: &usize| reach[*point] > reach[highest] - NEAR;
        let before = (0..highest).rev().take_while(is_near).count().max(1);
        let after = (highest + 1..reach.len()).take_while(is_near).count().max(1);
        // At most twice as far on one side as on the other, because a long slope would draw the top away from a steep edge.
        let [before, after] = [before.min(2 * after), after.min(2 * before)];
        let end = (highest + after + 1).max(3).min(reach.len());
        highest.saturating_sub(before).min(end.saturating_sub(3))..end
    }

    /// The first fall of the reach below a height, from the highest point along others; the last of them without a fall.
    fn crossing(&self, reach: &[f64], height: f64, highest: usize, along: impl Iterator<Item = usize>) -> f64 {
        let mut last = highest;
        for point in along {
            if reach[point] < height {
                let share = (reach[last] - height) / (reach[last] - reach[point]);
                return self.l2a[last] + share * (self.l2a[point] - self.l2a[last]);
            }
            last = point;
        }
        self.l2a[last]
    }
}

/// Wrong and right bits of a crossing's batches at its two distances.
struct Counts {
    /// Logarithms of the distances.
    distance: [f64; 2],
    /// Batches of each round.
    sizes: Vec<usize>,
    /// At the nearer distance, (wrong, right).
    near: Vec<(u64, u64)>,
    /// At the farther one, if LEDs are distinguishable there.
    far: Option<Vec<(u64, u64)>>,
}

impl Counts {
    fn of(crossing: &Crossing) -> Self {
        let count = |batch: &Evaluation| {
            let errors = batch.of_one_symbol();
            (errors.errors(), errors.bits() - errors.errors())
        };
        let counts = |sample: &Sample| sample.batches().flatten().map(count).collect();
        Self {
            distance: crossing.distance_m().map(f64::ln),
            sizes: crossing.near.batches().map(<[_]>::len).collect(),
            near: counts(&crossing.near),
            far: crossing.far.as_ref().map(counts),
        }
    }

    /// The logarithm of the reach by some of the batches.
    fn reach(&self, asked: f64, chosen: impl Iterator<Item = usize> + Clone) -> f64 {
        let odds = |batches: &[(u64, u64)]| {
            let chosen = chosen.clone().map(|batch| batches[batch]);
            let (wrong, right) = chosen.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
            ((right as f64 + 0.5) / (wrong as f64 + 0.5)).ln()
        };
        let [from, to] = self.distance;
        let Some(far) = &self.far else {
            return from;
        };
        let [near, far] = [&self.near, far].map(|batches| odds(batches));
        // If the two are in the wrong order by chance, the crossing is still between them.
        let share = if near > far {
            ((near - asked) / (near - far)).clamp(-2.0, 3.0)
        } else {
            0.5
        };
        from + share * (to - from)
    }
}
