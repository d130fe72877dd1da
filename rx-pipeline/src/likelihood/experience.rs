//! What earlier frames have shown of the levels.

use super::levels::Levels;

/// Means and variances of a panel's levels over its last frames, which make the next frame's levels surer.
///
/// Blur, noise and brightness hardly change from frame to frame. What a receiver has learnt of them can be taken out, kept
/// and given back, to it or to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    /// Background, Off, contrast, variance of the spots.
    mean: [f32; 4],
    variance: [f32; 4],
    noise: f32,
    frames: u32,
    misfits: u32,
}

/// Levels are averaged over about this many frames.
const MEMORY_FRAMES: u32 = 32;
/// After so many misfitting frames in a row all is forgotten.
const MISFITS_MAX: u32 = 4;
/// A frame fits if its noise is at most so many times what it was.
const NOISIER: f32 = 1.3;
/// The least deviations that are allowed for, relatively (those of Off light in terms of the contrast): always, and those that
/// shrink with the number of frames.
const LEAST_SPREAD: [f32; 4] = [0.01, 0.02, 0.02, 0.01];
const FIRST_SPREAD: [f32; 4] = [0.1, 0.3, 0.3, 0.1];
/// After so many frames the noise is known.
const FRAMES_MIN: u32 = 4;
/// Levels known to this part of the contrast are a better start than what the frame itself says.
const SURE: f32 = 0.1;

impl Experience {
    /// None.
    pub const NONE: Self = Self {
        mean: [0.0; 4],
        variance: [0.0; 4],
        noise: 0.0,
        frames: 0,
        misfits: 0,
    };

    pub(super) fn levels(&self) -> Option<Levels> {
        let [background, off, contrast, variance] = self.mean;
        (self.frames > 0).then_some(Levels {
            background,
            off,
            contrast,
            variance,
            noise: self.noise,
        })
    }

    /// The levels, if they are known well enough to begin a search with.
    pub(super) fn sure_levels(&self) -> Option<Levels> {
        self.levels().filter(|levels| {
            [1, 2]
                .into_iter()
                .all(|i| self.variance[i] < (SURE * levels.contrast) * (SURE * levels.contrast))
        })
    }

    /// Whether a frame of that noise may be of the same panel in the same light.
    pub(super) fn fits(&self, noise: f32) -> bool {
        self.frames < FRAMES_MIN || noise <= NOISIER * self.noise
    }

    /// Whether it certainly may, as there is something to compare it with.
    pub(super) fn fits_surely(&self, noise: f32) -> bool {
        self.frames >= FRAMES_MIN && self.fits(noise)
    }

    /// Mean and variance of each level.
    pub(super) fn priors(&self) -> impl Iterator<Item = (f32, f32)> {
        let known = if self.frames > 0 { self.mean.len() } else { 0 };
        self.mean.into_iter().zip(self.variance).take(known)
    }

    /// Takes in a frame's levels.
    pub(super) fn learn(&mut self, levels: &Levels) {
        if !self.fits(levels.noise) {
            self.misfits += 1;
            if self.misfits > MISFITS_MAX {
                *self = Self::NONE;
            }
            return;
        }
        if levels.noise * NOISIER < self.noise {
            // Whatever was learnt before was learnt from a worse fit.
            *self = Self::NONE;
        }
        self.misfits = 0;
        self.frames = (self.frames + 1).min(MEMORY_FRAMES);
        let gain = 1.0 / self.frames as f32;
        for (i, value) in levels.values().into_iter().enumerate() {
            let difference = value - self.mean[i];
            self.mean[i] += gain * difference;
            self.variance[i] = (1.0 - gain) * (self.variance[i] + gain * difference * difference);
        }
        self.noise += gain * (levels.noise - self.noise);
        let scale = [self.mean[0], self.mean[2], self.mean[2], self.mean[3]];
        for (i, variance) in self.variance.iter_mut().enumerate() {
            let least = (LEAST_SPREAD[i] + FIRST_SPREAD[i] * gain) * scale[i];
            *variance = variance.max(least * least);
        }
    }
}
