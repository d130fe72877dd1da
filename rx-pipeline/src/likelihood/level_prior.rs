//! A prior of the next frame's levels, from earlier frames.

use super::crop::Scale;
use super::levels::{LEVELS, Levels, Matrix, Vector};
use core::ops::RangeInclusive;

/// The spots' variance (px²).
pub(super) const VARIANCE_PX2: RangeInclusive<f32> = 0.2..=20.0;
/// The average of levels spans about this many frames (frames). More: surer, and changes of light are followed later.
const MEMORY_FRAMES: u32 = 64;
/// After more frames in a row that do not fit, all is forgotten (frames).
const MISFITS_MAX: u32 = 4;
/// The noise of a frame that fits, at most (multiple of the usual noise). Higher: mixtures of symbols fit.
pub(super) const NOISIER: f32 = 1.3;
/// The same until the usual noise is known (multiple of the noise so far). Higher: the noise never becomes known if every other frame is a
/// mixture, because [`QUIETER`] forgets the average of both; lower: unequal LEDs and codecs delay it.
const NOISIER_AT_FIRST: f32 = 2.5;
/// The noise up to which a frame that does not fit still updates the usual noise (multiple of it), because a codec leaves more noise in
/// some frames than in others. Higher: mixtures of symbols teach; lower: noisy frames count as mixtures.
const NOISIER_AT_TIMES: f32 = 1.7;
/// If a frame has less noise by this factor, all earlier levels come from a worse fit (multiple of a frame's noise).
const QUIETER: f32 = 2.0;
/// Frames until the noise is known (frames).
pub(super) const FRAMES_MIN: u32 = 4;
/// The levels' deviations, at least: of background, Off, contrast, variance (share; Off in terms of the contrast), x and y (px). Less: the
/// levels of earlier frames are imposed on a changed frame.
const LEAST_SPREAD: [f32; 6] = [0.004, 0.008, 0.008, 0.004, 0.1, 0.1];
/// The same after the first frame.
const FIRST_SPREAD: [f32; 6] = [0.1, 0.3, 0.3, 0.1, 0.2, 0.2];
/// Maximum deviation of well-known levels (share of the contrast). If they are well known, panels are read whose LEDs are all alike.
const SURE: f32 = 0.1;
/// The offset of further starting points of a search besides the usual levels, if these are not well known (standard deviations).
const SPREAD: f32 = 1.2;
/// Addition to a variance of 1: the resolution of f32.
const RIDGE: f32 = 1e-4;

/// A Gaussian prior of a panel's levels: their mean and covariance over its last frames.
///
/// Blur, noise and brightness hardly change from frame to frame, and if brightness does, Off and On LEDs change together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LevelPrior {
    mean: [f32; LEVELS],
    covariance: [[f32; LEVELS]; LEVELS],
    /// The inverse of the covariance.
    precision: [[f32; LEVELS]; LEVELS],
    noise: f32,
    frames: u32,
    /// All frames since the first one.
    age: u32,
    misfits: u32,
    /// Whether a carrier makes the contrast different in each frame.
    #[cfg(feature = "carrier")]
    pub has_carrier: bool,
}

impl LevelPrior {
    /// No frames yet.
    pub const NONE: Self = Self {
        mean: [0.0; LEVELS],
        covariance: [[0.0; LEVELS]; LEVELS],
        precision: [[0.0; LEVELS]; LEVELS],
        noise: 0.0,
        frames: 0,
        age: 0,
        misfits: 0,
        #[cfg(feature = "carrier")]
        has_carrier: false,
    };

    /// The prior without any frames, which keeps only whether there is a carrier.
    fn forgotten(&self) -> Self {
        Self {
            #[cfg(feature = "carrier")]
            has_carrier: self.has_carrier,
            ..Self::NONE
        }
    }

    /// The mean levels; `None` before the first frame.
    pub fn mean_levels(&self) -> Option<Levels> {
        (self.frames > 0).then(|| Levels::from_values(self.mean, self.noise))
    }

    /// The number of frames, up to the length of the average.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// All frames since the first of them.
    pub fn age(&self) -> u32 {
        self.age
    }

    /// The standard deviation of the spots' variance, in px².
    pub fn variance_deviation(&self) -> f32 {
        libm::sqrtf(self.covariance[3][3])
    }

