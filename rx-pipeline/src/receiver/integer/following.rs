//! Measures a panel's motion.

use super::outline::{Outline, STEPS, weights};
use super::samples::Samples;
use link::panel::SIDE;

/// Smallest curvature of a peak over all LEDs: one grey level on one LED.
const FLAT: i32 = STEPS * STEPS * 256;

impl Outline {
    /// Moves each corner halfway towards the brightest points of the On LEDs that are nearest to it, by at most an eighth of the pitch.
    pub fn correct(&mut self, samples: &Samples, bits: u64) {
        let steps = self.steps();
        // For each corner and each axis, the slope and the curvature of a parabola through three samples, weighted by nearness.
        let mut slopes = [[0i32; 2]; 4];
        let mut curvatures = [[0i32; 2]; 4];
        for (led, samples) in samples.leds.iter().enumerate() {
            if bits >> led & 1 == 0 {
                continue;
            }
            let [centre, left, right, above, below] = *samples;
            let near = weights((led % SIDE) as i32, (led / SIDE) as i32);
            for (corner, weight) in near.into_iter().enumerate() {
                slopes[corner][0] += weight * ((right - left) / 16);
                slopes[corner][1] += weight * ((below - above) / 16);
                curvatures[corner][0] += weight * ((2 * centre - left - right) / 16);
                curvatures[corner][1] += weight * ((2 * centre - above - below) / 16);
            }
        }
        for (corner, (slope, curvature)) in self.0.iter_mut().zip(slopes.into_iter().zip(curvatures)) {
            for (way, step) in steps.into_iter().enumerate() {
                if 16 * curvature[way] > FLAT {
                    // The brightest point is slope / (2 · curvature) quarters of a pitch away.
                    let quarters = (128 * i64::from(slope[way]) / i64::from(curvature[way])) as i32;
                    let half_way = step.over(8).share(quarters.clamp(-256, 256));
                    *corner = corner.plus(half_way);
                }
            }
        }
    }
}
