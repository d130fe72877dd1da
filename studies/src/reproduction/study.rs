//! The figures' tasks, which are done one by one and stored, so that figures share them and a run can be interrupted and resumed.

use super::axes::{Axes, Extent, PAPERS_DETECTOR};
use super::batches::Batches;
use super::errors::{Dimming, Set};
use super::findings::{Finding, Findings, Task};
use super::operating_point::OperatingPoint;
use super::optima;
use super::pieces::Pieces;
use crate::detectors::DetectorChoice;
use crate::interpolation::interpolated;
use crate::monte_carlo::{EvaluateError, Settings};
use crate::optimum::{FRAMES_MIN, OptimumError, Search};
use crate::statistics::FrameErrors;
use crate::stop::Stop;
use sim::scene::Scene;

/// Bit errors that end a count: the interval of the rate is then a few percent wide.
pub const ERRORS_ENOUGH: u64 = 20_000;
/// The divisor of the frames of a point of figure 22 for detectors other than the paper's.
const DETECTOR_SHARE: u64 = 32;
/// The divisor of a figure's frames for a ratio of the search.
const SEARCH_SHARE: u64 = 5;

/// Why a task failed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A setting cannot be evaluated.
    #[error("{0}: {1}")]
    Evaluate(String, EvaluateError),
    /// There is no best ratio.
    #[error("{0}: {1}")]
    Optimum(String, OptimumError),
}

/// The study of a scene.
#[derive(Clone, Debug)]
pub struct Study {
    /// The scene; its interval, distance and ratio are varied.
    pub scene: Scene,
    /// The seed of all random numbers.
    pub seed: u64,
    /// Frames of a figure, or of a point of figure 22.
    pub frames: u64,
    /// The axes.
    pub axes: Axes,
    /// A search for a best ratio ends early if the 95 % interval is no wider than ± this.
    pub tolerance: f64,
    /// The flag that ends a task early.
    pub stop: Stop,
}

impl Study {
    /// A study of `scene` with that amount of work, with `frames` frames a figure.
    pub fn new(scene: Scene, extent: Extent, frames: u64, seed: u64) -> Self {
        Self {
            scene,
            seed,
            frames,
            axes: Axes::of(extent),
            tolerance: match extent {
                Extent::Figures => 0.02,
                Extent::Quick | Extent::Claims => 0.05,
            },
            stop: Stop::NEVER,
        }
    }

    /// The most frames of a ratio in the search for the best one.
    pub fn search_frames(&self) -> u64 {
        (self.frames / SEARCH_SHARE).max(FRAMES_MIN)
    }

    /// The most frames of one point of figure 22. With the paper's detector they are those of a whole figure, so that the bounds
    /// of rates without errors lie below the rates with some.
    pub fn error_frames(&self, detector: &str) -> u64 {
        if detector == PAPERS_DETECTOR {
            self.frames
        } else {
            self.frames / DETECTOR_SHARE
        }
    }

    /// The settings of figure 14.
    pub fn over_l2a(&self) -> Vec<OperatingPoint> {
        self.axes.l2a.iter().map(|&l2a| OperatingPoint::at_l2a(l2a)).collect()
    }

    /// The settings of figure 17.
    pub fn over_interval(&self) -> Vec<OperatingPoint> {
        let intervals = self.axes.interval.iter();
        intervals.map(|&interval| OperatingPoint::at_interval(interval)).collect()
    }

    /// The settings of figure 20.
    pub fn over_distance(&self) -> Vec<OperatingPoint> {
        let distances_m = self.axes.distance_m.iter();
        distances_m.map(|&distance_m| OperatingPoint::at_distance(distance_m)).collect()
    }

    /// All tasks, each once, in the order of their dependencies.
    pub fn tasks(&self) -> Vec<Task> {
        let points = [self.over_l2a(), self.over_interval(), self.over_distance()];
        let mut tasks: Vec<Task> = Vec::new();
        for task in points.into_iter().flatten().map(Task::Point) {
            if !tasks.contains(&task) {
                tasks.push(task);
            }
        }
        for &interval in &self.axes.optimum_interval {
            let cells = self.axes.optimum_distance_m.iter();
            tasks.extend(cells.map(|&distance_m| Task::Optimum { interval, distance_m }));
        }
        for detector in &self.axes.detectors {
            for &distance_m in &self.axes.error_distance_m {
                tasks.extend([Dimming::Best, Dimming::Random].map(|dimming| Task::Errors {
                    distance_m,
                    dimming,
                    detector: detector.to_string(),
                }));
            }
        }
        tasks
    }

    /// The share of a figure's frames for one of its points.
    pub fn share(&self, points: usize) -> u64 {
        self.frames.div_ceil(points.max(1) as u64)
    }

    /// Does a task; `known` holds the results of the tasks before it. `None` if [`Study::stop`] ended it.
    ///
    /// # Errors
    /// If the scene cannot be seen or measured at the task's setting.
    pub fn perform(&self, task: &Task, known: &Findings) -> Result<Option<Finding>, StudyError> {
        self.perform_on(task, known, &mut Pieces::default(), |_| {})
    }

