//! What earlier frames tell of the levels of the next.

use super::crop::Scale;
use super::levels::{LEVELS, Levels, Matrix, Vector};
use core::ops::RangeInclusive;

/// The spots' variance (px²).
pub(super) const VARIANCE_PX2: RangeInclusive<f32> = 0.2..=20.0;
/// Levels are averaged over about so many (frames). More: surer, and changes of light are followed later.
const MEMORY_FRAMES: u32 = 64;
/// After more that do not fit, all is forgotten (frames in a row).
const MISFITS_MAX: u32 = 4;
/// A frame fits if its noise is at most this (multiple of what it was). Higher: mixtures of symbols pass for one.
pub(super) const NOISIER: f32 = 1.3;
/// A frame that does not fit but has at most this much noise still teaches how much noise frames have (multiple of what it was): a codec
/// leaves more in some frames than in others. Higher: mixtures of symbols teach; lower: noisy frames pass for mixtures.
const NOISIER_AT_TIMES: f32 = 1.7;
/// What was learnt in frames of more noise was learnt from a worse fit (multiple of a frame's).
const QUIETER: f32 = 2.0;
/// After so many the noise is known (frames).
pub(super) const FRAMES_MIN: u32 = 4;
/// The levels' deviations, at least: of background, Off, contrast, variance (share; Off in terms of the contrast), x
/// and y (px). Less: a changed frame is held to the levels of others.
const LEAST_SPREAD: [f32; 6] = [0.004, 0.008, 0.008, 0.004, 0.1, 0.1];
/// Those after the first frame.
const FIRST_SPREAD: [f32; 6] = [0.1, 0.3, 0.3, 0.1, 0.2, 0.2];
/// Levels known so well are sure (share of the contrast): then panels are read whose LEDs are all alike.
const SURE: f32 = 0.1;
/// How far beside the usual levels searches begin too, where these are not sure (standard deviations).
const SPREAD: f32 = 1.2;
/// What is added to the variance of what is scaled to variance 1: f32 can tell no less.
const RIDGE: f32 = 1e-4;

/// A Gaussian prior of a panel's levels: their mean and covariance over its last frames.
///
/// Blur, noise and brightness hardly change from frame to frame, and where brightness does, it changes of Off and On LEDs together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LevelPrior {
    mean: [f32; LEVELS],
    covariance: [[f32; LEVELS]; LEVELS],
    /// The inverse of the covariance.
    precision: [[f32; LEVELS]; LEVELS],
    noise: f32,
    frames: u32,
    /// The same, with older ones.
    age: u32,
    misfits: u32,
    /// Whether the contrast is another in each frame, by a carrier.
    #[cfg(feature = "carrier")]
    pub has_carrier: bool,
}

impl LevelPrior {
    /// That of one who has seen no frame.
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

    /// That of one who knows no more than whether there is a carrier.
    fn forgotten(&self) -> Self {
        Self {
            #[cfg(feature = "carrier")]
            has_carrier: self.has_carrier,
            ..Self::NONE
        }
    }

    /// Their mean; none before the first frame.
    pub fn mean_levels(&self) -> Option<Levels> {
        (self.frames > 0).then(|| Levels::from_values(self.mean, self.noise))
    }

    /// Frames that it was learnt from, as far as they count.
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

    /// Levels to begin a search with: the usual ones, and unless they are sure, usual ones of less and of more contrast.
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

    /// Whether a frame of that noise may be of the same panel in the same light.
    pub fn fits(&self, noise: f32) -> bool {
        self.frames < FRAMES_MIN || noise <= NOISIER * self.noise
    }

    /// Whether it certainly may, as there is something to compare it with.
    pub fn fits_surely(&self, noise: f32) -> bool {
        self.frames >= FRAMES_MIN && self.fits(noise)
    }

    /// The noise of a frame, as it would be at the usual contrast: what the model leaves unexplained grows with the contrast, which a carrier
    /// makes another in each frame.
    pub fn usual_noise(&self, levels: &Levels) -> f32 {
        #[cfg(feature = "carrier")]
        if self.has_carrier && self.frames > 0 {
            let [_, _, usual, ..] = self.mean;
            let more = (levels.contrast / usual).max(1.0);
            return levels.noise / (more * more * more);
        }
        levels.noise
    }

    /// The prior's information and score at `levels`: the inverse covariance, and its product with the mean's distance from them; none
    /// before the first frame.
    pub fn information(&self, levels: &Levels) -> Option<(Matrix, Vector)> {
        (self.frames > 0).then(|| {
            let precision = matrix(&self.precision);
            (precision, precision * (Vector::from(self.mean) - Vector::from(levels.values())))
        })
    }

    /// Goes on in an image of another scale: the nearer a panel, the more pixels its LEDs' light fills, and the less of their width
    /// is blur.
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
        // The more frame pixels an image pixel is made of, the less its noise.
        self.noise *= area;
    }

    /// Goes on in the light of another curve, in which a panel of levels `from` has levels `to`.
    pub fn go_over(&mut self, from: &Levels, to: &Levels) {
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

    /// What it costs that the levels are unusual, in nats.
    pub fn loss(&self, levels: &Levels) -> f32 {
        self.information(levels).map_or(0.0, |(_, score)| {
            0.5 * score.dot(&(Vector::from(self.mean) - Vector::from(levels.values())))
        })
    }

    /// Takes in a frame's levels, of the covariance that its pixels leave them. Of a frame that does not fit, no more than its noise.
    ///
    /// The scatter of the levels is that of their estimates and what the estimates are unsure of (Dempster, Laird & Rubin
    /// 1977).
    pub fn update(&mut self, levels: &Levels, unsure: &Matrix) {
        let noise = self.usual_noise(levels);
        if !self.fits(noise) {
            self.misfits += 1;
            if self.misfits > MISFITS_MAX {
                *self = self.forgotten();
            } else if noise <= NOISIER_AT_TIMES * self.noise {
                self.noise += (noise - self.noise) / self.frames as f32;
            }
            return;
        }
        if noise * QUIETER < self.noise {
            // Whatever was learnt before was learnt from a worse fit.
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

/// The inverse of a covariance, by way of the correlations, which f32 holds well.
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

    /// What is known after frames of such noise.
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
}
