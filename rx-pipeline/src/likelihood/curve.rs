//! The camera's encoding curve, estimated from frames.
//!
//! Under the right curve, and under no other, light adds up where LEDs overlap, all On LEDs are alike, and the noise of electrons grows
//! with the root of light: the model then leaves the least residuals. Curves are compared by the likelihood of the grey levels themselves,
//! which is that of their root light times its slope (Box & Cox 1964). An isolated spot does not determine the curve, because a Gaussian to
//! a power is a Gaussian of another width.
//!
//! The errors of codecs and filters do not grow with light as a sensor's noise does. So expected and observed light are also compared in a
//! unit that does not depend on the curve, and a curve with clearly larger residuals in that unit is rejected.

use super::crop::Crop;
use super::estimate::{Estimate, hard};
use super::image::root;
use super::level_prior::LevelPrior;
use super::levels::Levels;
use super::model::Model;
use crate::frame::Frame;
use crate::spots::RootMetric;
use link::camera::{Camera, Encoding};

/// The exponents to try. More: a curve is learnt later, and neighbouring curves are hard to distinguish and change few bits.
const GAMMAS: [f32; 5] = [1.0, 1.4, 1.8, 2.2, 2.6];
/// Fits of the levels under another curve (count). Fewer: faster, and other curves look worse than they are.
const FITS: usize = 2;
/// Trials of each curve before the best one is tried again (frames). Fewer: chance selects a wrong one.
const FIRST_FRAMES: u32 = 2;
/// Trials of a curve before it can be accepted, at least (frames).
const FRAMES_MIN: u32 = 3;
/// Minimum gain of an accepted curve, in its own standard deviations. Higher: curves are learnt later; lower: by chance.
const DEVIATIONS: f32 = 4.0;
/// Maximum loss of a better curve in the common unit (share of its gain). Higher: errors of a codec or filter select a curve.
const LOSS_MAX: f32 = 0.2;
/// A curve is given up if frames are less likely under it by this (nats).
const GIVEN_UP: f32 = 32.0;

/// Evidence for curves other than the current one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurveEvidence {
    /// The exponent of the best curve; 0 if that is the configured one.
    gamma: f32,
    /// Frames under another curve.
    frames: u32,
    others: [Tally; GAMMAS.len()],
}

/// The gain of log-likelihood under a curve, summed over frames, in nats.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tally {
    frames: u32,
    sum: f32,
    squares: f32,
    /// The sum of the gains in the common unit.
    sum_of_expected: f32,
}

impl Tally {
    const NONE: Self = Self {
        frames: 0,
        sum: 0.0,
        squares: 0.0,
        sum_of_expected: 0.0,
    };

    fn add(&mut self, gain: &Gain) {
        self.frames += 1;
        self.sum += gain.likelihood;
        self.squares += gain.likelihood * gain.likelihood;
        self.sum_of_expected += gain.expected;
    }

    /// The mean gain of a frame, as far as it is known.
    fn promise(&self) -> f32 {
        if self.frames < FIRST_FRAMES {
            f32::INFINITY
        } else {
            self.sum / self.frames as f32
        }
    }

    /// Whether the gain is significant.
    fn is_better(&self) -> bool {
        if self.frames < FRAMES_MIN || self.sum <= 0.0 {
            return false;
        }
        let (frames, mean) = (self.frames as f32, self.promise());
        // The variance of such a difference of log-likelihoods is twice its mean if it is due to noise alone.
        let variance = ((self.squares - mean * self.sum) / (frames - 1.0)).max(2.0 * mean);
        self.sum * self.sum > DEVIATIONS * DEVIATIONS * variance * frames && self.sum_of_expected > -LOSS_MAX * self.sum
    }
}

/// The gain of one frame.
pub(super) struct Gain {
    likelihood: f32,
    /// The gain in the unit of the curve so far.
    expected: f32,
    /// The levels of the frame under the curve so far, and under the other one.
    pub levels: [Levels; 2],
}

impl CurveEvidence {
    /// No frames yet; all zeros.
    pub const NONE: Self = Self {
        gamma: 0.0,
        frames: 0,
        others: [Tally::NONE; GAMMAS.len()],
    };

    /// The curve that explains the frames best so far.
    pub fn encoding(&self, configured: Encoding) -> Encoding {
        if self.gamma > 0.0 {
            Encoding::Gamma(self.gamma)
        } else {
            configured
        }
    }

    /// The number of the curve to try next: one hardly tried yet, or the best so far; `None` after `most_frames` with other curves.
    pub fn next(&self, now: Encoding, most_frames: u32) -> Option<usize> {
        let promise = |i: usize| self.others[i].promise();
        let open = self.open(now).max_by(|&a, &b| promise(a).total_cmp(&promise(b)));
        open.filter(|_| self.frames < most_frames)
    }

