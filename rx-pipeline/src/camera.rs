//! The receiver's estimates of its camera and of the panel.

use link::camera::Camera;

/// The camera and the panel's defects, estimated from a panel's frames.
///
/// Pass the camera to the next receiver as [`ReceiverSettings::camera`](crate::receiver::ReceiverSettings::camera).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraEstimate {
    /// The camera: estimates from the frames, and the configured values elsewhere. A near panel is read in larger pixels, which do not show
    /// the camera's curve and blur.
    pub camera: Camera,
    /// The camera of the pixels that the panel is read in now. In larger pixels, curve and blur are those that explain these pixels.
    pub seen: Camera,
    /// The standard deviation of [`Camera::blur_sigma_px`], in pixels; `None` if the blur is the configured one.
    pub blur_deviation_px: Option<f32>,
    /// The standard deviation of a middle-grey pixel about the model, in grey levels: sensor noise and model error.
    pub noise_grey: f32,
    /// The delay between neighbouring lines, in exposures, so that it follows the exposure: negative if the camera reads from below, 0 if
    /// it exposes all lines at once; `None` until an exposure has caught two symbols.
    #[cfg(feature = "read-lines")]
    pub line_delay: Option<f32>,
    /// LEDs that do not follow the message, bit 8·row + column each: dead, stuck, or far too dim. They are read as erasures.
    pub broken: u64,
    /// Frames behind these estimates, at most 64, because older frames are forgotten.
    pub frames: u32,
}
