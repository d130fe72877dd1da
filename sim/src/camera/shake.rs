//! The camera's vibration: small rotations about its own axes, which depend on the time in a run and not on the order of its frames.
//!
//! About each axis the angle is a sum of [`SINES`] sines of one amplitude, with random phases; their frequencies are random, one in each of
//! [`SINES`] parts of the band, which are equal in octaves. So it is smooth, stationary, nearly normal (its kurtosis is 3 − 1.5/[`SINES`]),
//! has the same power in each octave of the band and none outside, and never exceeds √(2·[`SINES`]) times its rms.

use std::array;
use std::f64::consts::TAU;

use glam::DMat3;

use crate::random::{Purpose, stream, uniform};
use crate::scene::Camera;

/// The sines of one axis.
pub const SINES: usize = 8;

/// The greatest angle of a ray from the axis, in radians.
const STEEPEST_RAD: f64 = 1.5;

/// Bounds of the effect of a vibration on an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// The greatest shift of a point, in px.
    pub shift_px: f64,
    /// The greatest relative change of a length, or rotation of it.
    pub stretch: f64,
    /// The greatest difference of that between points a pixel apart.
    pub bend_per_px: f64,
}

/// A camera's vibration, independent of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shake {
    /// Root mean square of pitch, yaw and roll, in radians.
    rms_rad: [f64; 3],
    /// The band's ends, in Hz.
    band_hz: [f64; 2],
}

impl Shake {
    /// The vibration of a scene's camera.
    pub fn of(camera: &Camera) -> Self {
        Self {
            rms_rad: [camera.shake_deg, camera.shake_deg, camera.shake_roll_deg].map(f64::to_radians),
            band_hz: [camera.shake_lowest_hz, camera.shake_highest_hz],
        }
    }

    /// Whether the camera does not vibrate.
    pub fn is_none(&self) -> bool {
        self.rms_rad == [0.0; 3]
    }

    /// The greatest possible pitch, yaw and roll, in radians.
    pub fn peak_rad(&self) -> [f64; 3] {
        self.rms_rad.map(|rms| rms * (2.0 * SINES as f64).sqrt())
    }

    /// Bounds of the effect on the image within `radius_px` of the principal point.
    ///
    /// A rotation by θ about an axis across the optical one moves the image of a ray at the angle φ from the optical axis by less than
    /// f·θ/cos²φ, with φ after the rotation, and a roll by less than f·tan φ·θ. Lengths along and across the way change by at most (3 +
    /// 1/cos²φ)·tan φ·θ: 5·tan φ/cos²φ·θ also covers the second order.
    pub fn reach(&self, camera: &Camera, radius_px: f64) -> Reach {
        let [pitch, yaw, roll] = self.peak_rad();
        let across = pitch + yaw;
        let focal_px = camera.focal_px();
        let tangent = ((radius_px / focal_px).atan() + across).min(STEEPEST_RAD).tan();
        let inverse_square = 1.0 + tangent * tangent;
        let distortion = 1.0 + 3.0 * camera.distortion_k1.abs() * tangent * tangent;
        let shift_px = focal_px * (across * inverse_square + tangent * roll) * distortion;
        let stretch = (roll + 5.0 * tangent * inverse_square * across) * (1.0 + roll + across) * distortion;
        let bent = 6.0 * camera.distortion_k1.abs() * tangent * shift_px / focal_px;
        Reach {
            shift_px,
            stretch: stretch + bent,
            bend_per_px: 5.0 * across * (1.0 + 3.0 * tangent * tangent) / focal_px,
        }
    }

    /// The highest frequency, in Hz.
    pub fn highest_hz(&self) -> f64 {
        self.band_hz[1]
    }

    /// The vibration of run `seed`.
    pub fn of_run(&self, seed: u64) -> Vibration {
        let [lowest, highest] = self.band_hz;
        let axis = |axis: usize| {
            let mut random = stream(seed, axis as u64, Purpose::Shake);
            array::from_fn(|k| {
                let part = (k as f64 + uniform(&mut random)) / SINES as f64;
                Sine {
                    amplitude_rad: self.rms_rad[axis] * (2.0 / SINES as f64).sqrt(),
                    rad_per_s: TAU * lowest * (highest / lowest).powf(part),
                    phase_rad: TAU * uniform(&mut random),
                }
            })
        };
        Vibration(array::from_fn(axis))
    }
}

