//! The tasks behind figures and claims, and their results.

use serde::{Deserialize, Serialize};

use super::batches::Batches;
use super::errors::Dimming;
use super::operating_point::OperatingPoint;
use super::optima::BestRatio;
use crate::statistics::FrameErrors;

/// A unit of work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// The features at a setting.
    Point(OperatingPoint),
    /// The best ratio at an interval and a distance.
    Optimum {
        /// The interval.
        interval: f64,
        /// The distance in metres.
        distance_m: f64,
    },
    /// The bit errors at a distance.
    Errors {
        /// The distance in metres.
        distance_m: f64,
        /// The dimming of the panel.
        dimming: Dimming,
        /// The detector's name.
        detector: String,
    },
}

impl std::fmt::Display for Task {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Point(at) => write!(f, "interval {}, {} m, L2A {}", at.interval, at.distance_m, at.l2a),
            Self::Optimum { interval, distance_m } => write!(f, "best L2A at interval {interval}, {distance_m} m"),
            Self::Errors {
                distance_m,
                dimming,
                detector,
            } => write!(f, "bit errors of {detector} at {distance_m} m, {dimming:?} L2A"),
        }
    }
}

/// The result of a task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Finding {
    /// The result of [`Task::Point`].
    Point(Batches),
    /// The result of [`Task::Optimum`].
    Optimum(BestRatio),
    /// The result of [`Task::Errors`].
    Errors(Box<FrameErrors>),
}

/// The results so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Findings(Vec<(Task, Finding)>);

impl Findings {
    /// Stores a task's result.
    pub fn keep(&mut self, task: Task, finding: Finding) {
        self.0.push((task, finding));
    }

    /// The result of `task`.
    pub fn of(&self, task: &Task) -> Option<&Finding> {
        self.0.iter().find(|(done, _)| done == task).map(|(_, finding)| finding)
    }

    /// The features at a setting.
    pub fn point(&self, setting: OperatingPoint) -> Option<&Batches> {
        match self.of(&Task::Point(setting))? {
            Finding::Point(point) => Some(point),
            _ => None,
        }
    }

    /// The best ratio at an interval and a distance.
    pub fn optimum(&self, interval: f64, distance_m: f64) -> Option<&BestRatio> {
        let task = Task::Optimum { interval, distance_m };
        match self.of(&task)? {
            Finding::Optimum(best) => Some(best),
            _ => None,
        }
    }

    /// The bit errors at a distance.
    pub fn errors(&self, distance_m: f64, dimming: Dimming, detector: &str) -> Option<&FrameErrors> {
        let task = Task::Errors {
            distance_m,
            dimming,
            detector: detector.into(),
        };
        match self.of(&task)? {
            Finding::Errors(errors) => Some(errors),
            _ => None,
        }
    }
}
