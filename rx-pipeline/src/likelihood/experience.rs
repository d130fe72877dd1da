//! What a detector has learnt from a panel's frames.

use super::crop::Scale;
use super::curve::CurveEvidence;
use super::leds::LedMoments;
use super::level_prior::LevelPrior;
#[cfg(feature = "read-lines")]
use super::lines::LineDelay;

/// The least blur by which its deviation is reckoned from that of the spots' variance (px).
const BLUR_MIN: f32 = 0.3;
/// How far the variance of an LED's disc, which counts as half a pitch wide, may be off (standard deviation, in pitches²): discs of a third
/// to two thirds of a pitch are as far off, twice this in one case of twenty.
const DISC_UNSURE: f32 = 0.005;

/// What a detector has learnt from a panel's frames. It can be taken out, kept and given back, to the same detector or to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    pub(super) levels: LevelPrior,
    /// The pixels in which the levels hold.
    scale: Scale,
    pub(super) leds: LedMoments,
    /// The variance of an LED's light as measured once, in contrasts².
    pub(super) light_noise: f32,
    /// Whether what stands around the panel is as plain as what is between its LEDs.
    pub(super) is_plain_around: bool,
    pub(super) curve: CurveEvidence,
    /// By how much of an exposure each line is later than the one above it.
    #[cfg(feature = "read-lines")]
    pub(super) line_delay: LineDelay,
}

impl Experience {
    /// What tells of the camera's lines alone.
    pub(super) fn of_lines(&self) -> Self {
        Self {
            #[cfg(feature = "read-lines")]
            line_delay: self.line_delay,
            ..Self::NONE
        }
    }

    /// Goes on with levels of which nothing is known.
    pub(super) fn forget_levels(&mut self) {
        self.levels = LevelPrior::NONE;
    }

    /// The standard deviation of spots, in px of the frame; none before the first frame.
    pub(super) fn spot_sigma_px(&self) -> Option<f32> {
        let levels = self.levels.mean_levels()?;
        Some(self.scale.bin as f32 * libm::sqrtf(levels.variance))
    }

    /// The standard deviation of the blur, in px of the frame, and that of its estimate; none before the first frame.
    pub(super) fn blur_px(&self) -> Option<[f32; 2]> {
        let levels = self.levels.mean_levels()?;
        let pixel_px = self.scale.bin as f32;
        let blur = libm::sqrtf((levels.variance - self.scale.sharp_variance()).max(0.0));
        let disc = DISC_UNSURE * self.scale.pitch * self.scale.pitch;
        let variance_unsure = libm::hypotf(self.levels.variance_deviation(), disc);
        let unsure = 0.5 * variance_unsure / blur.max(BLUR_MIN / pixel_px);
        Some([pixel_px * blur, pixel_px * unsure])
    }

    /// Goes on in the pixels of another image of the panel.
    pub(super) fn set_scale(&mut self, scale: Scale) {
        if self.levels.frames() > 0 && scale != self.scale {
            self.levels.rescale(&self.scale, &scale);
        }
        self.scale = scale;
    }

    /// That of one who has seen no frame; all zeros, so that it takes no room in flash.
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
