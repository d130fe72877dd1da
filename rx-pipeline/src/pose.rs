//! The panel's position and orientation relative to the camera, with covariance.
//!
//! A panel is read in pixels; the camera's [focal length](Lens) and the [panel's size](PanelSize) convert these to metres and angles. Each
//! number has the covariance due to the pixels' noise, so that a driving function can rely on it; a [`PoseError`] gives the reason if there
//! is no pose.
//!
//! 1. **The image of the panel's plane**, eight numbers, is fitted to the pixels together with light, blur, noise and unequal LEDs, by
//!    maximum likelihood, and their Fisher information with it (`pose/image_fit.rs`).
//! 2. **The pose**, six numbers, and its two-fold ambiguity follow from the eight (`pose/planar.rs`).
//! 3. **Its covariance** is that of all poses that explain the eight numbers, weighted by their likelihood (`pose/posterior.rs`):
//!    derivatives at one best pose would not describe the orientation of a far panel.
//! 4. **The closing speed** follows from the poses of successive frames ([`Closing`]).
//!
//! # Axes
//!
//! The camera's: x right, y down, z forward, in metres. The panel's: x along its rows, y down its columns, z into it; its middle is the
//! origin. A panel that faces the camera upright has the identity rotation; others are turned by Rz(roll)·Ry(yaw)·Rx(pitch).
//!
//! # Limits
//!
//! The covariance covers the noise of pixels alone. It excludes errors of the calibration and of the panel's size, a rolling shutter's
//! slant and motion within the exposure. If such errors make the image unlike any square lattice's, [`Pose::inflation`] gives the amount.

mod appearance;
mod clipped_light;
mod closing;
mod disc;
mod equations;
mod gauss;
mod image_fit;
mod leds;
mod lens;
mod pixels;
mod planar;
mod plane;
mod posterior;

pub use closing::Closing;
pub use image_fit::PlaneFit;
pub use lens::{Lens, LensError};
pub use plane::PlaneImage;

use link::camera::Camera;
use link::geometry::Geometry;
use link::panel::PanelFrame;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::corners::Corners;
use crate::frame::Frame;
use image_fit::ImageFit;
use planar::rotation_by;
use posterior::Posterior;

/// The size of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanelSize {
    led_diameter_m: f64,
    pitch_m: f64,
}

/// A panel size out of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PanelSizeError {
    /// The diameter of an LED.
    #[error("an LED diameter of {led_diameter_m} m is not 0.0001 to 10 m: measure an LED; those of the usual panel are 0.03 m wide")]
    LedDiameter {
        /// The requested diameter, in metres.
        led_diameter_m: f64,
    },
    /// The gap between LEDs.
    #[error("an LED interval of {interval} is not 0 to 100: give the gap between two LEDs' edges over their diameter")]
    Interval {
        /// The requested interval.
        interval: f64,
    },
}

impl PanelSize {
    /// A panel of LEDs `led_diameter_m` wide (0.0001 to 10 m) with gaps of `interval` diameters between their edges (0 to 100).
    ///
    /// ```
    /// use rx_pipeline::pose::PanelSize;
    /// assert_eq!(PanelSize::new(0.03, 1.0)?.pitch_m(), 0.06);
    /// assert!(PanelSize::new(-1.0, 1.0).is_err());
    /// # Ok::<(), rx_pipeline::pose::PanelSizeError>(())
    /// ```
    ///
    /// # Errors
    /// [`PanelSizeError`] if one of them is out of its range.
    pub fn new(led_diameter_m: f64, interval: f64) -> Result<Self, PanelSizeError> {
        if !(1e-4..=10.0).contains(&led_diameter_m) {
            return Err(PanelSizeError::LedDiameter { led_diameter_m });
        }
        if !(0.0..=100.0).contains(&interval) {
            return Err(PanelSizeError::Interval { interval });
        }
        Ok(Self::of(led_diameter_m, interval))
    }

