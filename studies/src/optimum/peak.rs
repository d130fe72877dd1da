//! The maximum of a sampled curve, and its uncertainty.

use serde::{Deserialize, Serialize};

use super::criterion::Criterion;
use super::parabola::Parabola;
use super::samples::Samples;

/// The best ratio of sampled ones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// The best ratio: the top of a parabola fitted to the objective near its highest point.
    pub l2a: f64,
    /// Its 95 % interval: percentiles of the tops of the same fit to bootstrap resamples of the batches. If no bit error was seen at the
    /// best of the sampled ratios, resampling has no effect: then it includes `not_worse`.
    pub l2a_95: [f64; 2],
    /// Whether the best ratio is the end of the range: the true one may lie beyond.
    pub at_border: bool,
    /// The criterion's value there, by the fit.
    pub value: f64,
    /// The sampled ratios about the best that are not significantly worse than it (paired, one-sided, 5 %).
    pub not_worse: [f64; 2],
}

/// The points to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// All points.
    All,
    /// Points near the highest: two on either side and, for error rates, all its neighbours with less than 1.5 times its odds of an error,
    /// so that the valley's unequal walls do not bias the fit. If errors are too few for a visible floor: all with less than four times its
    /// odds, and one more on either side, because only the walls then show the middle.
    NearHighest,
}

/// The greatest loss of an objective that counts as near: ln 1.5 of the odds.
const NEAR: f64 = 0.405;
/// The same with few errors: ln 4.
const NEAR_OF_FEW: f64 = 1.386;
/// The points on either side of the highest that are always fitted.
const BESIDE: usize = 2;
/// Errors at the best ratio below which the walls are needed.
const FEW_ERRORS: f64 = 10.0;
/// The greatest weight of a wall, as a multiple of the best ratio's: above, the fit would follow the walls alone.
const HEAVIEST: f64 = 4.0;

impl Peak {
    /// The peak of `samples` within `range`; `None` if the criterion is undefined at some point, or with fewer than three points.
    pub fn of(samples: &Samples, criterion: Criterion, window: Window, range: [f64; 2], seed: u64) -> Option<Self> {
        let objectives = samples.objectives(criterion)?;
        let highest = index_of_highest(&objectives)?;
        let l2a: Vec<f64> = samples.points().iter().map(|point| point.l2a).collect();
        let weights = weights(samples, criterion, highest);
        let fitted = match window {
            Window::All => 0..objectives.len(),
            Window::NearHighest => match criterion {
                Criterion::Ber => valley(&objectives, highest, weights[highest] < FEW_ERRORS),
                Criterion::B2w | Criterion::Fisher => about(highest, [BESIDE; 2], objectives.len()),
            },
        };
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
        let not_worse = not_worse(&resampled, &l2a, highest);
        let mut l2a_95 = percentiles(&mut tops, 0.025)?;
        if criterion == Criterion::Ber && samples.points()[highest].total().of_one_symbol().errors() == 0 {
            l2a_95 = [l2a_95[0].min(not_worse[0]), l2a_95[1].max(not_worse[1])];
        }
        Some(Self {
            l2a: top,
            l2a_95,
            at_border: top <= range[0] || top >= range[1],
            value: match criterion {
                Criterion::Ber => 1.0 / (1.0 + level.exp()),
                Criterion::B2w | Criterion::Fisher => level.exp(),
            },
            not_worse,
        })
    }
}

/// The index of the highest value; of several in a row, the middle one.
pub fn index_of_highest(values: &[f64]) -> Option<usize> {
    let first = (0..values.len()).rev().max_by(|&a, &b| values[a].total_cmp(&values[b]))?;
    let row = values[first..].iter().take_while(|&&value| value == values[first]);
    Some(first + (row.count() - 1) / 2)
}

/// The weight of each point in a fit.
fn weights(samples: &Samples, criterion: Criterion, highest: usize) -> Vec<f64> {
    let weight = |place: usize| criterion.weight(&samples.points()[place].total());
    let most = HEAVIEST * weight(highest);
    (0..samples.points().len()).map(|place| weight(place).min(most)).collect()
}

/// The indices on both sides of one of them, up to a distance; near an end more on the other side, for at least five points.
fn about(place: usize, [before, after]: [usize; 2], count: usize) -> std::ops::Range<usize> {
    let fewest = 2 * BESIDE + 1;
    let end = (place + after + 1).max(fewest).min(count);
    let start = place.saturating_sub(before);
    start.min(end.saturating_sub(fewest))..end
}

/// The indices with odds of an error near the least, and the walls if there are few errors.
fn valley(objectives: &[f64], highest: usize, few: bool) -> std::ops::Range<usize> {
    let near = if few { NEAR_OF_FEW } else { NEAR };
    let is_near = |&&objective: &&f64| objective >= objectives[highest] - near;
    let before = objectives[..highest].iter().rev().take_while(is_near).count();
    let after = objectives[highest + 1..].iter().take_while(is_near).count();
    let reach = [before, after].map(|count| (count + usize::from(few)).max(BESIDE));
    about(highest, reach, objectives.len())
}

/// The percentiles of `share` from below and from above; sorts the values.
pub(crate) fn percentiles(values: &mut [f64], share: f64) -> Option<[f64; 2]> {
    values.sort_by(f64::total_cmp);
    let outside = (values.len() as f64 * share) as usize;
    let inside = values.len().checked_sub(1 + outside)?;
    Some([values[outside], values[inside]])
}

