//! Levels fitted to a frame by Gauss and Newton's method, in root light.

use super::image::{Image, SIDE_MAX};
use super::leds::LedLevels;
use super::level_prior::LevelPrior;
use super::level_prior::VARIANCE_PX2;
use super::levels::{LEVELS, Levels, Matrix, Vector};
use crate::spots::SPOT_PX;
use crate::spots::{SpotTable, dot};
use link::panel::LEDS;

/// The prior deviation of the spots' variance before any frame (share); no step is longer. Wider: a frame that hardly shows the blur
/// changes it more.
const USUAL_VARIANCE: f32 = 0.5;
/// The prior deviation of the LEDs' places (px).
const USUAL_SHIFT_PX: f32 = 0.2;
/// The most that one step shifts the LEDs (px).
const SHIFT_MAX_PX: f32 = 0.5;
/// The darkest background (light, 1 at middle grey).
const BACKGROUND_MIN: f32 = 1e-4;
/// Addition to a diagonal of ones: the resolution of f32.
const RIDGE: f32 = 1e-4;
/// Levels that follow flips by more are no longer linear in them (share of the contrast).
const TRUSTED: f32 = 0.03;

/// A row of slopes for each level, and one for the residuals.
const ROWS: usize = LEVELS + 1;
type Rows = [[f32; SIDE_MAX]; ROWS];

/// Gauss and Newton's normal equations about the levels of an image, scaled to ones on the diagonal.
pub(super) struct NormalEquations {
    normal: Matrix,
    right: Vector,
    scale: Vector,
}

/// The response of the levels to each LED's flip: R⁻ᵀ·B, where RᵀR are the levels' normal equations and B their products with the flips.
/// Its inner products are the Schur complement: the likelihood that refitted levels win back, in nats.
pub(super) type SchurFactor = [[f32; LEVELS]; LEDS];

impl NormalEquations {
    /// The equations about an image that holds the expectation of `levels` and of LEDs `lit` contrasts above Off.
    pub fn of<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &SpotTable,
        lit: &[f32; LEDS],
        levels: &Levels,
        prior: &LevelPrior,
    ) -> Self {
        Self::with_slopes(image, spots, lit, levels, prior, |_, _, _| ())
    }

    /// The [`SchurFactor`] of such an image; `None` if the levels are not determined.
    pub fn schur_factor<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &SpotTable,
        share: &[f32; LEDS],
        leds: &LedLevels,
        levels: &Levels,
        prior: &LevelPrior,
    ) -> Option<SchurFactor> {
        let mut schur = [[0.0; LEVELS]; LEDS];
        let equations = Self::with_slopes(image, spots, &leds.lit(share), levels, prior, |y, rows, weights| {
            add_products(spots, y, rows, weights, &mut schur);
        });
        let mut normal = equations.normal;
        for i in [1, 2] {
            let usual = TRUSTED * levels.contrast;
            normal[(i, i)] += levels.noise / (usual * usual) * equations.scale[i] * equations.scale[i];
        }
        let factor = normal.cholesky()?.l();
        let per_deviation = levels.contrast / libm::sqrtf(levels.noise);
        for ((schur, share), gain) in schur.iter_mut().zip(share).zip(&leds.gain) {
            let change = (1.0 - 2.0 * share) * gain * per_deviation;
            let mut vector = Vector::from(*schur).component_mul(&equations.scale) * change;
            factor.solve_lower_triangular_mut(&mut vector);
            *schur = vector.into();
        }
        Some(schur)
    }

    fn with_slopes<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &SpotTable,
        lit: &[f32; LEDS],
        levels: &Levels,
        prior: &LevelPrior,
        mut with_row: impl FnMut(usize, &Rows, &[f32; SIDE_MAX]),
    ) -> Self {
        let light = levels.light(lit);
        let [width, height] = image.size;
        let (mut rows, mut weights) = ([[0.0; SIDE_MAX]; ROWS], [0.0; SIDE_MAX]);
        let mut products = [[0.0f32; ROWS]; LEVELS];
        for y in 0..height {
            for row in &mut rows {
                row[..image.stride].fill(0.0);
            }
            rows[0][..width].fill(1.0);
            add_slopes(spots, lit, &light, y, &mut rows);
            weigh(image, y, &mut rows, &mut weights);
            with_row(y, &rows, &weights);
            for (i, products) in products.iter_mut().enumerate() {
                for (j, product) in products.iter_mut().enumerate().skip(i) {
                    *product += dot(&rows[i][..image.stride], &rows[j][..image.stride]);
                }
            }
        }
        let mut normal = Matrix::from_fn(|i, j| products[i.min(j)][i.max(j)]);
        let mut right = Vector::from_fn(|i, _| products[i][LEVELS]);
        if let Some((precision, score)) = prior.information(levels) {
            normal += levels.noise * precision;
            right += levels.noise * score;
        } else {
            let usual = [USUAL_VARIANCE * levels.variance, USUAL_SHIFT_PX, USUAL_SHIFT_PX];
            for (i, usual) in (3..).zip(usual) {
                normal[(i, i)] += levels.noise / (usual * usual);
            }
        }
        let scale = Vector::from_fn(|i, _| 1.0 / libm::sqrtf(normal[(i, i)].max(f32::MIN_POSITIVE)));
        let normal = Matrix::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 });
        Self {
            normal,
            right: right.component_mul(&scale),
            scale,
        }
    }

    /// Moves the levels to the solution, if there is one.
    pub fn step(self, levels: &mut Levels) {
        let Some(factor) = self.normal.cholesky() else {
            return;
        };
        let step = factor.solve(&self.right).component_mul(&self.scale);
        if !step.iter().all(|step| step.is_finite()) {
            return;
        }
        levels.background = (levels.background + step[0]).max(BACKGROUND_MIN);
        levels.off += step[1];
        levels.contrast += step[2];
        let usual = USUAL_VARIANCE * levels.variance;
        let (least, most) = (*VARIANCE_PX2.start(), *VARIANCE_PX2.end());
        levels.variance = (levels.variance + step[3].clamp(-usual, usual)).clamp(least, most);
        for (shift, step) in levels.shift.iter_mut().zip([step[4], step[5]]) {
            *shift += step.clamp(-SHIFT_MAX_PX, SHIFT_MAX_PX);
        }
    }

    /// The covariance of the levels, from the pixels and the prior.
    pub fn covariance(&self, noise: f32) -> Option<Matrix> {
        let inverse = self.normal.cholesky()?.inverse();
        Some(Matrix::from_fn(|i, j| inverse[(i, j)] * self.scale[i] * self.scale[j] * noise))
    }
}