    fn of(led_diameter_m: f64, interval: f64) -> Self {
        Self {
            led_diameter_m,
            pitch_m: (1.0 + interval) * led_diameter_m,
        }
    }

    /// The distance between the middles of neighbouring LEDs, in metres.
    pub fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    /// The distance from the panel's middle to its outer line of LEDs, in metres.
    pub fn half_side_m(&self) -> f64 {
        3.5 * self.pitch_m
    }
}

/// A transmitted geometry is always within the ranges.
impl From<Geometry> for PanelSize {
    fn from(told: Geometry) -> Self {
        Self::of(told.led_diameter_m(), told.interval())
    }
}

/// A reading of a panel, with the known properties of panel and camera.
#[derive(Clone, Copy)]
pub struct PanelObservation<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// The panel's position in it, to half a pitch.
    pub corners: &'a Corners,
    /// The panel's bits: wrong bits make its pose less precise, not wrong.
    pub bits: PanelFrame,
    /// The pixels' encoding, and the initial blur.
    pub camera: &'a Camera,
    /// The mapping of directions to pixels.
    pub lens: &'a Lens,
    /// The panel's size.
    pub size: PanelSize,
}

/// Why there is no pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// The panel has too few pixels in the frame.
    #[error("the panel is not whole in the frame: aim the camera, or use a larger region")]
    OutsideFrame,
    /// Its pixels exceed the memory.
    #[error("the panel's surroundings have {width} × {height} pixels, and there is memory for {capacity}: shrink the frame")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The estimator's `PIXELS`.
        capacity: usize,
    },
    /// The lens model has no direction for the panel's position.
    #[error("the camera's distortion lets no light fall where the panel is seen: check the calibration")]
    NoRay,
    /// The pixels do not determine all parameters.
    #[error("the pixels do not determine the pose: the contrast is too low, or the panel is too small or seen edge on")]
    Singular,
    /// The fit did not converge.
    #[error("the fit has not converged in {rounds} iterations: the pixels do not show a panel there")]
    NotSettled {
        /// Rounds of the fit.
        rounds: usize,
    },
    /// The fit converged at another place.
    #[error("the fit has moved {off_pitches:.1} LED pitches away: the pixels do not show a panel there")]
    Elsewhere {
        /// The distance, in pitches.
        off_pitches: f64,
    },
    /// The fit converged on a pattern that is not a lattice of LEDs.
    #[error("the light there is not that of a square lattice of LEDs: the corners or the bits are wrong")]
    Unlike,
    /// The blur is out of the supported range.
    #[error("the blur is too sharp or too wide for a panel of this size: go farther off, focus, or give blur_sigma_px")]
    Blur,
}

/// A panel's pose and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The position of the panel's middle relative to the camera, in metres: x right, y down, z forward.
    pub translation_m: [f64; 3],
    /// Rows of the matrix from the panel's axes to the camera's: the mean of the likely rotations.
    pub rotation: [[f64; 3]; 3],
    /// Covariance of the translation (m) and of the rotation vector (rad): true = exp(vector)·`rotation`, about the camera's axes.
    pub covariance: [[f64; 6]; 6],
    /// The two solutions that the image of a plane allows, the likelier first.
    pub solutions: [Solution; 2],
    /// The factor on the covariance because the image is unlike a square lattice's: 1 if noise alone explains it.
    pub inflation: f64,
}

/// One of two solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Rows of the matrix from the panel's axes to the camera's.
    pub rotation: [[f64; 3]; 3],
    /// Its range in metres.
    pub range_m: f64,
    /// Its probability; the two add up to 1.
    pub probability: f64,
}

