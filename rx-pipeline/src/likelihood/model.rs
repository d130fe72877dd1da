//! A panel's pixels compared with the expectation from its bits and levels.

use super::ascent::Ascent;
use super::crop::{Crop, Scale};
use super::estimate::Estimate;
use super::flips::FlipGains;
use super::gauss_newton::NormalEquations;
use super::image::Image;
use super::least_squares::LeastSquares;
use super::leds::LedLevels;
use super::level_prior::LevelPrior;
use super::levels::{LEVELS, Levels};
use crate::detect::DetectError;
use crate::frame::Frame;
use crate::settings::LikelihoodSettings;
#[cfg(feature = "surroundings")]
use crate::spots::Shade;
use crate::spots::{RootMetric, SpotTable};
use link::camera::{Camera, Encoding};
use link::panel::LEDS;

/// The surroundings of the cells are plain if their mean square residual is at most this (multiple of that in the cells). Higher:
/// surroundings count that are not plain; lower: noise hides that they are.
const PLAIN: f32 = 1.5;
/// The offset under the root follows the noise in steps of this (share). Smaller: the frame is loaded more often.
const OFFSET_STEP: f32 = 0.2;

/// Fitted parameters besides noise: the LEDs, and the levels.
const FITTED: usize = LEDS + LEVELS;

/// A camera that sees nothing: all zeros.
const DARK: Camera = Camera {
    encoding: Encoding::Gamma(0.0),
    black_grey: 0.0,
    blur_sigma_px: 0.0,
    blur_aspect: 0.0,
    read_noise_e: 0.0,
};

/// Settings without any effect: all zeros.
const NOTHING: LikelihoodSettings = LikelihoodSettings {
    list_sets: 0,
    curve_frames: 0,
};

/// The image of a panel, and the memory of its model.
pub(super) struct Model<const PIXELS: usize> {
    /// The configured camera, with the learnt curve.
    pub camera: Camera,
    pub settings: LikelihoodSettings,
    /// The side of its pixels in px of the camera's, and the variance by mixing with neighbours, in px².
    pub pixels: [f32; 2],
    pub metric: RootMetric,
    pub image: Image<PIXELS>,
    pub spots: SpotTable,
    pub flip_gains: FlipGains,
    pub leds: LedLevels,
    /// The ground's part of each LED's light, in contrasts: in [`LedLevels::offset`] too.
    ground: [f32; LEDS],
    /// The shadows to read without.
    #[cfg(feature = "surroundings")]
    pub shade: Option<Shade>,
}

impl<const PIXELS: usize> Model<PIXELS> {
    /// A model that sees black; all zeros.
    pub const fn new() -> Self {
        Self {
            camera: DARK,
            settings: NOTHING,
            pixels: [0.0; 2],
            metric: RootMetric::DARK,
            image: Image::new(),
            spots: SpotTable::new(),
            flip_gains: FlipGains::new(),
            leds: LedLevels::DARK,
            ground: [0.0; LEDS],
            #[cfg(feature = "surroundings")]
            shade: None,
        }
    }

    /// Prepares for frames of `camera`.
    pub fn prepare(&mut self, camera: Camera, settings: LikelihoodSettings) {
        (self.camera, self.settings) = (camera, settings);
        self.set_leds(LedLevels::ALIKE);
        self.pixels = [1.0, 0.0];
        self.metric = RootMetric::new(&camera);
    }

    /// Whether frames are read without their shadows.
    pub fn is_without_shadows(&self) -> bool {
        #[cfg(feature = "surroundings")]
        return self.shade.is_some();
        #[cfg(not(feature = "surroundings"))]
        false
    }

    /// Sets the LEDs' levels, on a plain ground.
    pub fn set_leds(&mut self, leds: LedLevels) {
        (self.leds, self.ground) = (leds, [0.0; LEDS]);
    }

    /// Sets the ground's part of each LED's light, in contrasts.
    pub fn set_ground(&mut self, ground: [f32; LEDS]) {
        for (offset, (now, before)) in self.leds.offset.iter_mut().zip(ground.iter().zip(&self.ground)) {
            *offset += now - before;
        }
        self.ground = ground;
    }

    /// Light of the LEDs, in contrasts above Off, without the ground's part.
    pub fn above_ground(&self, lit: &[f32; LEDS]) -> [f32; LEDS] {
        core::array::from_fn(|led| lit[led] - self.ground[led])
    }

    /// The variance of spots under the configured blur, in px² of an image.
    pub fn usual_variance(&self, scale: &Scale) -> f32 {
        let [side, mixing] = self.pixels;
        let blur = self.camera.blur_sigma_px / side;
        (blur * blur + mixing) / (scale.bin * scale.bin) as f32 + scale.sharp_variance()
    }

    /// The light of each LED by least squares, at the expected position of the panel.
    pub fn least_squares(&mut self, frame: &Frame<'_>, crop: &Crop, levels: &Levels) -> Result<LeastSquares, DetectError> {
        self.load_expected(frame, crop, levels.noise)?;
        Ok(self.least_squares_of(levels.variance))
    }

