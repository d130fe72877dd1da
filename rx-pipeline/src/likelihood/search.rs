//! Bits and levels together: least squares, interference cancellation, and flips of single LEDs.

use super::crop::Crop;
use super::estimate::{Estimate, hard};
use super::ground::ground_under;
use super::level_prior::LevelPrior;
use super::levels::Levels;
use super::model::Model;
use crate::detect::DetectError;
use crate::detect::MIN_CONTRAST_GREY;
use crate::frame::Frame;
use link::panel::LEDS;

/// The assumed variance of root light in a first frame.
const FIRST_NOISE: f32 = 1e-3;
/// Blurs to try first besides the configured one (px), in rising order. More: slower.
const FIRST_BLURS_PX: [f32; 5] = [0.7, 1.1, 1.7, 2.5, 3.6];
/// The widest spots whose neighbours can be separated (variance over the squared pitch).
const VARIANCE_PITCH: f32 = 0.5;
/// Starting points of a search, as multiples of the estimated contrast, which least squares and saturation reduce. More: slower.
const FIRST_CONTRASTS: [f32; 2] = [1.0, 1.6];
/// Sweeps over the LEDs before the levels are fitted (count).
const FIRST_SWEEPS: usize = 3;
/// Fits of the levels, each with sweeps, at most (count). More: slower.
const ROUNDS: usize = 5;
/// Sweeps over the LEDs per fit (count).
const SWEEPS: usize = 2;
/// Rounds of flipping groups of neighbours, at most (count): one or two suffice, but levels refitted in between may undo the gain of flips
/// without end.
const NEIGHBOUR_ROUNDS: usize = 32;

impl<const PIXELS: usize> Model<PIXELS> {
    /// The variance of spots, in px² of the image, that leaves the light of 64 LEDs the least residuals. It serves while the levels are
    /// unknown and `usual` is only a guess.
    pub fn first_variance(&mut self, frame: &Frame<'_>, crop: &Crop, usual: f32) -> Result<f32, DetectError> {
        self.load_expected(frame, crop, FIRST_NOISE)?;
        let (mut variance, mut least) = (usual, self.least_squares_of(usual).left);
        for blur in FIRST_BLURS_PX {
            let blur = blur / crop.scale.bin as f32;
            let other = blur * blur + crop.scale.sharp_variance();
            if other > crop.scale.pitch * crop.scale.pitch * VARIANCE_PITCH {
                break;
            }
            let left = self.least_squares_of(other).left;
            if left < least {
                (variance, least) = (other, left);
            }
        }
        Ok(variance)
    }

    /// Bits and levels from scratch, with an initial `variance` of spots (px² of the image), or from the known levels of `prior`.
    pub fn search(&mut self, frame: &Frame<'_>, crop: &Crop, prior: &LevelPrior, variance: f32) -> Result<Estimate, DetectError> {
        let first = Levels {
            background: 1.0,
            off: 0.0,
            contrast: 0.0,
            variance,
            shift: [0.0; 2],
            noise: FIRST_NOISE,
        };
        let mut levels = prior.mean_levels().unwrap_or(first);
        let squares = self.least_squares(frame, crop, &levels)?;
        self.set_ground([0.0; LEDS]);
        let known = levels.contrast;
        let own: [f32; LEDS] = core::array::from_fn(|led| squares.light[led] - known * self.leds.offset[led]);
        let ground = ground_under(&own, |led| self.leds.follows(led));
        if !prior.is_sure() {
            squares.split(&ground, &mut levels);
            let range_grey = self.contrast_grey(&levels);
            if range_grey < MIN_CONTRAST_GREY {
                return Err(DetectError::ContrastTooLow { range_grey });
            }
        }
        let contrast = levels.contrast.max(f32::MIN_POSITIVE);
        self.set_ground(ground.map(|ground| ground / contrast));
        let shrunk = FIRST_CONTRASTS.map(|factor| Levels {
            contrast: factor * levels.contrast,
            ..levels
        });
        let unknown = prior.mean_levels().is_none();
        let shrunk = shrunk.into_iter().filter(|_| unknown);
        let (mut best, mut noise) = (None::<(f32, Estimate)>, None);
        for levels in shrunk.chain(prior.initial_levels()) {
            let start = Estimate {
                levels,
                share: self.leds.shares(&squares.lit(&levels)),
                centre: crop.centre,
            };
            let found = self.refine(frame, crop, start, prior)?;
            // The comparison uses one noise for all.
            let noise = *noise.get_or_insert(found.levels.noise);
            let loss = self.loss(&found.levels, prior, noise);
            if best.is_none_or(|(least, _)| loss < least) {
                best = Some((loss, found));
            }
        }
        best.map(|(_, best)| best).ok_or(DetectError::ContrastTooLow { range_grey: 0.0 })
    }

    /// Interference cancellation, then flips of single LEDs.
    fn refine(&mut self, frame: &Frame<'_>, crop: &Crop, start: Estimate, prior: &LevelPrior) -> Result<Estimate, DetectError> {
        let mut estimate = start;
        if prior.is_sure() && self.decide_at_once(&mut estimate, prior) {
            return Ok(estimate);
        }
        estimate = start;
        self.expect_with_noise(&mut estimate);
        for _ in 0..FIRST_SWEEPS {
            self.ascent(&mut estimate).cancel_interference();
        }
        for _ in 0..ROUNDS {
            self.fit(&mut estimate, prior);
            self.follow_noise(frame, crop, &mut estimate)?;
            for _ in 0..SWEEPS {
                self.ascent(&mut estimate).cancel_interference();
            }
            if prior.fits_surely(prior.usual_noise(&estimate.levels)) && estimate.is_decided() {
                break;
            }
        }
        self.ascent(&mut estimate).decide();
        self.fit(&mut estimate, prior);
        self.ascent(&mut estimate).flip_singly();
        self.fit(&mut estimate, prior);
        for _ in 0..NEIGHBOUR_ROUNDS {
            let flip_cost = self.ascent(&mut estimate).flip_costs();
            if self.is_clear(&estimate, &flip_cost, prior) || !self.ascent(&mut estimate).flip_groups() {
                break;
            }
            self.fit(&mut estimate, prior);
            self.ascent(&mut estimate).flip_singly();
        }
        Ok(estimate)
    }

    /// Decides on the bits by least squares, and flips single LEDs; returns whether that explains the frame as well as earlier frames.
    fn decide_at_once(&mut self, estimate: &mut Estimate, prior: &LevelPrior) -> bool {
        estimate.share = estimate.share.map(hard);
        self.expect(estimate);
        self.fit(estimate, prior);
        self.ascent(estimate).flip_singly();
        self.fit(estimate, prior);
        prior.fits_surely(prior.usual_noise(&estimate.levels))
    }
}