/// A number and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// A pose as range, bearing and angles; angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseNumbers {
    /// The distance from the camera to the panel's middle, in metres.
    pub range_m: Estimate,
    /// Bearing to the right of the optical axis.
    pub azimuth: Estimate,
    /// Bearing above the optical axis.
    pub elevation: Estimate,
    /// Rotation about the axis z, clockwise as seen by the camera.
    pub roll: Estimate,
    /// Rotation about the axis y: if it is positive, the panel's right side is the nearer one.
    pub yaw: Estimate,
    /// Rotation about the axis x.
    pub pitch: Estimate,
}

impl Pose {
    /// The pose of a square of `half_side_m` metres whose image was measured.
    ///
    /// ```
    /// use rx_pipeline::pose::{PlaneFit, PlaneImage, Pose, PoseMemory};
    /// // A square of 0.42 m at 10 m, measured to a tenth of a milliradian.
    /// let image = PlaneImage { centre: [0.0; 2], column: [0.021, 0.0], row: [0.0, 0.021], tilt: [0.0; 2] };
    /// let information = core::array::from_fn(|i| core::array::from_fn(|j| if i == j { 1e8 } else { 0.0 }));
    /// let pose = Pose::of_image(&PlaneFit { image, information }, 0.21, &mut Box::default())?;
    /// assert!((pose.numbers().range_m.value - 10.0).abs() < 3.0 * pose.numbers().range_m.sigma);
    /// # Ok::<(), rx_pipeline::pose::PoseError>(())
    /// ```
    ///
    /// # Errors
    /// [`PoseError::Singular`] if the information does not determine all numbers.
    pub fn of_image(fit: &PlaneFit, half_side_m: f64, memory: &mut PoseMemory) -> Result<Self, PoseError> {
        memory.0.pose(fit, half_side_m)
    }

    /// Range, bearing and angles with their standard deviations.
    pub fn numbers(&self) -> PoseNumbers {
        const STEP: f64 = 1e-6;
        let translation = Vector3::from(self.translation_m);
        let rotation = Matrix3::from_fn(|i, j| self.rotation[i][j]);
        let covariance = SMatrix::<f64, 6, 6>::from_fn(|i, j| self.covariance[i][j]);
        let moved = |number: usize, by: f64| {
            let (mut shift, mut turn) = (Vector3::zeros(), Vector3::zeros());
            if number < 3 {
                shift[number] = by
            } else {
                turn[number - 3] = by
            }
            values(&(translation + shift), &(rotation_by(&turn) * rotation))
        };
        let slopes: [[f64; 6]; 6] = core::array::from_fn(|number| {
            let (ahead, behind) = (moved(number, STEP), moved(number, -STEP));
            core::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * STEP))
        });
        let here = values(&translation, &rotation);
        let [range_m, azimuth, elevation, roll, yaw, pitch] = core::array::from_fn(|i| {
            let slope = SVector::<f64, 6>::from_fn(|number, _| slopes[number][i]);
            let variance = (slope.transpose() * covariance * slope).x;
            Estimate {
                value: here[i],
                sigma: libm::sqrt(variance.max(0.0)),
            }
        });
        PoseNumbers {
            range_m,
            azimuth,
            elevation,
            roll,
            yaw,
            pitch,
        }
    }
}

impl Solution {
    /// Roll, yaw and pitch in radians.
    pub fn angles(&self) -> [f64; 3] {
        let rotation = Matrix3::from_fn(|i, j| self.rotation[i][j]);
        let [.., roll, yaw, pitch] = values(&Vector3::z(), &rotation);
        [roll, yaw, pitch]
    }
}

/// Range, azimuth, elevation, roll, yaw and pitch.
fn values(translation: &Vector3<f64>, rotation: &Matrix3<f64>) -> [f64; 6] {
    let [x, y, z] = translation.data.0[0];
    [
        translation.norm(),
        libm::atan2(x, z),
        libm::atan2(-y, libm::hypot(x, z)),
        libm::atan2(rotation.m21, rotation.m11),
        libm::atan2(-rotation.m31, libm::hypot(rotation.m11, rotation.m21)),
        libm::atan2(rotation.m32, rotation.m33),
    ]
}

