//! Why a scene cannot be seen.

use crate::l2a::L2aError;
use crate::scene::RangeError;

/// The least depth of any part of a panel.
pub(crate) const DEPTH_MIN_M: f64 = 0.1;
/// The least distance of neighbouring LEDs in the image.
pub(crate) const PITCH_MIN_PX: f64 = 1.0;

/// Why a scene cannot be seen.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// A key has a forbidden value.
    #[error(transparent)]
    OutOfRange(#[from] Box<RangeError>),
    /// An LED is behind the camera, or nearly beside it.
    #[error(
        "panel {panel} reaches to {depth_m} m before the camera: \
         all of it must be at least {DEPTH_MIN_M} m in front; raise pose.distance_m or turn it less"
    )]
    Behind {
        /// Index of the panel.
        panel: usize,
        /// Depth of its nearest corner.
        depth_m: f64,
    },
    /// The panel's image is not wholly on the sensor.
    #[error(
        "panel {panel} spans columns {left:.1} to {right:.1} and rows {top:.1} to {bottom:.1} px: \
         the sensor has {width} × {height}; move it nearer to the axis or farther away"
    )]
    OffSensor {
        /// Index of the panel.
        panel: usize,
        /// Its leftmost point.
        left: f64,
        /// Its rightmost point.
        right: f64,
        /// Its topmost point.
        top: f64,
        /// Its lowest point.
        bottom: f64,
        /// Columns of the sensor.
        width: usize,
        /// Rows of the sensor.
        height: usize,
    },
    /// The lens model does not hold at the panel's position.
    #[error(
        "panel {panel} reaches {radius:.3} focal lengths from the axis, where camera.distortion_k1 = {k1} folds the image over: \
         with it, up to {most:.3} make sense; bring k1 nearer to 0, or the panel to the axis"
    )]
    Folded {
        /// Index of the panel.
        panel: usize,
        /// The image radius of its farthest point without distortion, in focal lengths.
        radius: f64,
        /// The distortion.
        k1: f64,
        /// The limit of the model's radius.
        most: f64,
    },
    /// The panel's LEDs are too close together in the image.
    #[error(
        "panel {panel}: its LEDs are {pitch_px:.2} px apart in the image, \
         at least {PITCH_MIN_PX} px are needed; lower pose.distance_m or raise panel.interval"
    )]
    TooSmall {
        /// Index of the panel.
        panel: usize,
        /// Distance of neighbouring LEDs in the image.
        pitch_px: f64,
    },
    /// The L2A table cannot be used.
    #[error(transparent)]
    Table(#[from] L2aError),
    /// The background photograph cannot be used.
    #[error("ambient.background_image {path:?}: {why}; give a PNG, JPEG or PGM file")]
    Background {
        /// The file.
        path: String,
        /// The cause.
        why: String,
    },
}
