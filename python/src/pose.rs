//! The pose of a panel, in metres and degrees.

use numpy::PyArray2;
use pyo3::prelude::*;
use rx_pipeline::pose::{self, Estimate};

use crate::arrays;
use crate::record::record;

record! {
    /// The pose of a panel before the camera, with its uncertainty: a sigma is a standard deviation.
    Pose {
        /// Distance of the panel's middle, in metres.
        range_m: f64,
        /// Its standard deviation.
        range_sigma_m: f64,
        /// Angle to the right of the optical axis, in degrees.
        azimuth_deg: f64,
        /// Its standard deviation.
        azimuth_sigma_deg: f64,
        /// Angle above the optical axis (negative below it), in degrees.
        elevation_deg: f64,
        /// Its standard deviation.
        elevation_sigma_deg: f64,
        /// Rotation about the optical axis, in degrees.
        roll_deg: f64,
        /// Its standard deviation.
        roll_sigma_deg: f64,
        /// Rotation about the vertical, in degrees.
        yaw_deg: f64,
        /// Its standard deviation.
        yaw_sigma_deg: f64,
        /// Rotation about the horizontal, in degrees.
        pitch_deg: f64,
        /// Its standard deviation.
        pitch_sigma_deg: f64,
        /// The panel's middle: x right, y down, z forward, in metres.
        translation_m: (f64, f64, f64),
        /// The matrix that maps the panel's axes to the camera's, of shape (3, 3).
        rotation: Py<PyArray2<f64>>,
        /// Covariance of translation (m) and rotation vector (rad), of shape (6, 6).
        covariance: Py<PyArray2<f64>>,
        /// The probability of the other of the two solutions that the image of a plane allows.
        other_probability: f64,
        /// The factor by which covariances exceed those of noise alone.
        inflation: f64,
        /// Closing speed, in m/s, once some frames have shown it.
        closing_speed_m_s: Option<f64>,
        /// Its standard deviation.
        closing_speed_sigma_m_s: Option<f64>,
        /// Time to collision, in seconds, if the panel approaches.
        time_to_collision_s: Option<f64>,
        /// Its standard deviation.
        time_to_collision_sigma_s: Option<f64>,
    }
}

/// A pose with its closing speed and time to collision, if they are known.
pub fn as_record(py: Python<'_>, pose: &pose::Pose, [speed, time]: [Option<Estimate>; 2]) -> Pose {
    let numbers = pose.numbers();
    let degrees = |known: Estimate| (known.value.to_degrees(), known.sigma.to_degrees());
    let (azimuth_deg, azimuth_sigma_deg) = degrees(numbers.azimuth);
    let (elevation_deg, elevation_sigma_deg) = degrees(numbers.elevation);
    let (roll_deg, roll_sigma_deg) = degrees(numbers.roll);
    let (yaw_deg, yaw_sigma_deg) = degrees(numbers.yaw);
    let (pitch_deg, pitch_sigma_deg) = degrees(numbers.pitch);
    let [x, y, z] = pose.translation_m;
    Pose {
        range_m: numbers.range_m.value,
        range_sigma_m: numbers.range_m.sigma,
        azimuth_deg,
        azimuth_sigma_deg,
        elevation_deg,
        elevation_sigma_deg,
        roll_deg,
        roll_sigma_deg,
        yaw_deg,
        yaw_sigma_deg,
        pitch_deg,
        pitch_sigma_deg,
        translation_m: (x, y, z),
        rotation: arrays::rows(py, pose.rotation),
        covariance: arrays::rows(py, pose.covariance),
        other_probability: pose.solutions[1].probability,
        inflation: pose.inflation,
        closing_speed_m_s: speed.map(|known| known.value),
        closing_speed_sigma_m_s: speed.map(|known| known.sigma),
        time_to_collision_s: time.map(|known| known.value),
        time_to_collision_sigma_s: time.map(|known| known.sigma),
    }
}
