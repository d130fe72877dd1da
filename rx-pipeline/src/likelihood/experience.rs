//! What a detector has learnt from a panel's frames.

use super::leds::LedMoments;
use super::level_prior::LevelPrior;

/// What a detector has learnt from a panel's frames. It can be taken out, kept and given back, to the same detector or to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    pub(super) levels: LevelPrior,
    /// Frame pixels along a side of an image pixel, for which the levels hold.
    pub(super) bin: usize,
    pub(super) leds: LedMoments,
    /// The variance of an LED's light as measured once, in contrasts².
    pub(super) light_noise: f32,
    /// Whether what stands around the panel is as plain as what is between its LEDs.
    pub(super) is_plain_around: bool,
}

impl Experience {
    /// The standard deviation of spots, in px of the frame; none before the first frame.
    pub(super) fn spot_sigma_px(&self) -> Option<f32> {
        let levels = self.levels.mean_levels()?;
        Some(self.bin as f32 * libm::sqrtf(levels.variance))
    }

    /// Goes on in image pixels that are so many frame pixels wide.
    pub(super) fn set_bin(&mut self, bin: usize) {
        if bin != self.bin {
            self.levels.rescale(self.bin as f32 / bin as f32);
            self.bin = bin;
        }
    }

    /// That of one who has seen no frame.
    pub const NONE: Self = Self {
        levels: LevelPrior::NONE,
        bin: 1,
        leds: LedMoments::NONE,
        light_noise: 0.0,
        is_plain_around: false,
    };
}