    /// Loads the panel's pixels and the expected positions of its LEDs.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_expected(&mut self, frame: &Frame<'_>, crop: &Crop, noise: f32) -> Result<(), DetectError> {
        self.load(frame, crop, noise)?;
        self.spots.centre = crop.centre;
        Ok(())
    }

    /// As [`Self::least_squares`] once the pixels are loaded, for spots of that variance.
    pub fn least_squares_of(&mut self, variance: f32) -> LeastSquares {
        self.spots.place(variance, self.image.size, self.image.stride);
        LeastSquares::solve(&mut self.image, &self.spots)
    }

    /// The difference between an On LED and an Off one, in grey levels, about the background's grey.
    pub fn contrast_grey(&self, levels: &Levels) -> f32 {
        let background = levels.background.max(f32::MIN_POSITIVE);
        levels.contrast * self.spots.peak() / background * self.metric.grey_of_one()
    }

    /// The deviation of a pixel of middle grey, in grey levels, given the variance `noise` of a pixel's root light.
    pub fn noise_grey(&self, noise: f32) -> f32 {
        libm::sqrtf(noise) * self.metric.grey_of_root()
    }

    /// The negative log-likelihood of pixels and levels.
    pub fn loss(&self, levels: &Levels, prior: &LevelPrior, noise: f32) -> f32 {
        self.image.loss(noise) + prior.loss(levels)
    }

    /// An ascent from an estimate in the image.
    pub fn ascent<'a>(&'a mut self, estimate: &'a mut Estimate) -> Ascent<'a, PIXELS> {
        self.ascent_and_gains(estimate).0
    }

    /// The same, and memory for the gains of flips.
    pub fn ascent_and_gains<'a>(&'a mut self, estimate: &'a mut Estimate) -> (Ascent<'a, PIXELS>, &'a mut FlipGains) {
        let ascent = Ascent {
            image: &mut self.image,
            spots: &self.spots,
            levels: &estimate.levels,
            leds: &self.leds,
            share: &mut estimate.share,
        };
        (ascent, &mut self.flip_gains)
    }

    /// The equations of the levels about an estimate in the image.
    pub fn equations(&self, estimate: &Estimate, prior: &LevelPrior) -> NormalEquations {
        let Estimate { levels, share, .. } = estimate;
        NormalEquations::of(&self.image, &self.spots, &self.leds.lit(share), levels, prior)
    }

    /// One step of the fit of the levels; no change if the pixels do not determine them.
    pub fn fit(&mut self, estimate: &mut Estimate, prior: &LevelPrior) {
        self.equations(estimate, prior).step(&mut estimate.levels);
        estimate.turn_upright();
        self.expect_with_noise(estimate);
    }

    /// Sets the image's expectation to that of an estimate.
    pub fn expect(&mut self, estimate: &Estimate) {
        let levels = &estimate.levels;
        let [dx, dy] = levels.shift;
        self.spots.centre = estimate.centre.map(|[x, y]| [x + dx, y + dy]);
        self.spots.place(levels.variance, self.image.size, self.image.stride);
        self.image
            .expect(&self.spots, levels.background, &levels.light(&self.leds.lit(&estimate.share)));
    }

    /// The same, and sets the estimate's noise to the residuals.
    pub fn expect_with_noise(&mut self, estimate: &mut Estimate) {
        self.expect(estimate);
        estimate.levels.noise = self.noise();
    }

    fn noise(&self) -> f32 {
        self.image.mean_square(FITTED).max(self.metric.rounding_variance())
    }

    /// Whether the surroundings of the panel's cells are as plain as the ground between its LEDs, by an estimate in an image with the rim.
    pub fn is_plain_around(&self, crop: &Crop, noise: f32) -> bool {
        let [inside, around] = self.image.mean_squares_in_and_around(crop);
        around <= PLAIN * inside.max(noise)
    }

    /// Compares an estimate with the pixels of another crop.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn move_to(&mut self, frame: &Frame<'_>, crop: &Crop, estimate: &mut Estimate) -> Result<(), DetectError> {
        self.load(frame, crop, estimate.levels.noise)?;
        estimate.centre = crop.centre;
        self.expect(estimate);
        Ok(())
    }

    /// Loads the panel's pixels, in the root light for that noise.
    ///
    /// # Errors
    /// [`DetectError::OutsideMemory`] if they do not fit.
    pub fn load(&mut self, frame: &Frame<'_>, crop: &Crop, noise: f32) -> Result<(), DetectError> {
        let offset = self.metric.offset(noise);
        let fits = self.image.load(frame, crop, &self.metric, offset);
        #[cfg(feature = "surroundings")]
        if let Some(shade) = self.shade.as_ref().filter(|_| fits) {
            self.image.remove(shade, crop);
        }
        fits.then_some(()).ok_or(DetectError::OutsideMemory {
            width: crop.window.width / crop.scale.bin,
            height: crop.window.height / crop.scale.bin,
            capacity: PIXELS,
        })
    }

    /// Loads the pixels again if the noise needs another offset under their root.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn follow_noise(&mut self, frame: &Frame<'_>, crop: &Crop, estimate: &mut Estimate) -> Result<(), DetectError> {
        let offset = self.metric.offset(estimate.levels.noise);
        if (offset - self.image.offset).abs() > OFFSET_STEP * offset {
            self.load(frame, crop, estimate.levels.noise)?;
            self.expect_with_noise(estimate);
        }
        Ok(())
    }
}
