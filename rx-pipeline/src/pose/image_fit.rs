//! The image of the panel's plane that makes the pixels likeliest, and how exactly they tell it.
//!
//! In linear light, 1 at grey 118, a pixel sees
//!
//! ```text
//! x = ground(pixel) + Σ (level + own_k)·h_k(pixel),    level of Off or of On by the LED's bit
//! ```
//!
//! where the ground is a plane, and h_k the disc of LED k as the plane's image shows it, blurred by the lens and summed by the pixel. All
//! of it is fitted at once: eight numbers of the plane, the blur, ground and levels, and each LED's own difference, which is held to be
//! small by as much as the LEDs turn out to differ (a random effect; Laird & Ware 1982). Pixels weigh by their noise, of variance
//! v0 + v1·x and that of rounding, which is estimated from what is left; a full pixel is expected to be what is left of it when it is cut
//! (its first two moments; quasi-likelihood, Wedderburn 1974).
//!
//! What the pixels tell of the plane is their Fisher information, with all others unknown (its Schur complement). Errors of the model are
//! as wide as an LED: where LEDs are scattered about the plane's lattice by more than noise would do, the information is less by as much.

use heapless::Vec;
use link::panel::{LEDS, PanelFrame, SIDE};
use nalgebra::{Cholesky, Matrix2, SMatrix, SVector, Vector2};

use super::cut::Cut;
use super::disc::{Patch, Points};
use super::pixels::{Pixels, rounding_variance};
use super::plane::{PlaneImage, Vector8};
use super::{PoseError, Seen};
use crate::corners::Corners;

/// Numbers of the plane.
const PLANE: usize = 8;
/// Places of the others: the blur, the ground and its two slopes, two levels, and the LEDs' own differences.
const BLUR: usize = PLANE;
const GROUND: usize = BLUR + 1;
const LEVELS: usize = GROUND + 3;
const OWN: usize = LEVELS + 2;
const UNKNOWNS: usize = OWN + LEDS;

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Step = SVector<f64, UNKNOWNS>;

/// Rounds in which only light is fitted, those after which all around the panel is looked at, those in which noise and the LEDs' spread are
/// learnt, and the least and the most of all.
const LIGHT_ROUNDS: usize = 2;
const INNER_ROUNDS: usize = 6;
const LEARNING_ROUNDS: usize = 14;
const LEAST_ROUNDS: usize = 10;
/// From here on, half steps: whole ones may go to and fro.
const RELAXED_ROUNDS: usize = 18;
/// From here on, a seventh of a standard deviation is settled: a pixel that is cut or not may go to and fro for ever.
const LATE_ROUNDS: usize = 30;
const MOST_ROUNDS: usize = 50;
/// Squared step of the plane, in standard deviations, below which it has settled, and late.
const SETTLED: f64 = 1e-3;
const SETTLED_LATE: f64 = 0.02;
/// The most that the plane changes in a round, in half sides: half a pitch.
const LONGEST_STEP: f64 = 0.5 / 3.5;
/// What is around the panel is plain if its squared misfit is no more than this share above noise.
const PLAIN: f64 = 1.3;
/// Around it: so many pitches from its cells, and at least so many pixels.
const AROUND: f64 = 1.2;
const AROUND_PIXELS: f64 = 40.0;
/// How far light from beyond the cells is reckoned to reach where it is not plain, in standard deviations of the blur.
const CARRIED: f64 = 1.5;
/// LEDs differ by this share of an On LED's light where nothing is known (standard deviation).
const USUAL_SPREAD: f64 = 0.03;
/// The least they are taken to: no LEDs are more alike, nor is any model of their images better.
const LEAST_SPREAD: f64 = 0.01;
/// LEDs' scatter about the lattice, over noise's, that is more than chance.
const SCATTERED: f64 = 1.5;
/// Images of LEDs are known to this share of their light, where the noise is less: discs are drawn to 0.002 (see the test in
/// `disc`), no lamp is an even disc, and neither averages out over LEDs as noise does.
const UNEVEN: f64 = 0.003;
/// Range of the blur in the pixels that are looked at: sharper ones hide between them, wider ones are cut.
const SIGMA: core::ops::RangeInclusive<f64> = 0.2..=2.3;

/// The image of the panel's plane as a frame shows it, and how exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFit {
    /// The image.
    pub image: PlaneImage,
    /// Fisher information of its eight numbers, in the order of their fields: the inverse of their covariance.
    pub information: [[f64; 8]; 8],
}