    /// Whether brightness and contrast are well known.
    pub fn is_sure(&self) -> bool {
        let [_, _, contrast, ..] = self.mean;
        self.frames > 0
            && [1, 2]
                .into_iter()
                .all(|i| self.covariance[i][i] < (SURE * contrast) * (SURE * contrast))
    }

    /// Initial levels of a search: the mean, and, unless the levels are well known, levels of less and of more contrast.
    pub fn initial_levels(&self) -> impl Iterator<Item = Levels> {
        let spread = libm::sqrtf(self.covariance[2][2]);
        let count = match (self.frames, self.is_sure()) {
            (0, _) => 0,
            (_, true) => 1,
            (_, false) => 3,
        };
        [0.0, -SPREAD, SPREAD].into_iter().take(count).map(move |deviations| {
            let along = Vector::from(self.covariance[2]) * (deviations / spread);
            Levels::from_values((Vector::from(self.mean) + along).into(), self.noise)
        })
    }

    /// Whether a frame of that noise may show the same panel in the same light, or too little is known to compare it with.
    pub fn fits(&self, noise: f32) -> bool {
        self.frames < FRAMES_MIN || noise <= NOISIER * self.noise
    }

    /// As [`Self::fits`], but false for a frame that is much noisier than the first ones.
    pub fn fits_so_far(&self, noise: f32) -> bool {
        self.fits(noise) && (self.frames == 0 || noise <= NOISIER_AT_FIRST * self.noise)
    }

    /// As [`Self::fits`], but false until the usual noise is known.
    pub fn fits_surely(&self, noise: f32) -> bool {
        self.frames >= FRAMES_MIN && self.fits(noise)
    }

    /// The noise of a frame, scaled to the usual contrast: errors of the model grow with the contrast, which a carrier makes different in
    /// each frame.
    pub fn usual_noise(&self, levels: &Levels) -> f32 {
        #[cfg(feature = "carrier")]
        if self.has_carrier && self.frames > 0 {
            let [_, _, usual, ..] = self.mean;
            let more = (levels.contrast / usual).max(1.0);
            return levels.noise / (more * more * more);
        }
        levels.noise
    }

    /// The prior's information and score at `levels`: the inverse covariance, and its product with the mean's distance from them; `None`
    /// before the first frame.
    pub fn information(&self, levels: &Levels) -> Option<(Matrix, Vector)> {
        (self.frames > 0).then(|| {
            let precision = matrix(&self.precision);
            (precision, precision * (Vector::from(self.mean) - Vector::from(levels.values())))
        })
    }

    /// Converts the prior to an image of another scale: at a nearer panel, the light of an LED fills more pixels, and blur is a smaller
    /// part of its width.
    pub fn rescale(&mut self, from: &Scale, to: &Scale) {
        let pixel = from.bin as f32 / to.bin as f32;
        let growth = to.pitch / (from.pitch * pixel);
        let area = pixel * pixel;
        let light = area * growth * growth;
        let scale = Vector::from([1.0, light, light, area, pixel, pixel]);
        self.mean = Vector::from(self.mean).component_mul(&scale).into();
        let blur = self.mean[3] - area * from.sharp_variance();
        self.mean[3] = (blur + to.sharp_variance()).max(*VARIANCE_PX2.start());
        self.scale_covariance(&scale);
        // The noise of an image pixel falls with the number of frame pixels in it.
        self.noise *= area;
    }

    /// Converts the prior to another curve, under which a panel of levels `from` has levels `to`.
    pub fn convert(&mut self, from: &Levels, to: &Levels) {
        let contrast = to.contrast / from.contrast;
        let scale = Vector::from([
            to.background / from.background,
            contrast,
            contrast,
            to.variance / from.variance,
            1.0,
            1.0,
        ]);
        if !scale.iter().all(|scale| scale.is_normal()) {
            *self = Self::NONE;
            return;
        }
        let beside = Vector::from(self.mean) - Vector::from(from.values());
        self.mean = (Vector::from(to.values()) + beside.component_mul(&scale)).into();
        self.scale_covariance(&scale);
        self.noise *= to.noise / from.noise;
    }

    fn scale_covariance(&mut self, scale: &Vector) {
        let covariance = matrix(&self.covariance).component_mul(&(scale * scale.transpose()));
        self.covariance = covariance.into();
        self.precision = inverse(&covariance).unwrap_or_else(Matrix::zeros).into();
    }

