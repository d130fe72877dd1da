//! The search itself: the ratios to try, and their numbers of frames.

use sim::scene::Scene;

use crate::monte_carlo::{EvaluateError, Evaluation};

use super::criterion::Criterion;
use super::peak::{Peak, Window, index_of_highest};
use super::samples::{Piece, Samples, rounds};
use super::{GRID, Optimum, OptimumError, Search, check_limits};

/// Steps of the finer grid per step of the wide grid.
const FINER: usize = 4;
/// Half the width of the finer grid's window in its steps: at first, and at most.
const HALF_WIDTHS: [usize; 2] = [2, 8];
/// The most moves of the window in a round.
const MOVES_MAX: usize = 16;

/// Finds the best ratio of a scene.
///
/// ```
/// use studies::optimum::{Search, optimum};
/// use sim::scene::Scene;
/// let search = Search { frames: 256, ..Search::default() };
/// let best = optimum(&Scene::load("paper", &[])?, &search)?;
/// assert!(best.l2a_95[0] > 1.5 && best.l2a_95[1] < 2.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If the search or the scene is invalid, the criterion is undefined, or [`Search::stop`] ended it: see [`OptimumError`].
pub fn optimum(scene: &Scene, search: &Search) -> Result<Optimum, OptimumError> {
    optimum_from(scene, search, &mut std::iter::empty(), |_| {})
}

/// As [`optimum`], continued from the pieces of rounds that an earlier run of the same search has finished, in the order of its calls of
/// `tell`: with the same rounds, a search repeats itself.
///
/// # Errors
/// As [`optimum`].
pub fn optimum_from(
    scene: &Scene,
    search: &Search,
    known: &mut dyn Iterator<Item = Vec<Evaluation>>,
    tell: impl FnMut(&Piece),
) -> Result<Optimum, OptimumError> {
    check_limits(search.range, search.frames, search.tolerance)?;
    let mut lattice = Lattice {
        scene,
        search,
        samples: Samples::default(),
        known,
        tell,
    };
    let peak = match search.criterion {
        Criterion::B2w | Criterion::Fisher => lattice.refined()?,
        Criterion::Ber => lattice.wide()?,
    };
    Ok(lattice.finish(peak))
}

/// Ratios at equal steps, and the samples at some of them.
struct Lattice<'a, T> {
    scene: &'a Scene,
    search: &'a Search,
    samples: Samples,
    /// Finished rounds.
    known: &'a mut dyn Iterator<Item = Vec<Evaluation>>,
    tell: T,
}