/// All that is fitted, but for what stays.
#[derive(Clone, Copy)]
struct Estimate {
    plane: PlaneImage,
    sigma: f64,
    ground: [f64; 3],
    levels: [f64; 2],
    own: [f64; LEDS],
    /// Variance of the LEDs' own differences, of Off and of On ones.
    spread: [f64; 2],
    /// Variance of a pixel without light, and what light 1 adds to it.
    noise: [f64; 2],
    /// Pixels count up to here, in pitches outside the panel's cells.
    rim: f64,
}

/// What the pixels call for.
struct Sums {
    normal: Normal,
    gradient: Step,
    /// Squared misfits, over what light there is: for the noise.
    misfit: [f64; 2],
    light: [f64; 3],
    pixels: f64,
    /// Squared misfit over noise of what is around, and its pixels.
    around: [f64; 2],
    /// Pull on each LED along x and y, and how much noise would pull.
    pull: [[f64; 2]; LEDS],
    hold: [[f64; 2]; LEDS],
}

/// Memory of a fit.
pub(super) struct ImageFit<const N: usize> {
    pixels: Pixels<N>,
    patches: [Patch; LEDS],
    /// What a change of the plane does to the places of the LEDs' images (px).
    slopes: [[[f64; PLANE]; 2]; LEDS],
}

impl<const N: usize> ImageFit<N> {
    pub const EMPTY: Self = Self {
        pixels: Pixels::EMPTY,
        patches: [const { Patch::EMPTY }; LEDS],
        slopes: [[[0.0; PLANE]; 2]; LEDS],
    };

    /// Fits the image of a panel that was read.
    pub fn fit(&mut self, seen: &Seen<'_>) -> Result<PlaneFit, PoseError> {
        let Seen {
            frame,
            corners,
            bits,
            camera,
            lens,
            ..
        } = *seen;
        self.pixels.take(frame, corners, camera)?;
        let start = PlaneImage::through(corners, lens).ok_or(PoseError::NoRay)?;
        let blur = f64::from(camera.blur_sigma_px) / self.pixels.side as f64;
        let mut now = Estimate {
            plane: start,
            sigma: blur.clamp(*SIGMA.start(), *SIGMA.end()),
            ground: [1.0, 0.0, 0.0],
            levels: [0.0; 2],
            own: [0.0; LEDS],
            spread: [1.0; 2],
            noise: [1e-3, 1e-3],
            rim: 0.0,
        };
        for round in 0..MOST_ROUNDS {
            let sums = self.sums(&now, seen)?;
            if round == INNER_ROUNDS {
                now.rim = self.rim(&now, &sums, corners);
                continue;
            }
            let mut normal = sums.normal;
            if round < LIGHT_ROUNDS {
                (0..=BLUR).for_each(|i| normal[(i, i)] += 1e12);
            }
            let solved = Cholesky::new(normal).ok_or(PoseError::Singular)?;
            let step = solved.solve(&sums.gradient);
            let covariance = solved.inverse();
            let share = match round {
                ..LIGHT_ROUNDS => 0.0,
                LIGHT_ROUNDS..RELAXED_ROUNDS => 1.0,
                _ => 0.5,
            };
            let moved = now.stepped(&step, share);
            let plane_step = step.fixed_rows::<PLANE>(0).into_owned();
            let plane = covariance.fixed_view::<PLANE, PLANE>(0, 0).into_owned();
            let certainty = plane.cholesky().ok_or(PoseError::Singular)?;
            let squared = plane_step.dot(&certainty.solve(&plane_step));
            if !squared.is_finite() {
                return Err(PoseError::Singular);
            }
            let settled = if round < LATE_ROUNDS {
                SETTLED
            } else {
                SETTLED_LATE
            };
            if round >= LEAST_ROUNDS && squared < settled {
                return now.measured(&sums, &covariance, &start);
            }
            now = moved;
            if round < LEARNING_ROUNDS {
                now.learn_spread(bits, &covariance, round == 0);
                if round > 0 {
                    now.learn_noise(&sums, &covariance, bits);
                }
            }
        }
        Err(PoseError::NotSettled {
            rounds: MOST_ROUNDS,
        })
    }