    /// The negative log-prior of levels, in nats.
    pub fn loss(&self, levels: &Levels) -> f32 {
        self.information(levels).map_or(0.0, |(_, score)| {
            0.5 * score.dot(&(Vector::from(self.mean) - Vector::from(levels.values())))
        })
    }

    /// Adds a frame's levels, with the covariance that its pixels leave them. A frame that does not fit updates the noise at most.
    ///
    /// The scatter of the levels is the scatter of their estimates plus the uncertainty of these (Dempster, Laird & Rubin 1977).
    pub fn update(&mut self, levels: &Levels, unsure: &Matrix) {
        let noise = self.usual_noise(levels);
        if !self.fits_so_far(noise) {
            self.misfits += 1;
            if self.misfits > MISFITS_MAX {
                *self = self.forgotten();
            } else if noise <= NOISIER_AT_TIMES * self.noise {
                self.noise += (noise - self.noise) / self.frames as f32;
            }
            return;
        }
        if noise * QUIETER < self.noise {
            // All earlier levels come from a worse fit.
            *self = self.forgotten();
        }
        let now = Vector::from(levels.values());
        let scale = Vector::from([levels.background, levels.contrast, levels.contrast, levels.variance, 1.0, 1.0]);
        if self.frames == 0 {
            self.mean = now.into();
            let first = Vector::from(FIRST_SPREAD).component_mul(&scale);
            self.covariance = Matrix::from_diagonal(&first.component_mul(&first)).into();
        }
        self.misfits = 0;
        self.frames = (self.frames + 1).min(MEMORY_FRAMES);
        self.age = self.age.wrapping_add(1);
        let gain = 1.0 / self.frames as f32;
        let difference = now - Vector::from(self.mean);
        self.mean = (Vector::from(self.mean) + gain * difference).into();
        self.noise += gain * (noise - self.noise);
        let keep = 1.0 - (1.0 / (self.frames + 1) as f32).max(0.1);
        let least = Vector::from(LEAST_SPREAD).component_mul(&scale);
        let covariance = (matrix(&self.covariance) + difference * difference.transpose() * (1.0 - keep)) * keep
            + (unsure + Matrix::from_diagonal(&least.component_mul(&least))) * (1.0 - keep);
        self.covariance = covariance.into();
        self.precision = inverse(&covariance).unwrap_or_else(Matrix::zeros).into();
    }
}

/// The inverse of a covariance, by way of the correlations, which suit the precision of f32.
fn inverse(covariance: &Matrix) -> Option<Matrix> {
    let scale = covariance.diagonal().map(|variance| 1.0 / libm::sqrtf(variance));
    let correlation = Matrix::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 });
    let inverse = correlation.cholesky()?.inverse();
    Some(Matrix::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

fn matrix(rows: &[[f32; LEVELS]; LEVELS]) -> Matrix {
    Matrix::from(*rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prior after frames of such noise.
    fn after(noises: impl IntoIterator<Item = f32>) -> LevelPrior {
        let mut prior = LevelPrior::NONE;
        let unsure = Matrix::from_diagonal_element(1e-4);
        for noise in noises {
            prior.update(&Levels::from_values([10.0, 20.0, 100.0, 1.0, 0.0, 0.0], noise), &unsure);
        }
        prior
    }

    #[test]
    fn frames_that_a_codec_makes_noisier_fit_soon() {
        let codec = (0..24).map(|frame| if frame >= 6 && frame % 2 == 0 { 1.5 } else { 1.0 });
        assert!(!after([1.0; 6]).fits(1.5));
        assert!(after(codec).fits(1.5));
    }

    #[test]
    fn mixtures_of_symbols_do_not_make_others_fit() {
        let mixtures = (0..64).map(|frame| if frame % 5 == 4 { 2.5 } else { 1.0 });
        assert!(!after(mixtures).fits(1.4));
    }

    #[test]
    fn mixtures_in_every_other_frame_leave_the_noise_of_single_symbols_known() {
        for noisier in [2.6, 2.9, 2.95, 3.0, 3.5, 10.0, 100.0] {
            for first in [0, 1] {
                let prior = after((first..16).map(|frame| if frame % 2 == 0 { 1.0 } else { noisier }));
                assert!(
                    prior.fits_surely(1.0) && !prior.fits(1.4),
                    "{noisier} times the noise, from {first} on"
                );
            }
        }
    }
}