    /// Adds a frame's gain under another curve. Changes to that curve if it is significantly better, and returns whether it did.
    pub fn update(&mut self, now: Encoding, tried: usize, gain: &Gain, most_frames: u32) -> bool {
        self.frames += 1;
        self.others[tried].add(gain);
        let goes_over = self.others[tried].is_better() && self.next(now, most_frames) == Some(tried);
        if goes_over {
            self.gamma = GAMMAS[tried];
            self.others = [Tally::NONE; GAMMAS.len()];
        }
        goes_over
    }

    /// The curves that may still be better; one whose likelihood is NaN may not.
    fn open(&self, now: Encoding) -> impl Iterator<Item = usize> {
        (0..GAMMAS.len()).filter(move |&i| now != Encoding::Gamma(GAMMAS[i]) && self.others[i].sum > -GIVEN_UP)
    }
}

impl<const PIXELS: usize> Model<PIXELS> {
    /// Changes the curve of all later frames.
    pub fn see_by(&mut self, encoding: Encoding) {
        if encoding != self.camera.encoding {
            self.camera.encoding = encoding;
            self.metric = RootMetric::new(&self.camera);
        }
    }

    /// The gain of a frame under curve number `tried`, for the panel of an estimate under the curve so far; `None` if its pixels do not
    /// fit.
    pub fn try_curve(&mut self, tried: usize, frame: &Frame<'_>, crop: &Crop, estimate: &Estimate) -> Option<Gain> {
        let mut here = Estimate {
            share: estimate.share.map(hard),
            ..*estimate
        };
        self.expect_with_noise(&mut here);
        self.fit(&mut here, &LevelPrior::NONE);
        let so_far = self.roots();
        let left = self.residual_sums(&so_far, &so_far);
        let other = Camera {
            encoding: Encoding::Gamma(GAMMAS[tried]),
            ..self.camera
        };
        let metric = core::mem::replace(&mut self.metric, RootMetric::new(&other));
        let mut there = Estimate {
            levels: here.levels.under(&self.camera, &metric, &other, &self.metric),
            ..here
        };
        let loaded = self.load(frame, crop, there.levels.noise);
        if loaded.is_ok() {
            self.expect_with_noise(&mut there);
            for _ in 0..FITS {
                self.fit(&mut there, &LevelPrior::NONE);
            }
        }
        let left_there = self.residual_sums(&self.roots(), &so_far);
        self.metric = metric;
        loaded.ok()?;
        let nats = |squares: f32| 0.5 * left.pixels * libm::logf(left.squares / squares);
        Some(Gain {
            likelihood: nats(left_there.squares) - left_there.log_units,
            expected: nats(left_there.squares_in_units),
            levels: [here.levels, there.levels],
        })
    }

    /// The root light of each grey level.
    fn roots(&self) -> [f32; 256] {
        let offset = self.image.offset;
        core::array::from_fn(|grey| root(self.metric.light(grey as u8) + offset))
    }

    /// The residuals of the pixels that are neither black nor white, with `roots` the root light of grey levels; and the same in the unit
    /// of `units`.
    fn residual_sums(&self, roots: &[f32; 256], units: &[f32; 256]) -> ResidualSums {
        let unit: [f32; 256] = core::array::from_fn(|grey| {
            let (below, above) = (grey.saturating_sub(1), (grey + 1).min(255));
            (units[above] - units[below]) / (roots[above] - roots[below]).max(f32::MIN_POSITIVE)
        });
        let grey = |light: f32| roots.partition_point(|&root| root < light);
        let mut sums = ResidualSums::default();
        let [width, height] = self.image.size;
        for row in 0..height {
            let start = row * self.image.stride;
            let seen = &self.image.seen[start..][..width];
            for (&seen, &expected) in seen.iter().zip(&self.image.root[start..]) {
                let level = grey(seen);
                if level == 0 || seen >= self.image.full {
                    continue;
                }
                let rest = seen - expected;
                let middle = grey(seen - 0.5 * rest).clamp(1, 254);
                sums.pixels += 1.0;
                sums.squares += rest * rest;
                sums.squares_in_units += (rest * unit[middle]) * (rest * unit[middle]);
                sums.log_units += libm::logf(unit[level.min(254)]);
            }
        }
        sums
    }
}

/// The residuals of an image.
#[derive(Default)]
struct ResidualSums {
    pixels: f32,
    squares: f32,
    squares_in_units: f32,
    /// The logarithms of the units, summed over the pixels.
    log_units: f32,
}

impl Levels {
    /// The levels of the same panel under the curve of another camera.
    fn under(&self, camera: &Camera, metric: &RootMetric, other: &Camera, other_metric: &RootMetric) -> Self {
        let peak = 1.0 / (core::f32::consts::TAU * self.variance);
        let light = |light: f32| other.light(camera.grey(light));
        let background = light(self.background);
        let off = light(self.background + self.off * peak);
        let on = light(self.background + (self.off + self.contrast) * peak);
        let unit = metric.grey_of_root() / other_metric.grey_of_root();
        Self {
            background,
            off: (off - background) / peak,
            contrast: (on - off) / peak,
            noise: self.noise * unit * unit,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests;