    /// How far outside the cells pixels count: all if it is plain there, and only those that no light from there reaches if it is not.
    fn rim(&self, now: &Estimate, sums: &Sums, corners: &Corners) -> f64 {
        let [misfit, count] = sums.around;
        if count >= AROUND_PIXELS && misfit < PLAIN * count {
            return AROUND;
        }
        let pitch = f64::from(corners.pitch_px()) / self.pixels.side as f64;
        if count < AROUND_PIXELS {
            0.0
        } else {
            -CARRIED * now.sigma / pitch
        }
    }

    /// Draws the LEDs' images.
    fn draw(&mut self, now: &Estimate, panel: &Seen<'_>) -> Result<(), PoseError> {
        const STEP: f64 = 1e-6;
        let lens = panel.lens;
        // In half sides of the panel.
        let radius = panel.size.led_diameter_m / 2.0 / panel.size.half_side_m();
        let side = self.pixels.side as f64;
        let pixels = &self.pixels;
        for led in 0..LEDS {
            let half = (SIDE as f64 - 1.0) / 2.0;
            let place = [
                (led % SIDE) as f64 / half - 1.0,
                (led / SIDE) as f64 / half - 1.0,
            ];
            let seen = |du: f64, dv: f64| {
                pixels.seen_at(lens.pixel(now.plane.direction([place[0] + du, place[1] + dv])))
            };
            let [x, y] = seen(0.0, 0.0);
            let [width, height] = pixels.size.map(|length| length as f64);
            if !(x > -1.0 && y > -1.0 && x < width && y < height) {
                return Err(PoseError::OutsideFrame);
            }
            let rim = |du: f64, dv: f64| {
                let (ahead, behind) = (seen(du, dv), seen(-du, -dv));
                [0, 1].map(|axis| (ahead[axis] - behind[axis]) / 2.0)
            };
            let ([ax, ay], [bx, by]) = (rim(radius, 0.0), rim(0.0, radius));
            let area = core::f64::consts::PI * (ax * by - ay * bx).abs();
            let widest = libm::hypot(ax, ay).max(libm::hypot(bx, by));
            let points = Points::of(widest, now.sigma);
            // A lamp is as bright from any distance: its nearer parts give more light, as they are seen in more pixels.
            let depth = now.plane.depth(place);
            let placed = points.iter().map(|([u, v], share)| {
                let (du, dv) = (radius * u, radius * v);
                let farther = now.plane.depth([place[0] + du, place[1] + dv]) / depth;
                (seen(du, dv), share * area / (farther * farther * farther))
            });
            self.patches[led].draw(placed, now.sigma);
            let direction = now.plane.direction(place);
            let ray = |i: usize, by: f64| {
                let mut moved = direction;
                moved[i] += by;
                lens.pixel(moved)
            };
            let along = [0, 1].map(|i| {
                let (ahead, behind) = (ray(i, STEP), ray(i, -STEP));
                [0, 1].map(|axis| (ahead[axis] - behind[axis]) / (2.0 * STEP) / side)
            });
            let slopes = now.plane.slopes(place);
            let unit = now.units();
            for (axis, led) in self.slopes[led].iter_mut().enumerate() {
                for (number, slope) in led.iter_mut().enumerate() {
                    let plane =
                        along[0][axis] * slopes[0][number] + along[1][axis] * slopes[1][number];
                    *slope = plane * unit[number];
                }
            }
        }
        Ok(())
    }

