//! The maximum-likelihood image of the panel's plane, and its precision.
//!
//! In linear light, 1 at grey 118, a pixel sees
//!
//! ```text
//! x = ground(pixel) + Σ (level + own_k)·h_k(pixel),    level of Off or of On by the LED's bit
//! ```
//!
//! where the ground is a plane, and h_k the disc of LED k in the plane's image, blurred by the lens and summed by the pixel. The fit is
//! joint: eight numbers of the plane, the blur, ground and levels, and each LED's individual deviation, a random effect whose spread is
//! estimated (Laird & Ware 1982). Pixels weigh by their noise, of variance v0 + v1·x plus that of rounding; v0 and v1 are estimated from
//! the residuals. A saturated pixel is compared with its expectation after clipping (its first two moments; quasi-likelihood, Wedderburn
//! 1974).
//!
//! The precision of the plane is its Fisher information, with all others unknown (its Schur complement). Errors of the model are as wide as
//! an LED: if LEDs scatter about the plane's lattice by more than noise explains, the information is reduced in proportion.

use link::panel::LEDS;

use super::appearance::{Appearance, Sums};
use super::equations::{AROUND, Equations, Model, SHARED_COUNT, Step};
use super::leds::Leds;
use super::pixels::Pixels;
use super::plane::{PLANE, PlaneImage, Vector8};
use super::{PanelObservation, PoseError};
use crate::corners::Corners;

/// Rounds that fit only light.
const LIGHT_ROUNDS: usize = 2;
/// The fit uses the surroundings once a step is less than this, squared, in standard deviations, or after `INNER_ROUNDS`.
const NEAR: f64 = 1.0;
const INNER_ROUNDS: usize = 6;
/// Rounds that estimate noise and the LEDs' spread.
const LEARNING_ROUNDS: usize = 14;
/// These estimates have converged if they change by less than this share.
const LEARNT: f64 = 0.01;
/// From here on, half steps, because whole ones may oscillate.
const RELAXED_ROUNDS: usize = 18;
/// From here on, a seventh of a standard deviation counts as converged, because a pixel at the limit of clipping may oscillate.
const LATE_ROUNDS: usize = 30;
const LATE_TOLERANCE: f64 = 0.14;
const MOST_ROUNDS: usize = 50;
/// The greatest change of the plane in a round, in half sides: half a pitch.
const LONGEST_STEP: f64 = 0.5 / 3.5;
/// The surroundings are plain if their squared residual is less than this multiple of noise.
const PLAIN: f64 = 1.3;
/// Pixels of the surroundings for that decision, at least.
const AROUND_PIXELS: f64 = 40.0;
/// The reach of light from beyond the cells if these surroundings are not plain, in standard deviations of the blur.
const CARRIED: f64 = 1.5;
/// The scatter of LEDs about the lattice, relative to noise, that exceeds chance.
const SCATTERED: f64 = 1.5;
/// The greatest spread of Off LEDs relative to the contrast (standard deviation): more means that they are not LEDs.
const ALIKE: f64 = 0.1;
/// The range of the blur in the pixels in use: sharper spots hide between them, wider ones are truncated.
const SIGMA: core::ops::RangeInclusive<f64> = 0.2..=2.3;

/// The image of the panel's plane in a frame, with its precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFit {
    /// The image.
    pub image: PlaneImage,
    /// Fisher information of its eight numbers, in the order of their fields: the inverse of their covariance.
    pub information: [[f64; 8]; 8],
}

/// All fitted parameters.
#[derive(Clone, Copy)]
struct Estimate {
    plane: PlaneImage,
    look: Appearance,
    /// Each LED's individual deviation.
    own: [f64; LEDS],
}

/// Memory of a fit.
pub(super) struct ImageFit<const N: usize> {
    pixels: Pixels<N>,
    leds: Leds,
    equations: Equations,
    /// The fit ends with a step of the plane below this, in standard deviations.
    pub tolerance: f64,
    /// Rounds of the last fit.
    pub rounds: usize,
}

impl<const N: usize> ImageFit<N> {
    pub const fn new(tolerance: f64) -> Self {
        Self {
            pixels: Pixels::EMPTY,
            leds: Leds::EMPTY,
            equations: Equations::EMPTY,
            tolerance,
            rounds: 0,
        }
    }

    /// Fits the image of a panel that was read.
    pub fn fit(&mut self, seen: &PanelObservation<'_>) -> Result<PlaneFit, PoseError> {
        self.pixels.take(seen.frame, seen.corners, seen.camera)?;
        let side = self.pixels.side;
        let start = PlaneImage::through(seen.corners, seen.lens).ok_or(PoseError::NoRay)?;
        let blur = f64::from(seen.camera.blur_sigma_px) / side as f64;
        let look = Appearance::of_blur(blur.clamp(*SIGMA.start(), *SIGMA.end()));
        self.settle(seen, &start, look)
    }

