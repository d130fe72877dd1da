//! The normal equations of the fit, and their solution.
//!
//! The LEDs' individual deviations come first and the plane's numbers last. The last corner of the equations' Cholesky factor is then that
//! of the plane's information with all others unknown (its Schur complement), and no inverse is needed.

use heapless::Vec;
use link::panel::{LEDS, PanelFrame};
use nalgebra::{Cholesky, Const, SMatrix, SVector};

use super::PoseError;
use super::appearance::{Appearance, Sums};
use super::clipped_light::ClippedLight;
use super::leds::{LedRun, Leds};
use super::pixels::Pixels;
use super::plane::{Matrix8, PLANE, Vector8};

/// Positions of the shared parameters, after the LEDs' own: the levels of Off and On, the ground and its two slopes, the blur, the plane.
const SHARED: usize = LEDS;
const LEVELS: usize = 0;
const GROUND: usize = LEVELS + 2;
const BLUR: usize = GROUND + 3;
const IMAGE: usize = BLUR + 1;
/// The number of shared parameters.
pub(super) const SHARED_COUNT: usize = IMAGE + PLANE;
/// The number of all parameters.
const UNKNOWNS: usize = SHARED + SHARED_COUNT;

type Shared = SVector<f64, SHARED_COUNT>;
type Unknowns = Const<UNKNOWNS>;

/// Pixels of a row per pass.
const RUN: usize = 128;
/// The width of the surroundings, in pitches from the panel's cells.
pub(super) const AROUND: f64 = 1.2;
/// A pixel counts as unclipped if its mean rises by at least this share of more light.
const WHOLE: f64 = 0.999;

/// The equations, and further sums over the pixels.
pub(super) struct Equations {
    /// The lower triangle.
    normal: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    gradient: SVector<f64, UNKNOWNS>,
    pub sums: Sums,
    run: Run,
}

/// Pixels of a row.
struct Run {
    /// Derivatives of the light by the shared parameters.
    slopes: [Shared; RUN],
    /// Light of LEDs.
    lit: [f64; RUN],
    /// Curvature of the log-likelihood by the light; 0 for a pixel that is not in use.
    curved: [f64; RUN],
    /// Slope of the log-likelihood by the light; 0 for a pixel that is not in use.
    pull: [f64; RUN],
}

/// The model to compare with the pixels.
pub(super) struct Model<'a> {
    pub look: &'a Appearance,
    pub own: &'a [f64; LEDS],
    pub bits: PanelFrame,
    pub leds: &'a Leds,
}

/// The equations' solution.
pub(super) struct Step {
    factor: Cholesky<f64, Unknowns>,
    step: SVector<f64, UNKNOWNS>,
}