    /// Holds an estimate against the pixels.
    fn sums(&mut self, now: &Estimate, panel: &Seen<'_>) -> Result<Sums, PoseError> {
        self.draw(now, panel)?;
        let mut sums = Sums {
            normal: Normal::zeros(),
            gradient: Step::zeros(),
            misfit: [0.0; 2],
            light: [0.0; 3],
            pixels: 0.0,
            around: [0.0; 2],
            pull: [[0.0; 2]; LEDS],
            hold: [[0.0; 2]; LEDS],
        };
        let amplitude: [f64; LEDS] =
            core::array::from_fn(|led| now.levels[usize::from(panel.bits.led(led))] + now.own[led]);
        let [width, height] = self.pixels.size;
        let frame_pixels = self.pixels.side * self.pixels.side;
        for row in 0..height {
            let in_row: Vec<usize, LEDS> = (0..LEDS)
                .filter(|&led| self.patches[led].has_row(row))
                .collect();
            for column in 0..width {
                let (light, full, outside) = self.pixels.at(column, row);
                let is_counted = outside <= now.rim;
                if outside > AROUND || (full && frame_pixels > 1) {
                    continue;
                }
                // What of it each LED gives.
                let leds: Vec<(usize, [f64; 4]), LEDS> = in_row
                    .iter()
                    .filter_map(|&led| Some((led, self.patches[led].at(column, row)?)))
                    .collect();
                let ground = self.ground(column, row);
                let lit: f64 = leds
                    .iter()
                    .map(|(led, here)| amplitude[*led] * here[0])
                    .sum();
                let expected = (0..3).map(|i| now.ground[i] * ground[i]).sum::<f64>() + lit;
                let expected = expected.max(0.0);
                let rounding = rounding_variance(panel.camera, expected, frame_pixels);
                let variance = now.noise[0]
                    + now.noise[1] * expected
                    + rounding
                    + (UNEVEN * lit) * (UNEVEN * lit);
                let Some(cut) = Cut::at(expected, variance, self.pixels.white) else {
                    continue;
                };
                let off = light - cut.mean;
                let weight = 1.0 / cut.variance;
                if outside > 0.0 {
                    sums.around[0] += off * off * weight;
                    sums.around[1] += 1.0;
                }
                if !is_counted {
                    continue;
                }
                let mut slopes = [0.0; OWN];
                for &(led, [disc, x, y, sigma]) in &leds {
                    let (strong, along) = (amplitude[led], &self.slopes[led]);
                    for (i, slope) in slopes[..PLANE].iter_mut().enumerate() {
                        *slope += strong * (x * along[0][i] + y * along[1][i]);
                    }
                    slopes[BLUR] += strong * sigma;
                    slopes[LEVELS + usize::from(panel.bits.led(led))] += disc;
                    for (axis, slope) in [x, y].into_iter().enumerate() {
                        let pull = strong * slope * cut.slope;
                        sums.pull[led][axis] += weight * pull * off;
                        sums.hold[led][axis] += weight * pull * pull;
                    }
                }
                slopes[GROUND..LEVELS].copy_from_slice(&ground);
                sums.add(&slopes, &leds, cut.slope, weight, off);
                if cut.slope > 0.999 {
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
        for led in 0..LEDS {
            let certainty = 1.0 / now.spread[usize::from(panel.bits.led(led))];
            sums.normal[(OWN + led, OWN + led)] += certainty;
            sums.gradient[OWN + led] -= certainty * now.own[led];
        }
        // Where all LEDs are alike, the other level is anything.
        (LEVELS..OWN).for_each(|i| sums.normal[(i, i)] += 1e-9);
        if sums.pixels < (2 * OWN) as f64 {
            return Err(PoseError::OutsideFrame);
        }
        sums.mirror();
        Ok(sums)
    }

    /// The ground's plane: its middle and its slopes across the window.
    fn ground(&self, column: usize, row: usize) -> [f64; 3] {
        let [width, height] = self.pixels.size.map(|length| length as f64);
        [
            1.0,
            2.0 * column as f64 / width - 1.0,
            2.0 * row as f64 / height - 1.0,
        ]
    }
}

impl Sums {
    fn add(
        &mut self,
        slopes: &[f64; OWN],
        leds: &[(usize, [f64; 4])],
        cut: f64,
        weight: f64,
        off: f64,
    ) {
        let curved = weight * cut * cut;
        let pull = weight * cut * off;
        for i in 0..OWN {
            for j in 0..=i {
                self.normal[(i, j)] += curved * slopes[i] * slopes[j];
            }
            self.gradient[i] += pull * slopes[i];
        }
        for (place, &(led, [disc, ..])) in leds.iter().enumerate() {
            let row = OWN + led;
            for (i, slope) in slopes.iter().enumerate() {
                self.normal[(row, i)] += curved * disc * slope;
            }
            for &(other, [beside, ..]) in &leds[..=place] {
                self.normal[(row, OWN + other)] += curved * disc * beside;
            }
            self.gradient[row] += pull * disc;
        }
    }

    /// Fills the upper triangle in.
    fn mirror(&mut self) {
        for i in 0..UNKNOWNS {
            for j in 0..i {
                self.normal[(j, i)] = self.normal[(i, j)];
            }
        }
    }
}

impl Estimate {
    /// What a step of 1 of each of the plane's numbers is.
    fn units(&self) -> [f64; PLANE] {
        let scale = self.plane.scale();
        core::array::from_fn(|i| if i < 6 { scale } else { 1.0 })
    }

    fn stepped(&self, step: &Step, share: f64) -> Self {
        let mut next = *self;
        let farthest = step.fixed_rows::<PLANE>(0).amax();
        let share = share * (LONGEST_STEP / farthest).min(1.0);
        let unit = self.units();
        let mut plane = self.plane.vector();
        (0..PLANE).for_each(|i| plane[i] += share * unit[i] * step[i]);
        next.plane = PlaneImage::of_vector(&plane);
        let sigma = (self.sigma + share * step[BLUR]).clamp(0.7 * self.sigma, 1.4 * self.sigma);
        next.sigma = sigma.clamp(*SIGMA.start(), *SIGMA.end());
        (0..3).for_each(|i| next.ground[i] += step[GROUND + i]);
        (0..2).for_each(|i| next.levels[i] += step[LEVELS + i]);
        (0..LEDS).for_each(|led| next.own[led] += step[OWN + led]);
        next
    }

    /// Learns by how much LEDs differ: their squared differences over how many of them the pixels tell (MacKay 1992).
    fn learn_spread(&mut self, bits: PanelFrame, covariance: &Normal, is_first: bool) {
        let contrast = (self.levels[1] - self.levels[0]).abs();
        let square = |share: f64| share * share * contrast * contrast;
        for (on, spread) in self.spread.iter_mut().enumerate() {
            if is_first {
                *spread = square(USUAL_SPREAD);
                continue;
            }
            let (mut squares, mut told) = (0.0, 0.0);
            for led in (0..LEDS).filter(|&led| usize::from(bits.led(led)) == on) {
                squares += self.own[led] * self.own[led];
                told += 1.0 - covariance[(OWN + led, OWN + led)] / *spread;
            }
            if told > 0.0 {
                *spread = squares / told;
            }
            *spread = spread.max(square(LEAST_SPREAD)).max(f64::MIN_POSITIVE);
        }
        if is_first {
            self.own = [0.0; LEDS];
        }
    }

    /// Learns the noise from what is left, by regression on the light.
    fn learn_noise(&mut self, sums: &Sums, covariance: &Normal, bits: PanelFrame) {
        let free: f64 = (0..LEDS)
            .map(|led| {
                1.0 - covariance[(OWN + led, OWN + led)] / self.spread[usize::from(bits.led(led))]
            })
            .sum();
        let used = OWN as f64 + free.clamp(0.0, LEDS as f64);
        let [a, b, c] = sums.light;
        let share = sums.pixels / (sums.pixels - used).max(1.0);
        let misfit = Vector2::from(sums.misfit) * share;
        let alone = [misfit.x / a, misfit.y / c];
        let both = Matrix2::new(a, b, b, c)
            .try_inverse()
            .map(|inverse| inverse * misfit);
        let [dark, of_light] = match both {
            Some(noise) if noise.x >= 0.0 && noise.y >= 0.0 => [noise.x, noise.y],
            Some(noise) if noise.x < 0.0 => [0.0, alone[1]],
            _ => [alone[0], 0.0],
        };
        self.noise = [dark.max(1e-9), of_light.max(0.0)];
    }

    /// The plane and what is known of it.
    fn measured(
        &self,
        sums: &Sums,
        covariance: &Normal,
        start: &PlaneImage,
    ) -> Result<PlaneFit, PoseError> {
        if *SIGMA.start() >= self.sigma || self.sigma >= *SIGMA.end() {
            return Err(PoseError::Blur);
        }
        let off = self.plane.vector() - start.vector();
        let farthest = off.fixed_rows::<6>(0).amax() / start.scale();
        if farthest > 2.0 * LONGEST_STEP {
            return Err(PoseError::Elsewhere {
                off_pitches: farthest * 3.5,
            });
        }
        let unit = Vector8::from(self.units());
        let plane = covariance.fixed_view::<PLANE, PLANE>(0, 0);
        let total = |of: &[[f64; 2]; LEDS], power: i32| {
            of.iter()
                .flatten()
                .map(|c| if power == 2 { c * c } else { *c })
                .sum::<f64>()
        };
        let scatter = total(&sums.pull, 2) / total(&sums.hold, 1);
        let scatter = if scatter > SCATTERED { scatter } else { 1.0 };
        let information = plane
            .into_owned()
            .cholesky()
            .ok_or(PoseError::Singular)?
            .inverse();
        let information = core::array::from_fn(|i| {
            core::array::from_fn(|j| information[(i, j)] / (unit[i] * unit[j] * scatter))
        });
        Ok(PlaneFit {
            image: self.plane,
            information,
        })
    }
}