/// Memory for all weighted poses, 0.5 MB.
pub struct PoseMemory(Posterior);

impl Default for PoseMemory {
    fn default() -> Self {
        Self(Posterior::EMPTY)
    }
}

/// A pose estimator: about 1.2 MB with `16384` pixels, which suffice for any panel, because near ones are read in larger pixels.
///
/// ```
/// use link::camera::Camera;
/// use link::panel::PanelFrame;
/// use rx_pipeline::{corners::Corners, frame::Frame};
/// use rx_pipeline::pose::{Lens, PanelSize, PoseEstimator, PanelObservation};
/// // 96 × 96 pixels of a panel before grey, a spot of light where an LED is On.
/// let bits = PanelFrame::from_bits(0x9a3c_5e71_0f96_c3a5);
/// let corners = Corners::new([[32.0, 30.0], [63.5, 30.0], [63.5, 61.5], [32.0, 61.5]])?;
/// let mut light = vec![1.0; 96 * 96];
/// for led in (0..64).filter(|&led| bits.led(led)) {
///     let [x, y] = corners.homography().to_image([(led % 8) as f64, (led / 8) as f64]);
///     for (i, light) in light.iter_mut().enumerate() {
///         let square = ((i % 96) as f64 - x).powi(2) + ((i / 96) as f64 - y).powi(2);
///         *light += 2.0 * (-square / 5.0).exp();
///     }
/// }
/// let pixels: Vec<u8> = light.iter().map(|light: &f64| (118.0 * light.powf(1.0 / 2.2)).round() as u8).collect();
/// let lens = Lens::pinhole(3636.0, [96, 96]);
/// let mut estimator = Box::new(PoseEstimator::<16384>::new());
/// let frame = Frame::new(&pixels, 96, 96)?;
/// let size = PanelSize::new(0.03, 1.0)?;
/// let pose = estimator.pose(&PanelObservation { frame: &frame, corners: &corners, bits, camera: &Camera::default(), lens: &lens, size })?;
/// // Pitches of 60 mm are seen 4.5 px apart.
/// let range_m = pose.numbers().range_m;
/// assert!((range_m.value - 3636.0 * 0.06 / 4.5).abs() < 4.0 * range_m.sigma && range_m.sigma < 0.2);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct PoseEstimator<const PIXELS: usize> {
    fit: ImageFit<PIXELS>,
    posterior: Posterior,
}

impl<const PIXELS: usize> Default for PoseEstimator<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const PIXELS: usize> PoseEstimator<PIXELS> {
    /// A fit has converged if its next step would move the image by less than this, in standard deviations.
    pub const TOLERANCE: f64 = 0.1;

    /// An estimator with the default tolerance.
    pub const fn new() -> Self {
        Self::settling_to(Self::TOLERANCE)
    }

    /// An estimator with another tolerance of convergence, in standard deviations of the image. Below 0.001 the result does not improve.
    pub const fn settling_to(tolerance: f64) -> Self {
        Self {
            fit: ImageFit::new(tolerance),
            posterior: Posterior::EMPTY,
        }
    }

    /// Rounds of the last fit.
    pub fn rounds(&self) -> usize {
        self.fit.rounds
    }

    /// The pose of a panel that was read.
    ///
    /// # Errors
    /// [`PoseError`] gives the reason if there is no pose.
    pub fn pose(&mut self, seen: &PanelObservation<'_>) -> Result<Pose, PoseError> {
        let fit = self.image(seen)?;
        self.posterior.pose(&fit, seen.size.half_side_m())
    }

    /// The image of the panel's plane in a frame, the first step of [`PoseEstimator::pose`].
    ///
    /// # Errors
    /// As there.
    pub fn image(&mut self, seen: &PanelObservation<'_>) -> Result<PlaneFit, PoseError> {
        self.fit.fit(seen)
    }
}