impl Equations {
    pub const EMPTY: Self = Self {
        normal: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; UNKNOWNS]; UNKNOWNS])),
        gradient: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; UNKNOWNS]; 1])),
        sums: Sums::NONE,
        run: Run {
            slopes: [Shared::from_array_storage(nalgebra::ArrayStorage([[0.0; SHARED_COUNT]; 1])); RUN],
            lit: [0.0; RUN],
            curved: [0.0; RUN],
            pull: [0.0; RUN],
        },
    };

    /// Compares a model with the pixels.
    pub fn sum<const N: usize>(&mut self, pixels: &Pixels<N>, model: &Model<'_>) -> Result<(), PoseError> {
        self.normal.fill(0.0);
        self.gradient.fill(0.0);
        self.sums = Sums::NONE;
        let mut pulls = [[[0.0; 2]; 2]; LEDS];
        let [width, height] = pixels.size;
        for row in 0..height {
            for from in (0..width).step_by(RUN) {
                let to = width.min(from + RUN);
                let shining: Vec<LedRun<'_>, LEDS> = model.leds.on(row, from, to).collect();
                self.run.draw(&shining, from, model, pixels, [row, from, to]);
                self.run.weigh(pixels, model, [row, from, to], &mut self.sums);
                self.add(&shining, from, to - from, &mut pulls);
            }
        }
        for (led, [pull, hold]) in pulls.iter().enumerate() {
            let strong = model.amplitude(led);
            for axis in 0..2 {
                let [pull, hold] = [strong * pull[axis], strong * strong * hold[axis]];
                self.sums.pull += pull * pull;
                self.sums.hold += hold;
            }
            let certainty = 1.0 / model.look.spread[usize::from(model.bits.led(led))];
            self.normal[(led, led)] += certainty;
            self.gradient[led] -= certainty * model.own[led];
        }
        // If all LEDs have one state, the level of the other is undetermined.
        (0..2).for_each(|i| self.normal[(SHARED + LEVELS + i, SHARED + LEVELS + i)] += 1e-9);
        if self.sums.pixels < (2 * SHARED_COUNT) as f64 {
            return Err(PoseError::OutsideFrame);
        }
        Ok(())
    }

    /// Adds a run of pixels.
    fn add(&mut self, shining: &[LedRun<'_>], from: usize, length: usize, pulls: &mut [[[f64; 2]; 2]; LEDS]) {
        let run = &self.run;
        let (mut squares, mut gradient) = ([Shared::zeros(); SHARED_COUNT], Shared::zeros());
        for (pixel, slopes) in run.slopes[..length].iter().enumerate() {
            let curved = slopes * run.curved[pixel];
            for (column, slope) in squares.iter_mut().zip(slopes) {
                *column += curved * *slope;
            }
            gradient += slopes * run.pull[pixel];
        }
        let mut corner = self.normal.fixed_view_mut::<SHARED_COUNT, SHARED_COUNT>(SHARED, SHARED);
        corner += SMatrix::from_columns(&squares);
        let mut shared = self.gradient.fixed_rows_mut::<SHARED_COUNT>(SHARED);
        shared += gradient;
        for (place, shine) in shining.iter().enumerate() {
            let first = shine.from - from;
            let (mut shared, mut gradient) = (Shared::zeros(), 0.0);
            let [pull, hold] = &mut pulls[shine.led];
            let mut weighed = [0.0; super::disc::PATCH];
            for (i, [disc, x, y, _]) in shine.light.iter().enumerate() {
                let (curved, off) = (run.curved[first + i], run.pull[first + i]);
                weighed[i] = curved * f64::from(*disc);
                gradient += off * f64::from(*disc);
                shared += run.slopes[first + i] * weighed[i];
                for (axis, slope) in [x, y].into_iter().enumerate() {
                    let slope = f64::from(*slope);
                    pull[axis] += off * slope;
                    hold[axis] += curved * slope * slope;
                }
            }
            self.gradient[shine.led] += gradient;
            let mut column = self.normal.fixed_view_mut::<SHARED_COUNT, 1>(SHARED, shine.led);
            column += shared;
            for other in &shining[place..] {
                let start = shine.from.max(other.from);
                let mine = weighed[..shine.light.len()].get(start - shine.from..);
                let theirs = other.light.get(start - other.from..);
                let (Some(mine), Some(theirs)) = (mine, theirs) else {
                    continue;
                };
                let both = mine.iter().zip(theirs);
                let shared: f64 = both.map(|(mine, [disc, ..])| mine * f64::from(*disc)).sum();
                self.normal[(other.led, shine.led)] += shared;
            }
        }
    }

    /// Solves the equations, for light alone or for all parameters.
    pub fn solve(&self, only_light: bool) -> Result<Step, PoseError> {
        let mut normal = self.normal;
        if only_light {
            (SHARED + BLUR..UNKNOWNS).for_each(|i| normal[(i, i)] += 1e12);
        }
        let factor = Cholesky::new(normal).ok_or(PoseError::Singular)?;
        let step = factor.solve(&self.gradient);
        Ok(Step { factor, step })
    }
}

