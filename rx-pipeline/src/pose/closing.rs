//! The closing speed of a followed panel, and its time to collision.

use nalgebra::{Matrix3, Matrix6, Matrix6x3, SVector, Vector3, Vector6};

use super::{Estimate, Pose};

/// The random walk of the velocity in a second, in m/s along each axis (standard deviation): traffic that brakes and pulls away.
const WANDER_M_S: f64 = 1.0;
/// The prior velocity before the second pose, in m/s along each axis (standard deviation).
const ANY_SPEED_M_S: f64 = 50.0;
/// A longer gap restarts the filter, in seconds.
const LONGEST_GAP_S: f64 = 1.0;
/// Squared deviation of a pose from the prediction, in standard deviations, beyond which it is another panel's: chance exceeds it once in a
/// million cases, with three numbers.
const ANOTHER: f64 = 30.7;
/// Standard deviations by which the speed of an approaching panel must exceed 0.
const CLEARLY: f64 = 2.0;

/// A panel's position and velocity, by a Kalman filter of constant velocity (Kalman 1960; white acceleration: Bar-Shalom, Li & Kirubarajan
/// 2001, section 6.2.2) over its [poses](Pose), weighted by their covariance.
///
/// ```
/// use rx_pipeline::pose::{Closing, PlaneFit, PlaneImage, Pose};
/// let mut closing = Closing::new();
/// // A square of 0.42 m that comes from 10 m at 5 m/s, measured to 10 µrad in 20 frames.
/// for frame in 0..20 {
///     let time_s = f64::from(frame) * 0.01;
///     let size = 0.21 / (10.0 - 5.0 * time_s);
///     let image = PlaneImage { centre: [0.0; 2], column: [size, 0.0], row: [0.0, size], tilt: [0.0; 2] };
///     let information = core::array::from_fn(|i| core::array::from_fn(|j| if i == j { 1e10 } else { 0.0 }));
///     closing.take(time_s, &Pose::of_image(&PlaneFit { image, information }, 0.21, &mut Box::default())?);
/// }
/// let speed = closing.speed_m_s().unwrap();
/// assert!((speed.value - 5.0).abs() < 4.0 * speed.sigma && speed.sigma < 0.5);
/// let time = closing.time_to_collision_s().unwrap();
/// assert!((time.value - 9.05 / 5.0).abs() < 4.0 * time.sigma);
/// # Ok::<(), rx_pipeline::pose::PoseError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Closing {
    last: Option<(f64, Motion)>,
    /// Whether two poses or more have determined the velocity.
    is_known: bool,
}

impl Closing {
    /// A filter without any pose.
    pub const fn new() -> Self {
        Self {
            last: None,
            is_known: false,
        }
    }

    /// Adds the pose at a time, in seconds. A pose that does not follow the last within a second, or is elsewhere, restarts the filter.
    pub fn take(&mut self, time_s: f64, pose: &Pose) {
        let place = Vector3::from(pose.translation_m);
        let spread = Matrix3::from_fn(|i, j| pose.covariance[i][j]);
        let next = self.last.as_ref().and_then(|(before_s, estimate)| {
            let elapsed_s = time_s - before_s;
            let follows = elapsed_s > 0.0 && elapsed_s <= LONGEST_GAP_S;
            follows.then(|| estimate.after(elapsed_s))?.corrected(&place, &spread)
        });
        self.is_known = next.is_some();
        let estimate = next.unwrap_or_else(|| Motion::of_place(&place, &spread));
        self.last = Some((time_s, estimate));
    }

    /// Forgets the panel.
    pub fn forget(&mut self) {
        *self = Self::new();
    }

    /// The decrease of the range, in m/s: negative for a panel that moves away. `None` before its second pose.
    pub fn speed_m_s(&self) -> Option<Estimate> {
        self.propagated(|place, velocity| -place.dot(&velocity) / place.norm())
    }

    /// The time until the range is 0 at that speed, in seconds; `None` for a panel that does not clearly approach.
    pub fn time_to_collision_s(&self) -> Option<Estimate> {
        let speed = self.speed_m_s()?;
        if speed.value < CLEARLY * speed.sigma || speed.value <= 0.0 {
            return None;
        }
        self.propagated(|place, velocity| -place.norm_squared() / place.dot(&velocity))
    }

    /// A function of position and velocity, with its standard deviation by numerical derivatives.
    fn propagated(&self, number: impl Fn(Vector3<f64>, Vector3<f64>) -> f64) -> Option<Estimate> {
        const STEP: f64 = 1e-5;
        let (_, Motion { state, covariance }) = self.last.as_ref().filter(|_| self.is_known)?;
        let of = |state: &Vector6<f64>| number(state.fixed_rows::<3>(0).into_owned(), state.fixed_rows::<3>(3).into_owned());
        let slopes = SVector::<f64, 6>::from_fn(|i, _| {
            let moved = |by: f64| {
                let mut moved = *state;
                moved[i] += by;
                of(&moved)
            };
            (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
        });
        let variance = slopes.dot(&(covariance * slopes));
        let known = Estimate {
            value: of(state),
            sigma: libm::sqrt(variance.max(0.0)),
        };
        (known.value.is_finite() && known.sigma.is_finite()).then_some(known)
    }
}

/// Place (m) and velocity (m/s) along each axis, and their covariance.
#[derive(Clone, Debug)]
struct Motion {
    state: Vector6<f64>,
    covariance: Matrix6<f64>,
}

impl Motion {
    /// A position, with the prior velocity.
    fn of_place(place: &Vector3<f64>, spread: &Matrix3<f64>) -> Self {
        let mut state = Vector6::zeros();
        state.fixed_rows_mut::<3>(0).copy_from(place);
        let mut covariance = Matrix6::identity() * (ANY_SPEED_M_S * ANY_SPEED_M_S);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(spread);
        Self { state, covariance }
    }

