//! What the panel's image depends on beside its bits, fitted to a frame by Gauss and Newton's method in root light.

use super::experience::Experience;
use super::image::{Image, SIDE_MAX};
use super::spots::{LANES, Spots, TAPS};
use link::panel::LEDS;
use nalgebra::{SMatrix, SVector};

/// The levels of a panel's image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Levels {
    /// Light of the background.
    pub background: f32,
    /// By how much an Off LED's light exceeds the background's, times its area in px².
    pub off: f32,
    /// By how much an On LED's exceeds an Off one's, times its area in px².
    pub contrast: f32,
    /// Variance of an LED's image in each direction, in px²: lens blur, LED and pixel.
    pub variance: f32,
    /// By how much the LEDs stand beside where the corners say, in px.
    pub shift: [f32; 2],
    /// Variance of a pixel's root light about the model.
    pub noise: f32,
}

impl Levels {
    /// Light above the background, times its area, of LEDs that are On for a `share` of the exposure.
    pub fn light(&self, share: &[f32; LEDS]) -> [f32; LEDS] {
        share.map(|share| self.off + self.contrast * share)
    }

    /// All but the noise.
    pub fn values(&self) -> [f32; LEVELS] {
        let [x, y] = self.shift;
        [
            self.background,
            self.off,
            self.contrast,
            self.variance,
            x,
            y,
        ]
    }

    pub fn from_values(
        [background, off, contrast, variance, x, y]: [f32; LEVELS],
        noise: f32,
    ) -> Self {
        Self {
            background,
            off,
            contrast,
            variance,
            shift: [x, y],
            noise,
        }
    }
}

/// What is fitted: background, Off, contrast, variance, and a shift of the LEDs in x and y.
pub(super) const LEVELS: usize = 6;
/// A row of slopes for each, and one of what is to be explained.
const ROWS: usize = LEVELS + 1;
type Rows = [[f32; SIDE_MAX]; ROWS];
pub(super) type Vector = SVector<f32, LEVELS>;
pub(super) type Matrix = SMatrix<f32, LEVELS, LEVELS>;

/// Deviations of the spots' variance, relatively, and of the LEDs' places, in px, that are nothing unusual.
const USUAL_VARIANCE: f32 = 0.5;
const USUAL_SHIFT_PX: f32 = 0.2;
/// The range of the spots' variance, in px².
const VARIANCE_RANGE: [f32; 2] = [0.2, 9.0];
/// The most that one step shifts the LEDs.
const SHIFT_MAX_PX: f32 = 0.5;
/// The darkest background.
const BACKGROUND_MIN: f32 = 1e-4;
/// What is added to the scaled normal matrix's diagonal: f32 can tell no less.
const RIDGE: f32 = 1e-4;

/// Levels that follow flips by more than this part of the contrast are no longer linear in them.
const TRUSTED: f32 = 0.03;

/// Gauss and Newton's normal equations about the levels of an image, scaled to ones on the diagonal.
pub(super) struct Equations {
    normal: Matrix,
    right: Vector,
    scale: Vector,
}

/// By how much each LED's flip pulls at the levels: its inner products are the likelihood that refitted levels win back, in
/// nats.
pub(super) type Pull = [[f32; LEVELS]; LEDS];

