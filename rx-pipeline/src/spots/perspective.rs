//! The tilt of a near panel: nearer LEDs are farther apart in the image.
//!
//! Tilt moves LEDs by the square of their distance from the middle. After subtraction of the common shift, that is nearly uncorrelated with
//! the other parameters, so it has a step of its own.

use super::lattice_model::LatticeModel;
use super::slope::Slope;
use crate::lattice::MIDDLE;
use link::panel::{LEDS, SIDE};

/// The greatest change of a near panel's tilt in a step (share of its distance, per LED). Higher: followed sooner, and noise too.
const TILT_STEP: f32 = 0.01;
/// The greatest tilt (share of its distance, per LED): a panel of 0.6 m at 1 m, from 40° to the side.
const TILT_MAX: f32 = 0.05;

impl LatticeModel {
    /// The lattice with its tilt after one step down the slope.
    pub fn tilted(&self, slope: &Slope) -> Self {
        let variance = self.sigma * self.sigma;
        let mut strength = [0.0; LEDS];
        let mut along = [[[0.0; 2]; 2]; LEDS];
        let (mut total, mut mean) = (0.0, [[0.0; 2]; 2]);
        for led in 0..LEDS {
            let (column, row) = ((led % SIDE) as f32, (led / SIDE) as f32);
            let amplitude = self.amplitude(led);
            let at = self.lattice.position(column, row);
            let (u, v) = (column - MIDDLE, row - MIDDLE);
            let nearness = 1.0 / self.lattice.distance(u, v);
            strength[led] = amplitude * amplitude * slope.led[led].spread / (2.0 * variance * variance);
            total += strength[led];
            for (tilt, along_tilt) in [u, v].into_iter().zip(&mut along[led]) {
                *along_tilt = [0, 1].map(|axis| -tilt * nearness * (at[axis] - self.lattice.centre[axis]));
            }
            for (mean, along) in mean.iter_mut().zip(&along[led]) {
                for (mean, along) in mean.iter_mut().zip(along) {
                    *mean += strength[led] * along;
                }
            }
        }
        if total.is_nan() || total <= 0.0 {
            return *self;
        }
        let mean = mean.map(|mean| mean.map(|sum| sum / total));
        let noise = slope.squares / slope.pixels.max(1) as f32;
        let ridge = noise / (TILT_STEP * TILT_STEP);
        let mut normal = [[ridge, 0.0], [0.0, ridge]];
        let mut gradient = [0.0; 2];
        for led in 0..LEDS {
            let m = &slope.led[led];
            let per_px = self.amplitude(led) / variance;
            let moved: [[f32; 2]; 2] = core::array::from_fn(|tilt| core::array::from_fn(|axis| along[led][tilt][axis] - mean[tilt][axis]));
            let dot = |a: [f32; 2], b: [f32; 2]| a[0] * b[0] + a[1] * b[1];
            for i in 0..2 {
                gradient[i] += per_px * dot(moved[i], m.along);
                for j in 0..2 {
                    normal[i][j] += strength[led] * dot(moved[i], moved[j]);
                }
            }
        }
        let [[a, b], [c, d]] = normal;
        let determinant = a * d - b * c;
        let step = [
            (d * gradient[0] - b * gradient[1]) / determinant,
            (a * gradient[1] - c * gradient[0]) / determinant,
        ];
        if step.iter().any(|step| !step.is_finite()) {
            return *self;
        }
        let mut next = *self;
        for (tilt, step) in step.into_iter().enumerate() {
            let before = self.lattice.tilt[tilt];
            let after = (before + step.clamp(-TILT_STEP, TILT_STEP)).clamp(-TILT_MAX, TILT_MAX);
            next.lattice.tilt[tilt] = after;
            for (centre, mean) in next.lattice.centre.iter_mut().zip(mean[tilt]) {
                *centre -= (after - before) * mean;
            }
        }
        next
    }
}