    /// The prediction at constant velocity with a random walk.
    fn after(&self, elapsed_s: f64) -> Self {
        let of_blocks = |[[a, b], [c, d]]: [[f64; 2]; 2]| {
            Matrix6::from_fn(|i, j| match (i / 3, j / 3, i % 3 == j % 3) {
                (0, 0, true) => a,
                (0, 1, true) => b,
                (1, 0, true) => c,
                (1, 1, true) => d,
                _ => 0.0,
            })
        };
        let forward = of_blocks([[1.0, elapsed_s], [0.0, 1.0]]);
        let square = elapsed_s * elapsed_s;
        let shared = square / 2.0;
        let wander = of_blocks([[square * elapsed_s / 3.0, shared], [shared, elapsed_s]]) * (WANDER_M_S * WANDER_M_S);
        Self {
            state: forward * self.state,
            covariance: forward * self.covariance * forward.transpose() + wander,
        }
    }

    /// The update by a measured position, with the covariance in Joseph's form, which keeps it symmetric; `None` if it is another panel's.
    fn corrected(&self, place: &Vector3<f64>, spread: &Matrix3<f64>) -> Option<Self> {
        let off = place - self.state.fixed_rows::<3>(0);
        let factor = (self.covariance.fixed_view::<3, 3>(0, 0) + spread).cholesky()?;
        let squared = off.dot(&factor.solve(&off));
        if squared.is_nan() || squared > ANOTHER {
            return None;
        }
        let seen: Matrix6x3<f64> = self.covariance.fixed_columns::<3>(0).into_owned();
        let gain = seen * factor.inverse();
        let mut rest = Matrix6::identity();
        let mut of_place = rest.fixed_columns_mut::<3>(0);
        of_place -= gain;
        Some(Self {
            state: self.state + gain * off,
            covariance: rest * self.covariance * rest.transpose() + gain * spread * gain.transpose(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Solution;

    /// A pose with that position and these standard deviations along the axes.
    fn pose(translation_m: [f64; 3], sigma_m: [f64; 3]) -> Pose {
        let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut covariance = [[0.0; 6]; 6];
        (0..6).for_each(|i| covariance[i][i] = sigma_m.get(i).map_or(1e-4, |sigma| sigma * sigma));
        let solution = Solution {
            rotation,
            range_m: translation_m[2],
            probability: 0.5,
        };
        Pose {
            translation_m,
            rotation,
            covariance,
            solutions: [solution; 2],
            inflation: 1.0,
        }
    }

    /// Noise of variance 1, from a counter.
    fn noise(counter: u64) -> f64 {
        let mut sum = -6.0;
        for part in 0..12 {
            let mut word = (counter * 12 + part + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            sum += ((word ^ word >> 31) >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }

    #[test]
    fn speed_and_time_are_as_wrong_as_they_say() {
        let (runs, mut squares) = (200, [0.0; 2]);
        let sigma = [0.001, 0.001, 0.05];
        for run in 0..runs {
            let noise = |counter: u64| noise(run * 1000 + counter);
            let mut closing = Closing::new();
            let (mut speed, mut far) = (5.0 + 10.0 * noise(999).abs(), 50.0);
            for frame in 0..50u64 {
                // The speed follows the filter's random walk.
                speed += WANDER_M_S * 0.1 * noise(500 + frame);
                far -= 0.01 * speed;
                let error: [f64; 3] = core::array::from_fn(|i| sigma[i] * noise(frame * 3 + i as u64));
                let place = [error[0], 1.0 + error[1], far + error[2]];
                closing.take(frame as f64 * 0.01, &pose(place, sigma));
            }
            let range = libm::hypot(1.0, far);
            let truth = speed * far / range;
            let told = closing.speed_m_s().unwrap();
            squares[0] += libm::pow((told.value - truth) / told.sigma, 2.0) / runs as f64;
            let time = closing.time_to_collision_s().unwrap();
            squares[1] += libm::pow((time.value - range / truth) / time.sigma, 2.0) / runs as f64;
        }
        // The band of the mean of `runs` squares in 999 of 1000 tests.
        let band = 3.29 * libm::sqrt(2.0 / runs as f64);
        assert!(
            squares.iter().all(|square| (square - 1.0).abs() < band),
            "{squares:?}, not 1 ± {band}"
        );
    }

    #[test]
    fn a_panel_that_goes_or_jumps_has_no_time_to_collision() {
        let mut closing = Closing::new();
        let sigma = [0.001; 3];
        assert_eq!(closing.speed_m_s(), None);
        for frame in 0..30 {
            let time_s = f64::from(frame) * 0.01;
            closing.take(time_s, &pose([0.0, 0.0, 20.0 + 3.0 * time_s], sigma));
        }
        assert!(closing.speed_m_s().unwrap().value < -2.0);
        assert_eq!(closing.time_to_collision_s(), None);
        closing.take(0.3, &pose([5.0, 0.0, 20.0], sigma));
        assert_eq!(closing.speed_m_s(), None, "another panel");
        closing.take(0.29, &pose([5.0, 0.0, 20.0], sigma));
        assert_eq!(closing.speed_m_s(), None, "time does not go back");
        closing.forget();
        assert_eq!(closing.speed_m_s(), None);
    }
}