impl Run {
    /// Draws light and slopes of pixels `from..to` of a row.
    fn draw<const N: usize>(
        &mut self,
        shining: &[LedRun<'_>],
        first: usize,
        model: &Model<'_>,
        pixels: &Pixels<N>,
        [row, from, to]: [usize; 3],
    ) {
        for column in from..to {
            let slopes = &mut self.slopes[column - from];
            slopes.fill(0.0);
            slopes.fixed_rows_mut::<3>(GROUND).copy_from_slice(&pixels.ground(column, row));
        }
        self.lit[..to - from].fill(0.0);
        for shine in shining {
            let strong = model.amplitude(shine.led);
            let [along, down] = model.leds.slopes[shine.led].map(|slopes| Vector8::from(slopes) * strong);
            let level = LEVELS + usize::from(model.bits.led(shine.led));
            let place = shine.from - first;
            let run = self.lit[place..].iter_mut().zip(&mut self.slopes[place..]);
            for ((lit, slopes), light) in run.zip(shine.light) {
                let [disc, x, y, sigma] = light.map(f64::from);
                *lit += strong * disc;
                slopes[level] += disc;
                slopes[BLUR] += strong * sigma;
                let mut image = slopes.fixed_rows_mut::<PLANE>(IMAGE);
                image += along * x + down * y;
            }
        }
    }

    /// Weighs each pixel's residual by its noise.
    fn weigh<const N: usize>(&mut self, pixels: &Pixels<N>, model: &Model<'_>, [row, from, to]: [usize; 3], sums: &mut Sums) {
        let look = model.look;
        for column in from..to {
            let place = column - from;
            (self.curved[place], self.pull[place]) = (0.0, 0.0);
            let (light, full, outside) = pixels.at(column, row);
            if outside > AROUND || (full && pixels.side > 1) {
                continue;
            }
            let ground = self.slopes[place].fixed_rows::<3>(GROUND);
            let lit = self.lit[place];
            let expected = ground.dot(&SVector::from(look.ground)) + lit;
            let expected = expected.max(0.0);
            let rounding = pixels.rounding_variance(expected);
            let uneven = model.leds.uneven * lit;
            let variance = look.noise_of(expected) + rounding + uneven * uneven;
            let Some(clipped) = ClippedLight::at(expected, variance, pixels.white) else {
                continue;
            };
            let off = light - clipped.mean;
            let weight = 1.0 / clipped.variance;
            if outside > 0.0 {
                sums.around[0] += off * off * weight;
                sums.around[1] += 1.0;
            }
            if outside > look.rim {
                continue;
            }
            self.curved[place] = weight * clipped.slope * clipped.slope;
            self.pull[place] = weight * clipped.slope * off;
            if clipped.slope > WHOLE {
                let exact = weight * weight;
                let squared = off * off - rounding;
                for (i, power) in [1.0, expected].into_iter().enumerate() {
                    sums.misfit[i] += exact * power * squared;
                }
                for (i, power) in [1.0, expected, expected * expected].into_iter().enumerate() {
                    sums.light[i] += exact * power;
                }
            }
            sums.pixels += 1.0;
        }
    }
}

impl Model<'_> {
    /// The light of an LED above the ground.
    fn amplitude(&self, led: usize) -> f64 {
        self.look.levels[usize::from(self.bits.led(led))] + self.own[led]
    }
}

impl Step {
    fn shared<const COUNT: usize>(&self, from: usize) -> [f64; COUNT] {
        self.step.fixed_rows::<COUNT>(SHARED + from).into_owned().data.0[0]
    }

    /// Steps of the plane's numbers, in its units.
    pub fn image(&self) -> Vector8 {
        self.shared::<PLANE>(IMAGE).into()
    }

    pub fn blur(&self) -> f64 {
        self.shared::<1>(BLUR)[0]
    }

    pub fn ground(&self) -> [f64; 3] {
        self.shared(GROUND)
    }

    pub fn levels(&self) -> [f64; 2] {
        self.shared(LEVELS)
    }

    pub fn own(&self) -> [f64; LEDS] {
        self.step.fixed_rows::<LEDS>(0).into_owned().data.0[0]
    }

    /// Variance of each LED's individual deviation.
    pub fn own_variance(&self) -> [f64; LEDS] {
        let factor = self.factor.l_dirty();
        core::array::from_fn(|led| {
            let mut column = SVector::<f64, UNKNOWNS>::zeros();
            column[led] = 1.0;
            // The factor's inverse is 0 above the diagonal.
            let mut below = column.rows_range_mut(led..);
            factor.view_range(led.., led..).solve_lower_triangular_unchecked_mut(&mut below);
            below.norm_squared()
        })
    }

    /// Fisher information of the plane's numbers, in its units, with all others unknown.
    pub fn information(&self) -> Matrix8 {
        let start = SHARED + IMAGE;
        let corner = self.factor.l_dirty().fixed_view::<PLANE, PLANE>(start, start);
        let corner = corner.lower_triangle();
        corner * corner.transpose()
    }

    /// The plane's step in standard deviations, squared: the expected decrease of the squared residual.
    pub fn squared(&self) -> f64 {
        let image = self.image();
        image.dot(&(self.information() * image))
    }
}
