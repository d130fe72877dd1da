//! Which frames teach, and what was learnt when bits were sure.
//!
//! A wiper, a lamp that dips or an exposure that is far too short leaves frames at the panel's place that do not show it. They are hardly
//! noisy, and all LEDs Off explain them well: what is learnt from them makes all later bits wrong. A frame teaches only where the contrast
//! is near what it was. Exposures that jump change the light of LEDs and background alike, and so hardly that.

use super::experience::Experience;
use super::level_prior::FRAMES_MIN;
use super::levels::Levels;

/// A panel that shows less of its contrast is covered or dark (share of the usual). Higher: a panel behind a dirty screen is not read.
const COVERED: f32 = 0.25;
/// A frame teaches that shows so much of it, at least (share of the usual). Lower: a wiper's edge teaches.
const TEACHES: f32 = 0.5;
/// How much less light leaves the contrast what it is (factor): exposures jump by two stops.
const DARKER: f32 = 4.0;
/// After so many frames of less contrast in a row, all of sure bits, that contrast is the usual one (frames). Fewer: slow wipers teach.
const FAINTER_FRAMES: u32 = 16;
/// Bits are unsure where they are less sure than usual by this (probability that one is right). Less: noise raises doubts.
const LESS_SURE: f32 = 0.1;
/// What was learnt is doubted after so many unsure frames in a row, and again after twice as many (frames).
const UNSURE_FRAMES: u32 = 3;
/// How sure bits are is averaged over about so many frames (count).
const MEMORY_FRAMES: f32 = 8.0;

/// What was learnt when bits were sure, and how frames compare with that.
pub(super) struct Proven {
    /// What the last sure frame was read by.
    experience: Experience,
    /// How sure bits were of late in frames that teach (probability that one is right).
    confidence: f32,
    /// Sure frames in a row of less contrast.
    fainter: u32,
    /// Unsure frames in a row.
    unsure: u32,
}

impl Proven {
    /// That of one who has seen no frame; all zeros.
    pub const NONE: Self = Self {
        experience: Experience::NONE,
        confidence: 0.0,
        fainter: 0,
        unsure: 0,
    };

    /// What the last sure frame was read by.
    pub const fn experience(&self) -> Experience {
        self.experience
    }

    /// Goes on in other pixels, in which levels are others.
    pub fn forget_levels(&mut self) {
        self.experience.forget_levels();
    }

    /// How much of the usual contrast `levels` show, from 0 on; 1 where that is not known well.
    pub fn contrast_shown(&self, levels: &Levels) -> f32 {
        let prior = &self.experience.levels;
        let usual = prior.mean_levels().filter(|_| prior.is_sure() && prior.frames() >= FRAMES_MIN);
        usual.map_or(1.0, |usual| {
            let modulation = levels.modulation() / usual.modulation();
            let light = levels.peak() / usual.peak();
            modulation.min(DARKER * light)
        })
    }

    /// Whether a frame that shows so much of the usual contrast shows the panel at all.
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

    /// A frame that teaches was read by `experience`, and its bits are as sure as that.
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

    /// Whether bits as sure as that raise a doubt in what was learnt.
    pub fn doubts(&mut self, confidence: f32) -> bool {
        if confidence >= self.confidence - LESS_SURE {
            self.unsure = 0;
            return false;
        }
        self.unsure = self.unsure.saturating_add(1);
        self.unsure.is_multiple_of(UNSURE_FRAMES) && (self.unsure / UNSURE_FRAMES).is_power_of_two()
    }
}
