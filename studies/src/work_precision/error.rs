//! The errors of a measurement.

use link::camera::CameraError;
use rx_pipeline::settings::SettingError;
use sim::scene::SceneError;
use sim::view::ViewError;

use crate::monte_carlo::EvaluateError;
use crate::random_scenes::RandomSceneError;
use crate::reach::ReachError;

/// Why a measurement failed.
#[derive(Debug, thiserror::Error)]
pub enum PrecisionError {
    /// A scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A frame cannot be measured.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// There is no best ratio.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// No thread can be started.
    #[error("cannot begin a thread: {0}")]
    Thread(#[from] crate::parallel::NoThread),
    /// A setting of the receiver is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A camera is invalid.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// No panel can be drawn.
    #[error(transparent)]
    RandomScene(#[from] RandomSceneError),
    /// A photograph is invalid.
    #[error("a photograph that is part of the program is damaged: {0}")]
    Photograph(#[from] image::ImageError),
}
