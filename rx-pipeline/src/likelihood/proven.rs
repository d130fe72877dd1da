//! Selection of the frames that teach, and the estimates of the last sure frame.
//!
//! Frames that do not show the panel at its place come from a wiper, a lamp that dips, or an exposure that is far too short. They are
//! hardly noisy, and all LEDs Off explain them well: estimates from them would make all later bits wrong. A frame is learnt from only if
//! its contrast is near the earlier one. The contrast hardly depends on exposures that jump, because these change LEDs and background
//! alike.

use super::experience::Experience;
use super::level_prior::FRAMES_MIN;
use super::levels::Levels;

/// Maximum contrast of a panel that is covered or dark (share of the usual). Higher: a panel behind a dirty screen is not read.
const COVERED: f32 = 0.25;
/// Minimum contrast of a frame that teaches (share of the usual). Lower: a wiper's edge teaches.
const TEACHES: f32 = 0.5;
/// Maximum drop of light that does not count as a loss of contrast (factor): exposures jump by two stops.
const DARKER: f32 = 4.0;
/// After this many frames of less contrast in a row, all of sure bits, that contrast is the usual one (frames). Fewer: slow wipers teach.
const FAINTER_FRAMES: u32 = 16;
/// Bits are unsure if their confidence is below the usual one by this (probability that one is right). Less: noise raises doubts.
const LESS_SURE: f32 = 0.1;
/// Unsure frames in a row before the estimates are doubted, and again after twice as many (frames).
const UNSURE_FRAMES: u32 = 3;
/// The average confidence spans about this many frames (count).
const MEMORY_FRAMES: f32 = 8.0;

/// The estimates of the last sure frame, and the comparison of frames with them.
pub(super) struct ProvenEstimates {
    /// The estimates at the last sure frame.
    experience: Experience,
    /// The recent confidence of frames that teach (probability that a bit is right).
    confidence: f32,
    /// Sure frames in a row of less contrast.
    fainter: u32,
    /// Unsure frames in a row.
    unsure: u32,
}

impl ProvenEstimates {
    /// No frames yet; all zeros.
    pub const NONE: Self = Self {
        experience: Experience::NONE,
        confidence: 0.0,
        fainter: 0,
        unsure: 0,
    };

    /// The estimates at the last sure frame.
    pub const fn experience(&self) -> Experience {
        self.experience
    }

    /// Forgets the levels, after a change of pixels.
    pub fn forget_levels(&mut self) {
        self.experience.forget_levels();
    }

    /// The contrast of `levels` relative to the usual one, from 0 on; 1 if that is not well known.
    pub fn contrast_shown(&self, levels: &Levels) -> f32 {
        let prior = &self.experience.levels;
        let usual = prior.mean_levels().filter(|_| prior.is_sure() && prior.frames() >= FRAMES_MIN);
        usual.map_or(1.0, |usual| {
            let modulation = levels.modulation() / usual.modulation();
            let light = levels.peak() / usual.peak();
            modulation.min(DARKER * light)
        })
    }

    /// Whether a frame of that contrast does not show the panel.
    pub fn is_covered(contrast_shown: f32) -> bool {
        contrast_shown < COVERED
    }

    /// Whether a frame of sure bits teaches.
    pub fn teaches(&mut self, contrast_shown: f32) -> bool {
        self.fainter = if contrast_shown >= TEACHES { 0 } else { self.fainter + 1 };
        if self.fainter > FAINTER_FRAMES {
            *self = Self::NONE;
        }
        self.fainter == 0
    }

    /// Adds a frame that teaches: its estimates, and the confidence of its bits.
    pub fn read_by(&mut self, experience: &Experience, confidence: f32) {
        if confidence < self.confidence - LESS_SURE {
            return;
        }
        self.confidence += (confidence - self.confidence) / MEMORY_FRAMES;
        let frames = |experience: &Experience| experience.levels.frames().min(FRAMES_MIN);
        if frames(experience) >= frames(&self.experience) {
            self.experience = *experience;
        }
    }

    /// Whether bits with that confidence raise a doubt in the estimates.
    pub fn doubts(&mut self, confidence: f32) -> bool {
        if confidence >= self.confidence - LESS_SURE {
            self.unsure = 0;
            return false;
        }
        self.unsure = self.unsure.saturating_add(1);
        self.unsure.is_multiple_of(UNSURE_FRAMES) && (self.unsure / UNSURE_FRAMES).is_power_of_two()
    }
}
