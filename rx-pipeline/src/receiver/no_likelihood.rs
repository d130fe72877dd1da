//! Placeholder of maximum likelihood in programs that leave it out; it takes no memory.

use crate::camera::CameraEstimate;
use crate::corners::Corners;
use crate::detect::{DetectError, Detection};
use crate::frame::Frame;
use crate::settings::LikelihoodSettings;
use link::camera::Camera;
use link::panel::SoftPanel;

/// Not a detector. Without the feature, no receiver uses maximum likelihood, so it is never called.
pub(crate) struct MaximumLikelihood<const PIXELS: usize>;

/// The placeholder of the learnt state.
pub(crate) struct NoExperience;

impl<const PIXELS: usize> MaximumLikelihood<PIXELS> {
    pub const fn empty() -> Self {
        Self
    }

    pub fn prepare_with(&mut self, _: Camera, _: LikelihoodSettings) {}

    pub fn go_on_in_pixels(&mut self, _: usize, _: f32) {}

    pub fn forget_leds(&mut self) {}

    pub fn experience(&self) -> NoExperience {
        NoExperience
    }

    pub fn set_experience(&mut self, _: NoExperience) {}

    pub fn learnt(&self) -> Option<CameraEstimate> {
        None
    }

    #[cfg(feature = "read-lines")]
    pub fn set_line_delay(&mut self, _: f32) {}

    pub fn detect_after(&mut self, _: &SoftPanel, _: &Frame<'_>, _: &Corners, _: Option<f32>) -> Result<Detection, DetectError> {
        Err(DetectError::ContrastTooLow { range_grey: 0.0 })
    }
}
