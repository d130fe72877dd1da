//! What a receiver has learnt of the camera it looks through, and of the panel that it looks at.

use link::camera::Camera;

/// What a panel's frames have told.
///
/// Given back as [`ReceiverSettings::camera`](crate::receiver::ReceiverSettings::camera), the camera is what the next receiver begins with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learnt {
    /// The camera: what the frames say of it, and what was told of the rest. A near panel is read in larger pixels, which say nothing of
    /// its curve and its blur.
    pub camera: Camera,
    /// The camera as the panel's pixels show it now: in larger ones, curve and blur are those that explain what is seen in them.
    pub seen: Camera,
    /// The standard deviation of [`Camera::blur_sigma_px`], in pixels; none where the blur is the one that was told.
    pub blur_deviation_px: Option<f32>,
    /// The standard deviation of a pixel of middle grey from what is expected of it, in grey levels: the sensor's noise, and whatever the
    /// model leaves unexplained.
    pub noise_grey: f32,
    /// By how much of an exposure each line is later than the one above it: negative where lines are read from below, 0 where all are
    /// exposed at once; none before exposures that caught two symbols have told. The time of a line over that of the exposure, so that it
    /// follows the exposure.
    #[cfg(feature = "read-lines")]
    pub line_delay: Option<f32>,
    /// LEDs that do not follow the message, bit 8·row + column each: dead, stuck, or far too dim. They are read as erased.
    pub broken: u64,
    /// Frames that this was learnt from, 64 at most: older ones are forgotten.
    pub frames: u32,
}
