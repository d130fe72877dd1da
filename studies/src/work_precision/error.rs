//! Why something cannot be measured.

use link::camera::CameraError;
use sim::scene::SceneError;
use sim::view::ViewError;

use crate::monte_carlo::EvaluateError;
use crate::random_scenes::RandomSceneError;
use crate::reach::ReachError;

/// Why something could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum PrecisionError {
    /// A scene is none.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene cannot be seen.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A frame cannot be measured.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// No best ratio is found.
    #[error(transparent)]
    Reach(#[from] ReachError),
    /// No thread can be started.
    #[error("cannot begin a thread: {0}")]
    Thread(#[from] crate::parallel::NoThread),
    /// No camera is like that.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// No panel can be drawn.
    #[error(transparent)]
    RandomScene(#[from] RandomSceneError),
    /// A photograph is none.
    #[error("a photograph that is part of the program is damaged: {0}")]
    Photograph(#[from] image::ImageError),
}