/// The ends of the points about the highest that are as high in at least 5 % of the resamples.
fn not_worse(resampled: &[Vec<f64>], l2a: &[f64], highest: usize) -> [f64; 2] {
    let as_good = |point: usize| {
        let times = resampled.iter().filter(|row| row[point] >= row[highest]).count();
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

#[cfg(test)]
mod tests {
    use super::super::samples::Sample;
    use super::*;
    use crate::monte_carlo::Evaluation;
    use sim::random::{Purpose, normal, stream, uniform};

    const BEST: f64 = 2.0;
    const BATCHES: usize = 64;

    /// Frames at five ratios about [`BEST`], at which the classes are farthest apart on average; each frame has its own offset and slope,
    /// the same at all ratios, so that its own best ratio differs.
    fn hilly(seed: u64, frames_per_batch: usize) -> Samples {
        let ratios = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|step| BEST + 0.1 * step);
        let mut points = ratios.map(|l2a| Sample::of(l2a, vec![Evaluation::default(); BATCHES]));
        let mut random = stream(seed, 0, Purpose::Phase);
        for batch in 0..BATCHES {
            for _ in 0..frames_per_batch {
                let [offset, slope] = [0.3, 1.0].map(|spread| spread * normal(&mut random));
                for led in 0..8 {
                    let own = normal(&mut random);
                    for point in &mut points {
                        let away = point.l2a - BEST;
                        let frame = offset + slope * away;
                        let evaluation = point.batch_mut(batch);
                        match led % 2 {
                            0 => evaluation.on.push([4.0 - 4.0 * away * away + frame + own, 0.0]),
                            _ => evaluation.off.push([own, 0.0]),
                        }
                    }
                }
            }
        }
        Samples(points.to_vec())
    }

    fn peak(samples: &Samples, seed: u64) -> Peak {
        Peak::of(samples, Criterion::B2w, Window::All, [0.2, 4.0], seed).unwrap()
    }

    fn width(peak: &Peak) -> f64 {
        peak.l2a_95[1] - peak.l2a_95[0]
    }

    #[test]
    fn the_interval_holds_the_truth_in_95_of_100_cases() {
        let held = (0..200).filter(|&seed| {
            let [low, high] = peak(&hilly(seed, 4), seed).l2a_95;
            (low..=high).contains(&BEST)
        });
        // 190 ± 3.1 of 200 cases.
        let held = held.count();
        assert!((183..=197).contains(&held), "seeds 0 to 199: {held}");
    }

    #[test]
    fn four_times_the_frames_halve_the_interval() {
        let mean = |frames| (0..20).map(|seed| width(&peak(&hilly(seed, frames), seed))).sum::<f64>() / 20.0;
        let ratio = mean(4) / mean(16);
        assert!((1.8..2.2).contains(&ratio), "seeds 0 to 19: {ratio}");
    }

    /// Frames with these total bit errors at ratios 1, 1.2, ….
    fn errors(counts: &[u32]) -> Samples {
        let points = counts.iter().zip(0..).map(|(&count, place)| {
            let mut batches = vec![Evaluation::default(); BATCHES];
            let mut random = stream(u64::from(count), 0, Purpose::Noise);
            let mut of_frames = [0; 16 * BATCHES];
            for _ in 0..count {
                of_frames[(uniform(&mut random) * of_frames.len() as f64) as usize] += 1;
            }
            for (frame, errors) in of_frames.into_iter().enumerate() {
                batches[frame % BATCHES].errors.push(errors);
            }
            Sample::of(1.0 + 0.2 * f64::from(place), batches)
        });
        Samples(points.collect())
    }

    fn least(counts: &[u32]) -> Peak {
        Peak::of(&errors(counts), Criterion::Ber, Window::NearHighest, [1.0, 3.0], 1).unwrap()
    }

    #[test]
    fn the_least_error_rate_is_found_by_the_shape_of_the_valley() {
        let found = least(&[900, 500, 300, 210, 190, 205, 310, 490, 920]);
        assert!((found.l2a - 1.8).abs() < 0.05, "{found:?}");
        assert!(found.l2a_95[0] > 1.6 && found.l2a_95[1] < 2.0, "{found:?}");
        assert!(found.not_worse[0] <= 1.8 && found.not_worse[1] >= 1.8, "{found:?}");
        assert!(found.not_worse[0] > 1.3 && found.not_worse[1] < 2.3, "{found:?}");
    }

    #[test]
    fn a_valley_without_errors_has_its_best_in_the_middle_and_is_not_sure_of_it() {
        let found = least(&[400, 60, 0, 0, 0, 0, 0, 60, 400]);
        assert!((found.l2a - 1.8).abs() < 0.05, "{found:?}");
        assert!(found.l2a_95[0] <= 1.4 + 1e-9 && found.l2a_95[1] >= 2.2 - 1e-9, "{found:?}");
        let nothing = least(&[0; 9]);
        assert!((nothing.l2a - 1.8).abs() < 1e-6 && !nothing.at_border, "{nothing:?}");
        assert_eq!(nothing.not_worse, nothing.l2a_95);
        assert!(nothing.l2a_95[1] - nothing.l2a_95[0] > 1.5);
    }

    #[test]
    fn what_still_rises_at_the_end_is_said_to() {
        for counts in [
            [3000, 2000, 1400, 1000, 700, 500, 350, 250, 180, 130, 95],
            [3000, 2000, 1400, 1000, 700, 500, 350, 250, 180, 100, 40],
        ] {
            let found = least(&counts);
            assert!(found.at_border && found.l2a == 3.0, "{counts:?}: {found:?}");
        }
    }

    #[test]
    fn without_both_classes_there_is_no_peak() {
        let nothing = Sample::of(1.0, vec![Evaluation::default()]);
        let samples = Samples(vec![nothing; 5]);
        assert_eq!(Peak::of(&samples, Criterion::B2w, Window::All, [0.2, 4.0], 1), None);
        assert_eq!(Peak::of(&Samples::default(), Criterion::Ber, Window::All, [0.2, 4.0], 1), None);
    }
}