impl Equations {
    /// The equations where the image holds what is expected of `share` and `levels`.
    pub fn of<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &Spots,
        share: &[f32; LEDS],
        levels: &Levels,
        experience: &Experience,
    ) -> Self {
        Self::while_pulling(image, spots, share, levels, experience, |_, _, _| ())
    }

    /// The same, and the [`Pull`] of each LED.
    pub fn and_pull<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &Spots,
        share: &[f32; LEDS],
        levels: &Levels,
        experience: &Experience,
    ) -> Option<Pull> {
        let mut pull = [[0.0; LEVELS]; LEDS];
        let equations = Self::while_pulling(
            image,
            spots,
            share,
            levels,
            experience,
            |y, rows, weights| {
                add_pull(spots, y, rows, weights, &mut pull);
            },
        );
        let mut normal = equations.normal;
        for i in [1, 2] {
            let usual = TRUSTED * levels.contrast;
            normal[(i, i)] +=
                levels.noise / (usual * usual) * equations.scale[i] * equations.scale[i];
        }
        let factor = normal.cholesky()?.l();
        let per_deviation = levels.contrast / libm::sqrtf(levels.noise);
        for (pull, share) in pull.iter_mut().zip(share) {
            let change = (1.0 - 2.0 * share) * per_deviation;
            let mut vector = Vector::from(*pull).component_mul(&equations.scale) * change;
            factor.solve_lower_triangular_mut(&mut vector);
            *pull = vector.into();
        }
        Some(pull)
    }

    fn while_pulling<const PIXELS: usize>(
        image: &Image<PIXELS>,
        spots: &Spots,
        share: &[f32; LEDS],
        levels: &Levels,
        experience: &Experience,
        mut pulling: impl FnMut(usize, &Rows, &[f32; SIDE_MAX]),
    ) -> Self {
        let light = levels.light(share);
        let [width, height] = image.size;
        let (mut rows, mut weights) = ([[0.0; SIDE_MAX]; ROWS], [0.0; SIDE_MAX]);
        let mut products = [[0.0f32; ROWS]; LEVELS];
        for y in 0..height {
            for row in &mut rows {
                row[..image.stride].fill(0.0);
            }
            rows[0][..width].fill(1.0);
            add_slopes(spots, share, &light, y, &mut rows);
            weigh(image, y, &mut rows, &mut weights);
            pulling(y, &rows, &weights);
            for (i, products) in products.iter_mut().enumerate() {
                for (j, product) in products.iter_mut().enumerate().skip(i) {
                    *product += dot(&rows[i][..image.stride], &rows[j][..image.stride]);
                }
            }
        }
        let mut normal = Matrix::from_fn(|i, j| products[i.min(j)][i.max(j)]);
        let mut right = Vector::from_fn(|i, _| products[i][LEVELS]);
        if let Some((precision, pull)) = experience.prior(levels) {
            normal += levels.noise * precision;
            right += levels.noise * pull;
        } else {
            let usual = [
                USUAL_VARIANCE * levels.variance,
                USUAL_SHIFT_PX,
                USUAL_SHIFT_PX,
            ];
            for (i, usual) in (3..).zip(usual) {
                normal[(i, i)] += levels.noise / (usual * usual);
            }
        }
        let scale =
            Vector::from_fn(|i, _| 1.0 / libm::sqrtf(normal[(i, i)].max(f32::MIN_POSITIVE)));
        let normal = Matrix::from_fn(|i, j| {
            normal[(i, j)] * scale[i] * scale[j] + if i == j { RIDGE } else { 0.0 }
        });
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
        let [least, most] = VARIANCE_RANGE;
        levels.variance = (levels.variance + step[3].clamp(-usual, usual)).clamp(least, most);
        for (shift, step) in levels.shift.iter_mut().zip([step[4], step[5]]) {
            *shift += step.clamp(-SHIFT_MAX_PX, SHIFT_MAX_PX);
        }
    }

    /// The covariance that the pixels and the experience leave to the levels.
    pub fn covariance(&self, noise: f32) -> Option<Matrix> {
        let inverse = self.normal.cholesky()?.inverse();
        Some(Matrix::from_fn(|i, j| {
            inverse[(i, j)] * self.scale[i] * self.scale[j] * noise
        }))
    }
}

/// Divides a row of slopes of light by twice the root of light, and sets what is to be explained. What is expected beyond
/// saturation where it was seen explains itself.
fn weigh<const PIXELS: usize>(
    image: &Image<PIXELS>,
    y: usize,
    rows: &mut Rows,
    weights: &mut [f32; SIDE_MAX],
) {
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

/// Adds the change of light in row `y` with Off light, contrast, variance and shift.
fn add_slopes(
    spots: &Spots,
    share: &[f32; LEDS],
    light: &[f32; LEDS],
    y: usize,
    [_, all, on, variance, x_shift, y_shift, _]: &mut Rows,
) {
    let precision = 1.0 / spots.variance;
    for led in 0..LEDS {
        let ([left, _], Some(down)) = (spots.first[led], spots.down_at(led, y)) else {
            continue;
        };
        let [centre_x, centre_y] = spots.centre[led];
        let (lit, is_on) = (down * light[led], down * share[led]);
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
            let shaped = lit * across;
            all[i] += down * across;
            on[i] += is_on * across;
            variance[i] += 0.5 * shaped * (dx * dx + around);
            x_shift[i] += shaped * dx;
            y_shift[i] += shaped * dy;
        }
    }
}

/// Adds row `y` to the inner products of each LED's spot with the slopes, both in root light.
fn add_pull(spots: &Spots, y: usize, rows: &Rows, weights: &[f32; SIDE_MAX], pull: &mut Pull) {
    for (led, pull) in pull.iter_mut().enumerate() {
        let ([left, _], Some(down)) = (spots.first[led], spots.down_at(led, y)) else {
            continue;
        };
        let across = spots.across(led);
        let mut spot = [0.0; TAPS];
        let spot = &mut spot[..across.len()];
        for ((to, &across), &weight) in spot.iter_mut().zip(across).zip(&weights[left..]) {
            *to = down * across * weight;
        }
        for (pull, row) in pull.iter_mut().zip(rows) {
            *pull += dot(spot, &row[left..]);
        }
    }
}

/// Σ a·b over the length of `a`, which is a multiple of [`LANES`].
pub(super) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}