impl<T: FnMut(&Piece)> Lattice<'_, T> {
    /// The number of the last step.
    const LAST: usize = (GRID - 1) * FINER;

    /// The ratio of a step, rounded to a millionth for readability.
    fn l2a(&self, step: usize) -> f64 {
        let [low, high] = self.search.range;
        let exact = low + (high - low) * step as f64 / Self::LAST as f64;
        (exact * 1e6).round() / 1e6
    }

    /// The step nearest to a ratio.
    fn nearest(&self, l2a: f64) -> usize {
        let [low, high] = self.search.range;
        ((l2a - low) / (high - low) * Self::LAST as f64).round() as usize
    }

    /// Ensures that number of rounds at some steps, and returns the samples of those steps and rounds.
    fn sampled(&mut self, steps: impl Iterator<Item = usize> + Clone, rounds: usize) -> Result<Samples, OptimumError> {
        for l2a in steps.clone().map(|step| self.l2a(step)).collect::<Vec<_>>() {
            let settings = self.search.settings();
            self.samples
                .extend_from(self.scene, settings, l2a, rounds, self.known, &mut self.tell)
                .map_err(|source| match source {
                    EvaluateError::Stopped => OptimumError::Interrupted,
                    source => OptimumError::Evaluate {
                        l2a,
                        source: Box::new(source),
                    },
                })?;
        }
        Ok(self.samples.picked(&steps.map(|step| self.l2a(step)).collect::<Vec<_>>(), rounds))
    }

    fn grid(&mut self, rounds: usize) -> Result<Samples, OptimumError> {
        self.sampled((0..=Self::LAST).step_by(FINER), rounds)
    }

    fn peak(&self, samples: &Samples, window: Window) -> Result<Peak, OptimumError> {
        let Search {
            criterion, range, seed, ..
        } = *self.search;
        Peak::of(samples, criterion, window, range, seed).ok_or(OptimumError::Undefined {
            criterion,
            low: range[0],
            high: range[1],
        })
    }

    fn is_sure(&self, peak: &Peak) -> bool {
        (peak.l2a_95[1] - peak.l2a_95[0]) / 2.0 <= self.search.tolerance
    }

    /// The peak of the wide grid alone.
    fn wide(&mut self) -> Result<Peak, OptimumError> {
        let most = rounds(self.search.frames).len() - 1;
        for round in 1..most {
            let samples = self.grid(round)?;
            let peak = self.peak(&samples, Window::NearHighest)?;
            if self.is_sure(&peak) {
                return Ok(peak);
            }
        }
        let samples = self.grid(most)?;
        self.peak(&samples, Window::NearHighest)
    }

    /// The peak of the finer grid about that of one round of the wide one.
    fn refined(&mut self) -> Result<Peak, OptimumError> {
        let wide = self.grid(1)?;
        let wide = self.peak(&wide, Window::NearHighest)?;
        let mut fine = wide;
        for round in 1..rounds(self.search.frames).len() {
            fine = self.fine(fine.l2a, round)?;
            if self.is_sure(&fine) {
                break;
            }
        }
        Ok(Peak {
            // The best ratio lies between two points of the wide grid, and belongs to the range itself.
            not_worse: [wide.not_worse[0].min(fine.l2a), wide.not_worse[1].max(fine.l2a)],
            ..fine
        })
    }

    /// The peak of a window of the finer grid, moved until its top is in the middle, and widened until its interval is inside.
    fn fine(&mut self, start: f64, rounds: usize) -> Result<Peak, OptimumError> {
        let (mut centre, mut half) = (self.nearest(start), HALF_WIDTHS[0]);
        let mut moves = 0;
        loop {
            let low = centre.saturating_sub(half).min(Self::LAST - 2 * half);
            let high = low + 2 * half;
            let samples = self.sampled(low..=high, rounds)?;
            let peak = self.peak(&samples, Window::All)?;
            moves += 1;
            let next = self.nearest(peak.l2a).clamp(low, high);
            let inside = |ratio: f64| {
                let step = self.nearest(ratio);
                (low..=high).contains(&step)
            };
            if moves >= MOVES_MAX {
                return Ok(peak);
            }
            if next.abs_diff(centre) > 1 {
                centre = next;
            } else if half < HALF_WIDTHS[1] && !peak.l2a_95.into_iter().all(inside) {
                half += 2;
            } else {
                return Ok(peak);
            }
        }
    }

    fn finish(self, peak: Peak) -> Optimum {
        let Samples(points) = &self.samples;
        let most = points.iter().map(|point| point.rounds()).max().unwrap_or(0);
        let away: Vec<f64> = points
            .iter()
            .map(|point| match point.rounds() == most {
                true => -(point.l2a - peak.l2a).abs(),
                false => f64::NEG_INFINITY,
            })
            .collect();
        let evaluation = index_of_highest(&away).map_or_else(Default::default, |place| points[place].total());
        let curve = points.iter().map(|point| (point.l2a, point.total())).collect();
        let steps: Vec<f64> = (0..=Self::LAST).step_by(FINER).map(|step| self.l2a(step)).collect();
        let common = self.samples.common_rounds(&steps);
        Optimum {
            l2a: peak.l2a,
            l2a_95: peak.l2a_95,
            at_border: peak.at_border,
            value: peak.value,
            not_worse: peak.not_worse,
            frames: evaluation.errors.frames(),
            evaluation,
            curve,
            grid: self.samples.picked(&steps, common),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::stop::Stop;

    fn scene(settings: &[&str]) -> Scene {
        let settings: Vec<String> = settings.iter().map(|text| text.to_string()).collect();
        Scene::load("paper", &settings).unwrap()
    }

    fn search(criterion: Criterion) -> Search {
        Search {
            criterion,
            frames: 200,
            ..Search::default()
        }
    }

    const FAR: [&str; 2] = ["pose.distance_m=70", "panel.interval=0.5"];

    #[test]
    fn senseless_searches_are_refused() {
        let refused = |change: &dyn Fn(&mut Search)| {
            let mut search = search(Criterion::B2w);
            change(&mut search);
            optimum(&scene(&FAR), &search).unwrap_err().to_string()
        };
        assert!(refused(&|s| s.range = [2.0, 1.0]).contains("2 to 1"));
        assert!(refused(&|s| s.range = [f64::NAN, 1.0]).contains("NaN to 1"));
        assert!(refused(&|s| s.range = [0.0, 1.0]).contains("0.01 to 10"));
        assert!(refused(&|s| s.frames = 63).contains("at least 64"));
        assert!(refused(&|s| s.tolerance = -1.0).contains("-1"));
        assert!(refused(&|s| s.tolerance = f64::NAN).contains("NaN"));
        // 45° to the side.
        let aside = optimum(&scene(&["pose.x_m=50"]), &search(Criterion::B2w));
        assert!(
            matches!(&aside, Err(OptimumError::Evaluate { l2a, .. }) if *l2a == 0.2),
            "{aside:?}"
        );
    }

    #[test]
    fn a_panel_that_is_near_and_turned_away_has_a_best_ratio_too() {
        let near = scene(&["pose.distance_m=0.5", "pose.yaw_deg=80", "panel.led_diameter_m=0.001"]);
        let found = optimum(&near, &search(Criterion::B2w)).unwrap();
        assert!(found.l2a_95[0] > 0.2 && found.l2a_95[1] < 4.0, "{:?}", found.l2a_95);
    }

    #[test]
    fn whoever_asked_can_end_it() {
        static ASKED: AtomicBool = AtomicBool::new(false);
        let search = Search {
            stop: Stop::at(&ASKED),
            ..search(Criterion::Ber)
        };
        let (mut frames, known) = (0, &mut std::iter::empty());
        let ended = optimum_from(&scene(&FAR), &search, known, |piece| {
            frames += piece.frames();
            ASKED.store(frames >= 1000, Ordering::Relaxed);
        });
        assert!(matches!(ended, Err(OptimumError::Interrupted)));
        assert_eq!(frames, 1000);
    }

    #[test]
    fn a_search_goes_on_from_the_rounds_of_one_that_was_ended() {
        static ASKED: AtomicBool = AtomicBool::new(false);
        let search = Search {
            frames: 5000,
            ..search(Criterion::B2w)
        };
        let stopped = Search {
            stop: Stop::at(&ASKED),
            ..search
        };
        let mut rounds = Vec::new();
        let keep = |piece: &Piece| {
            assert!(!piece.is_known);
            rounds.push(piece.batches.to_vec());
            ASKED.store(rounds.len() == 25, Ordering::Relaxed);
        };
        let ended = optimum_from(&scene(&FAR), &stopped, &mut std::iter::empty(), keep);
        assert!(matches!(ended, Err(OptimumError::Interrupted)));
        let (mut known, mut new) = (0, 0);
        let resumed = optimum_from(&scene(&FAR), &search, &mut rounds.into_iter(), |piece| {
            *if piece.is_known { &mut known } else { &mut new } += 1;
        });
        let whole = optimum(&scene(&FAR), &search).unwrap();
        assert_eq!(resumed.unwrap(), whole);
        assert!(known == 25 && new > 0, "{known} known, {new} new");
    }

    #[test]
    fn the_tolerance_ends_it_early() {
        let search = Search {
            frames: 10_000,
            tolerance: 0.05,
            ..Search::default()
        };
        let found = optimum(&scene(&FAR), &search).unwrap();
        assert!((found.l2a_95[1] - found.l2a_95[0]) / 2.0 <= 0.05, "{:?}", found.l2a_95);
        assert!(found.frames < 10_000);
    }

    #[test]
    fn the_grid_has_twenty_points_and_a_loss_of_nothing_at_the_best() {
        let found = optimum(&scene(&FAR), &search(Criterion::B2w)).unwrap();
        assert_eq!(found.grid.points().len(), GRID);
        assert!(found.curve.len() > GRID);
        assert!(found.curve.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(found.loss_at(Criterion::B2w, found.l2a), Some(1.0));
        assert!(found.loss_at(Criterion::B2w, 0.2).is_some_and(|loss| loss > 1.1));
        assert!((0.2..4.0).contains(&found.l2a) && !found.at_border, "{}", found.l2a);
    }

    #[test]
    fn an_end_of_the_range_is_said_to_be_one() {
        let narrow = Search {
            range: [0.2, 0.8],
            ..search(Criterion::B2w)
        };
        let found = optimum(&scene(&FAR), &narrow).unwrap();
        assert!(found.at_border && found.l2a == 0.8, "{} of {:?}", found.l2a, found.l2a_95);
    }
}