/// Divides a row of slopes of light by twice the root of light, and sets the residuals. A pixel that is seen saturated and expected to be
/// has the residual 0.
fn weigh<const PIXELS: usize>(image: &Image<PIXELS>, y: usize, rows: &mut Rows, weights: &mut [f32; SIDE_MAX]) {
    let [width, _] = image.size;
    let start = y * image.stride;
    let (seen, root) = (&image.seen[start..][..width], &image.root[start..][..width]);
    for x in 0..width {
        let is_full = seen[x] >= image.full;
        let beyond = is_full && root[x] >= image.full;
        let seen = if is_full { image.full } else { seen[x] };
        weights[x] = if beyond { 0.0 } else { 0.5 / root[x] };
        rows[LEVELS][x] = if beyond { 0.0 } else { seen - root[x] };
    }
    for row in &mut rows[..LEVELS] {
        for (slope, weight) in row[..width].iter_mut().zip(&weights[..width]) {
            *slope *= weight;
        }
    }
}

/// Adds the derivatives of light in row `y` by Off light, contrast, variance and shift.
fn add_slopes(spots: &SpotTable, lit: &[f32; LEDS], light: &[f32; LEDS], y: usize, [_, all, on, variance, x_shift, y_shift, _]: &mut Rows) {
    let precision = 1.0 / spots.variance;
    for led in 0..LEDS {
        let ([left, _], Some(down)) = (spots.first(led), spots.down_at(led, y)) else {
            continue;
        };
        let [centre_x, centre_y] = spots.centre[led];
        let (bright, is_on) = (down * light[led], down * lit[led]);
        let dy = (y as f32 - centre_y) * precision;
        let around = dy * dy - 2.0 * precision;
        let across = spots.across(led);
        let range = left..left + across.len();
        let (all, on) = (&mut all[range.clone()], &mut on[range.clone()]);
        let variance = &mut variance[range.clone()];
        let (x_shift, y_shift) = (&mut x_shift[range.clone()], &mut y_shift[range]);
        let offset = left as f32 - centre_x;
        for (i, &across) in across.iter().enumerate() {
            let dx = (offset + i as i32 as f32) * precision;
            let shaped = bright * across;
            all[i] += down * across;
            on[i] += is_on * across;
            variance[i] += 0.5 * shaped * (dx * dx + around);
            x_shift[i] += shaped * dx;
            y_shift[i] += shaped * dy;
        }
    }
}

/// Adds row `y` to the inner products of each LED's spot with the slopes, both in root light.
fn add_products(spots: &SpotTable, y: usize, rows: &Rows, weights: &[f32; SIDE_MAX], schur: &mut SchurFactor) {
    for (led, schur) in schur.iter_mut().enumerate() {
        let ([left, _], Some(down)) = (spots.first(led), spots.down_at(led, y)) else {
            continue;
        };
        let across = spots.across(led);
        let mut spot = [0.0; SPOT_PX];
        let spot = &mut spot[..across.len()];
        for ((to, &across), &weight) in spot.iter_mut().zip(across).zip(&weights[left..]) {
            *to = down * across * weight;
        }
        for (schur, row) in schur.iter_mut().zip(rows) {
            *schur += dot(spot, &row[left..]);
        }
    }
}
