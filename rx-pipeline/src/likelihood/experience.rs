//! The estimates that a detector keeps from a panel's frames.

use super::crop::Scale;
use super::curve::CurveEvidence;
use super::leds::LedMoments;
use super::level_prior::LevelPrior;
#[cfg(feature = "read-lines")]
use super::lines::LineDelay;

/// The least blur in the conversion of deviations from variance to blur (px).
const BLUR_MIN: f32 = 0.3;
/// The standard deviation of the variance of an LED's disc, which counts as half a pitch wide (pitches²): discs of a third to two thirds of
/// a pitch differ by twice this, as one case of twenty does.
const DISC_UNSURE: f32 = 0.005;

/// The estimates that a detector keeps from a panel's frames. They can be saved and restored, in the same detector or in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    pub(super) levels: LevelPrior,
    /// The pixels to which the levels apply.
    scale: Scale,
    pub(super) leds: LedMoments,
    /// The variance of a single measurement of an LED's light, in contrasts².
    pub(super) light_noise: f32,
    /// Whether the surroundings of the panel are as plain as the ground between its LEDs.
    pub(super) is_plain_around: bool,
    pub(super) curve: CurveEvidence,
    /// The delay of each line relative to the one above, in exposures.
    #[cfg(feature = "read-lines")]
    pub(super) line_delay: LineDelay,
}

impl Experience {
    /// The estimates of the camera's lines alone.
    pub(super) fn of_lines(&self) -> Self {
        Self {
            #[cfg(feature = "read-lines")]
            line_delay: self.line_delay,
            ..Self::NONE
        }
    }

    pub(super) fn forget_levels(&mut self) {
        self.levels = LevelPrior::NONE;
    }

    /// The standard deviation of spots, in px of the frame; `None` before the first frame.
    pub(super) fn spot_sigma_px(&self) -> Option<f32> {
        let levels = self.levels.mean_levels()?;
        Some(self.scale.bin as f32 * libm::sqrtf(levels.variance))
    }

    /// The standard deviation of the blur, in px of the frame, and that of its estimate; `None` before the first frame.
    pub(super) fn blur_px(&self) -> Option<[f32; 2]> {
        let levels = self.levels.mean_levels()?;
        let pixel_px = self.scale.bin as f32;
        let blur = libm::sqrtf((levels.variance - self.scale.sharp_variance()).max(0.0));
        let disc = DISC_UNSURE * self.scale.pitch * self.scale.pitch;
        let variance_unsure = libm::hypotf(self.levels.variance_deviation(), disc);
        let unsure = 0.5 * variance_unsure / blur.max(BLUR_MIN / pixel_px);
        Some([pixel_px * blur, pixel_px * unsure])
    }

    /// Converts the levels to the pixels of another image of the panel.
    pub(super) fn set_scale(&mut self, scale: Scale) {
        if self.levels.frames() > 0 && scale != self.scale {
            self.levels.rescale(&self.scale, &scale);
        }
        self.scale = scale;
    }

    /// No frames yet; all zeros, so that it takes no room in flash.
    pub const NONE: Self = Self {
        levels: LevelPrior::NONE,
        scale: Scale { bin: 0, pitch: 0.0 },
        leds: LedMoments::NONE,
        light_noise: 0.0,
        is_plain_around: false,
        curve: CurveEvidence::NONE,
        #[cfg(feature = "read-lines")]
        line_delay: LineDelay::UNKNOWN,
    };
}