#[derive(Clone, Copy, Debug)]
struct Sine {
    amplitude_rad: f64,
    rad_per_s: f64,
    phase_rad: f64,
}

/// The camera's rotation over time in one run.
///
/// ```
/// use sim::{camera::shake::Shake, scene::Scene};
/// let car = Scene::load("day", &["camera.shake_deg=0.1".into()])?;
/// let vibration = Shake::of(&car.camera).of_run(1);
/// let [pitch, yaw, roll] = vibration.angles_rad(0.3);
/// assert!(pitch != yaw && roll == 0.0);
/// assert!(pitch.abs() <= Shake::of(&car.camera).peak_rad()[0]);
/// # Ok::<(), sim::scene::SceneError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Vibration([[Sine; SINES]; 3]);

impl Vibration {
    /// Pitch, yaw and roll `time_s` seconds after the start of the first frame, in radians.
    pub fn angles_rad(&self, time_s: f64) -> [f64; 3] {
        let at = |sine: &Sine| match sine.amplitude_rad {
            0.0 => 0.0,
            amplitude => amplitude * (sine.rad_per_s * time_s + sine.phase_rad).sin(),
        };
        self.0.each_ref().map(|axis| axis.iter().map(at).sum())
    }

    /// The rotation of the world as the camera sees it, `time_s` seconds after the start of the first frame: the camera is rotated by
    /// Rz(roll)·Ry(yaw)·Rx(pitch) like a panel, and the world by its inverse.
    pub fn turn(&self, time_s: f64) -> DMat3 {
        let [pitch, yaw, roll] = self.angles_rad(time_s);
        DMat3::from_rotation_x(-pitch) * DMat3::from_rotation_y(-yaw) * DMat3::from_rotation_z(-roll)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAKE: Shake = Shake {
        rms_rad: [2e-3, 2e-3, 1e-3],
        band_hz: [1.0, 15.0],
    };

    /// The mean of a function of pitch, yaw and roll, over runs and times.
    fn mean(of: impl Fn(&Vibration, f64) -> [f64; 3]) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for seed in 0..400 {
            let vibration = SHAKE.of_run(seed);
            for step in 0..100 {
                let of = of(&vibration, f64::from(step) * 0.37);
                sums = array::from_fn(|axis| sums[axis] + of[axis] / 40_000.0);
            }
        }
        sums
    }

    #[test]
    fn its_rms_is_that_of_the_scene_and_its_distribution_nearly_normal() {
        let squares = mean(|vibration, time_s| vibration.angles_rad(time_s).map(|angle| angle * angle));
        let fourths = mean(|vibration, time_s| vibration.angles_rad(time_s).map(|angle| angle.powi(4)));
        for ((square, fourth), expected) in squares.into_iter().zip(fourths).zip(SHAKE.rms_rad) {
            let rms = square.sqrt();
            assert!((rms / expected - 1.0).abs() < 0.01, "{rms} for {expected}");
            let kurtosis = fourth / square.powi(2);
            assert!((kurtosis - (3.0 - 1.5 / SINES as f64)).abs() < 0.1, "{kurtosis}");
        }
    }

    #[test]
    fn its_power_is_the_same_in_each_octave_of_the_band() {
        // The mean square of a step over 10 ms of noise with 1/f power from 1 to 15 Hz, by that integral.
        let steps = 100_000;
        let step = |k: i32| {
            let hz = 15f64.powf((f64::from(k) + 0.5) / f64::from(steps));
            2.0 - 2.0 * (TAU * hz * 0.01).cos()
        };
        let expected = (0..steps).map(step).sum::<f64>() / f64::from(steps);
        let squares = mean(|vibration, time_s| {
            let [before, after] = [time_s, time_s + 0.01].map(|time_s| vibration.angles_rad(time_s));
            array::from_fn(|axis| (after[axis] - before[axis]).powi(2))
        });
        for (square, rms) in squares.into_iter().zip(SHAKE.rms_rad) {
            let relative = square / rms.powi(2);
            assert!((relative / expected - 1.0).abs() < 0.02, "{relative} for {expected}");
        }
    }

    #[test]
    fn no_angle_is_beyond_the_peak() {
        let peak = SHAKE.peak_rad();
        for seed in 0..20 {
            let vibration = SHAKE.of_run(seed);
            for step in 0..2000 {
                let angles = vibration.angles_rad(f64::from(step) * 0.013);
                assert!((0..3).all(|axis| angles[axis].abs() <= peak[axis]), "{angles:?}");
            }
        }
    }
}