    /// As [`Study::perform`], continued from the finished pieces of the task, to which it adds; calls `tell` with them from time to time.
    ///
    /// # Errors
    /// As [`Study::perform`].
    pub fn perform_on(
        &self,
        task: &Task,
        known: &Findings,
        pieces: &mut Pieces,
        tell: impl FnMut(&Pieces),
    ) -> Result<Option<Finding>, StudyError> {
        let fault = |error| match error {
            EvaluateError::Stopped => None,
            error => Some(StudyError::Evaluate(task.to_string(), error)),
        };
        let found = match task {
            Task::Point(setting) => self.measure(*setting, pieces, tell).map(Finding::Point).map_err(fault),
            Task::Optimum { interval, distance_m } => {
                let search = Search {
                    frames: self.search_frames(),
                    tolerance: self.tolerance,
                    seed: self.seed,
                    stop: self.stop,
                    ..Search::default()
                };
                optima::find(&self.scene, *interval, *distance_m, &search, pieces, tell)
                    .map(Finding::Optimum)
                    .map_err(|error| match error {
                        OptimumError::Interrupted => None,
                        error => Some(StudyError::Optimum(task.to_string(), error)),
                    })
            }
            Task::Errors {
                distance_m,
                dimming,
                detector,
            } => self
                .count(*distance_m, *dimming, detector, known, pieces, tell)
                .map(|errors| Finding::Errors(Box::new(errors)))
                .map_err(fault),
        };
        found.map_or_else(|fault| fault.map_or(Ok(None), Err), |found| Ok(Some(found)))
    }

    fn measure(&self, setting: OperatingPoint, pieces: &mut Pieces, tell: impl FnMut(&Pieces)) -> Result<Batches, EvaluateError> {
        let figures = [self.over_l2a(), self.over_interval(), self.over_distance()];
        let holding = figures.iter().filter(|settings| settings.contains(&setting));
        let frames = holding.map(|settings| self.share(settings.len())).max();
        let frames = frames.unwrap_or(0);
        let scene = setting.scene(&self.scene);
        Batches::measure_on(&scene, frames, self.seed, self.stop, pieces, tell)
    }

    fn count(
        &self,
        distance_m: f64,
        dimming: Dimming,
        detector: &str,
        known: &Findings,
        pieces: &mut Pieces,
        tell: impl FnMut(&Pieces),
    ) -> Result<FrameErrors, EvaluateError> {
        let (intervals, means): (Vec<f64>, Vec<f64>) = self.mean_optima(known).into_iter().unzip();
        let set = Set {
            scene: &self.scene,
            distance_m,
            dimming,
            best: |interval| interpolated(&intervals, &means, interval),
            learnt_at: self.axes.learnt_at,
        };
        let choice = detector.parse().unwrap_or(DetectorChoice::Best);
        let settings = Settings {
            stop: self.stop,
            ..Settings::fast(self.error_frames(detector), self.seed, choice)
        };
        set.count(settings, ERRORS_ENOUGH, pieces, tell)
    }

    /// For each finished interval of figure 21: the mean of the best ratio over the distances (figure 21b).
    pub fn mean_optima(&self, findings: &Findings) -> Vec<(f64, f64)> {
        let mean = |&interval: &f64| {
            let ratios = self
                .axes
                .optimum_distance_m
                .iter()
                .map(|&distance_m| Some(findings.optimum(interval, distance_m)?.l2a.value))
                .collect::<Option<Vec<f64>>>()?;
            Some((interval, ratios.iter().sum::<f64>() / ratios.len() as f64))
        };
        self.axes.optimum_interval.iter().filter_map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::reproduction::Extent;

    #[test]
    fn a_task_that_was_ended_goes_on_from_its_pieces() {
        static ASKED: AtomicBool = AtomicBool::new(false);
        let scene = Scene::load("paper", &["panel.interval=0.5".into()]).unwrap();
        let whole = Study::new(scene, Extent::Claims, 60_000, 1);
        let ended = Study {
            stop: Stop::at(&ASKED),
            ..whole.clone()
        };
        let (interval, distance_m) = (0.5, 70.0);
        let tasks = [
            Task::Point(OperatingPoint::REFERENCE),
            Task::Optimum { interval, distance_m },
            Task::Errors {
                distance_m,
                dimming: Dimming::Random,
                detector: PAPERS_DETECTOR.into(),
            },
        ];
        for task in tasks {
            let known = Findings::default();
            let mut pieces = Pieces::default();
            let found = ended.perform_on(&task, &known, &mut pieces, |_| {
                ASKED.store(true, Ordering::Relaxed);
            });
            ASKED.store(false, Ordering::Relaxed);
            assert!(matches!(found, Ok(None)), "{task}");
            // In the file format.
            let text = serde_json::to_string(&pieces).unwrap();
            let mut pieces = serde_json::from_str(&text).unwrap();
            let (mut all, mut left) = (0, 0);
            let found = whole.perform_on(&task, &known, &mut pieces, |_| left += 1);
            let at_once = whole.perform_on(&task, &known, &mut Pieces::default(), |_| all += 1);
            assert_eq!(found.unwrap(), at_once.unwrap(), "{task}");
            // The pieces of a search are reported again, because they cost nothing.
            let searched = matches!(task, Task::Optimum { .. });
            assert_eq!(left, if searched { all } else { all - 1 }, "{task}");
        }
    }
}