    /// Whether a fit has converged on scattered LEDs whose Off ones shine with foreign light.
    fn is_astray(&self, look: &Appearance) -> bool {
        look.off_spread() > ALIKE && self.equations.sums.scatter() > SCATTERED
    }

    /// Iterates from a start (Gauss and Newton).
    fn settle(&mut self, seen: &PanelObservation<'_>, start: &PlaneImage, look: Appearance) -> Result<PlaneFit, PoseError> {
        let mut now = Estimate {
            plane: *start,
            look,
            own: [0.0; LEDS],
        };
        let mut is_near = false;
        for round in 0..MOST_ROUNDS {
            self.leds.draw(&now.plane, now.look.sigma, &self.pixels, seen)?;
            let model = Model {
                look: &now.look,
                own: &now.own,
                bits: seen.bits,
                leds: &self.leds,
            };
            self.equations.sum(&self.pixels, &model)?;
            let sums = self.equations.sums;
            let only_light = round < LIGHT_ROUNDS;
            let step = self.equations.solve(only_light)?;
            let squared = step.squared();
            if !squared.is_finite() {
                return Err(PoseError::Singular);
            }
            let share = match round {
                _ if only_light => 0.0,
                ..RELAXED_ROUNDS => 1.0,
                _ => 0.5,
            };
            let before = now.look;
            now.step(&step, share);
            if round == 0 {
                now.look.set_prior_spread();
                now.own = [0.0; LEDS];
            } else if round < LEARNING_ROUNDS {
                let variance = step.own_variance();
                let free = now.look.learn_spread(seen.bits, &now.own, &variance);
                now.look.learn_noise(&sums, SHARED_COUNT as f64 + free);
            }
            let learnt = round >= LEARNING_ROUNDS || now.look.differs_from(&before) < LEARNT;
            let tolerance = if round < LATE_ROUNDS {
                self.tolerance
            } else {
                self.tolerance.max(LATE_TOLERANCE)
            };
            if is_near && learnt && squared < tolerance * tolerance {
                self.rounds = round + 1;
                let fit = now.measured(&sums, &step, start)?;
                return match self.is_astray(&now.look) {
                    true => Err(PoseError::Unlike),
                    false => Ok(fit),
                };
            }
            if !is_near && !only_light && (squared < NEAR || round >= INNER_ROUNDS) {
                is_near = true;
                now.look.rim = self.rim(&now.look, &sums, seen.corners);
            }
        }
        Err(PoseError::NotSettled { rounds: MOST_ROUNDS })
    }

    /// The limit of the pixels in use, outside the cells: all if the surroundings are plain, otherwise only those that no light from there
    /// reaches.
    fn rim(&self, look: &Appearance, sums: &Sums, corners: &Corners) -> f64 {
        let [misfit, count] = sums.around;
        if count < AROUND_PIXELS {
            0.0
        } else if misfit < PLAIN * count {
            AROUND
        } else {
            let pitch = f64::from(corners.pitch_px()) / self.pixels.side as f64;
            -CARRIED * look.sigma / pitch
        }
    }
}

impl Estimate {
    /// Applies a share of a step, but the whole step to the light.
    fn step(&mut self, step: &Step, share: f64) {
        let image = step.image();
        let share = share * (LONGEST_STEP / image.amax()).min(1.0);
        let unit = Vector8::from(self.plane.units());
        let moved = self.plane.vector() + image.component_mul(&unit) * share;
        self.plane = PlaneImage::of_vector(&moved);
        let look = &mut self.look;
        let sigma = look.sigma + share * step.blur();
        let sigma = sigma.clamp(0.7 * look.sigma, 1.4 * look.sigma);
        look.sigma = sigma.clamp(*SIGMA.start(), *SIGMA.end());
        let add = |to: &mut [f64], step: &[f64]| to.iter_mut().zip(step).for_each(|(to, by)| *to += by);
        add(&mut look.ground, &step.ground());
        add(&mut look.levels, &step.levels());
        add(&mut self.own, &step.own());
    }

    /// The plane and its information.
    fn measured(&self, sums: &Sums, step: &Step, start: &PlaneImage) -> Result<PlaneFit, PoseError> {
        let sigma = self.look.sigma;
        if *SIGMA.start() >= sigma || sigma >= *SIGMA.end() {
            return Err(PoseError::Blur);
        }
        let off = self.plane.vector() - start.vector();
        let farthest = off.fixed_rows::<6>(0).amax() / start.scale();
        if farthest > 2.0 * LONGEST_STEP {
            return Err(PoseError::Elsewhere {
                off_pitches: farthest * 3.5,
            });
        }
        let scatter = sums.scatter();
        let scatter = if scatter > SCATTERED { scatter } else { 1.0 };
        let (information, unit) = (step.information(), self.plane.units());
        Ok(PlaneFit {
            image: self.plane,
            information: core::array::from_fn::<_, PLANE, _>(|i| {
                core::array::from_fn(|j| information[(i, j)] / (unit[i] * unit[j] * scatter))
            }),
        })
    }
}
