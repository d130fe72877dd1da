//! Panels in random poses, and the error of their measured poses in metres and in standard deviations.

use std::time::Instant;

use glam::{DMat3, DVec3};
use link::panel::PanelFrame;
use nalgebra::{Cholesky, Matrix6, SMatrix, SVector, Vector6};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::pose::{Lens, PanelObservation, PanelSize, PlaneImage, Pose, PoseEstimator, PoseMemory};
use sim::accuracy::Level;
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::road::camera_of;
use sim::scene::Scene;

/// Relative standard deviation of the LEDs' light.
const LED_SPREAD: f64 = 0.03;

/// The distribution of poses.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// The scene's preset.
    pub preset: &'static str,
    /// The ratio L2A; none: the shipped table's.
    pub l2a: Option<f64>,
    /// Minimum and maximum distance.
    pub distance_m: [f64; 2],
    /// Minimum and maximum rotation about the vertical axis, to either side.
    pub yaw_deg: [f64; 2],
    /// Maximum rotation about the horizontal axis, to either side.
    pub pitch_deg: f64,
}

/// Position and rotation of a panel.
pub type Truth = (DVec3, DMat3);

/// A panel's true and measured pose.
pub struct Trial {
    /// The true pose.
    pub truth: Truth,
    /// The measured pose.
    pub pose: Pose,
    /// Minimum standard deviation of any unbiased range estimate from these pixels at the true pose (Cramér 1946; Rao 1945).
    pub range_bound_m: f64,
    /// Run time of the measurement, in seconds.
    pub time_s: f64,
    /// Iterations of the fit.
    pub rounds: usize,
}

/// Why the pose is unknown.
pub type PoseError = Box<dyn std::error::Error + Send + Sync>;

/// A pose estimator for panels of up to this many pixels.
type Estimator = PoseEstimator<16384>;

/// State for trials.
pub struct Trials {
    range: Range,
    estimator: Box<Estimator>,
    memory: Box<PoseMemory>,
}

impl Trials {
    /// Trials of poses in a range, with the default tolerance.
    pub fn new(range: Range) -> Self {
        Self::settling_to(range, Estimator::TOLERANCE)
    }

    /// Trials whose fits converge to a tolerance.
    pub fn settling_to(range: Range, tolerance: f64) -> Self {
        Self {
            range,
            estimator: Box::new(Estimator::settling_to(tolerance)),
            memory: Box::default(),
        }
    }

    /// Draws pose `seed`, renders it and measures it, from corners with errors of up to 0.2 px.
    pub fn draw(&mut self, seed: u64) -> Result<Trial, PoseError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let Range {
            preset,
            distance_m: [near, far],
            yaw_deg: [least, most],
            pitch_deg,
            ..
        } = self.range;
        let distance_m = random.random_range(near..=far);
        let mut turn = |most: f64| random.random_range(-most..=most);
        let aside = turn(1.0);
        let yaw = (least + f64::abs(aside) * (most - least)).copysign(aside);
        let angles_deg = [yaw, turn(pitch_deg), turn(15.0)];
        let off_px = [turn(4.0), turn(4.0)];
        let placed = PlacedPanel {
            preset,
            distance_m,
            angles_deg,
            off_px,
        };
        self.measure(&placed, seed, 0, &mut random)
    }

    /// A panel that approaches at `speed_m_s`, measured while followed, with the time of each frame in seconds.
    pub fn approach(&mut self, seed: u64, speed_m_s: f64, fps: f64, frames: u64) -> Result<Vec<(f64, Trial)>, PoseError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut trials = Vec::new();
        for frame in 0..frames {
            let time_s = frame as f64 / fps;
            let placed = PlacedPanel {
                preset: self.range.preset,
                distance_m: self.range.distance_m[1] - speed_m_s * time_s,
                angles_deg: [10.0, 5.0, 3.0],
                off_px: [0.4, -0.3],
            };
            let trial = self.measure(&placed, seed, frame, &mut random)?;
            trials.push((time_s, trial));
        }
        Ok(trials)
    }

    /// Renders a panel and measures it.
    fn measure(&mut self, placed: &PlacedPanel, seed: u64, frame: u64, random: &mut ChaCha8Rng) -> Result<Trial, PoseError> {
        let PlacedPanel {
            preset,
            distance_m,
            angles_deg: [yaw, pitch, roll],
            off_px,
        } = *placed;
        let focal_px = 25e-3 / 6.875e-6;
        let [x, y] = off_px.map(|off| off * distance_m / focal_px);
        let rotation = DMat3::from_rotation_z(roll.to_radians())
            * DMat3::from_rotation_y(yaw.to_radians())
            * DMat3::from_rotation_x(pitch.to_radians());
        let side = (2.0 * (0.48 * focal_px / distance_m / 2.0 + 16.0) * 1.3) as usize;
        let scene = Scene::load(
            preset,
            &[
                format!("camera.width_px={side}"),
                format!("camera.height_px={side}"),
                format!("pose.distance_m={distance_m}"),
                format!("pose.x_m={x}"),
                format!("pose.y_m={y}"),
                format!("pose.yaw_deg={yaw}"),
                format!("pose.pitch_deg={pitch}"),
                format!("pose.roll_deg={roll}"),
                format!("panel.led_spread={LED_SPREAD}"),
                format!("panel.seed={seed}"),
                format!("link.l2a={}", self.range.l2a.map_or("table".into(), |l2a| l2a.to_string())),
            ],
        )
        .expect("keys of a scene");
        let renderer = Renderer::new(&scene, Level::Fine)?;
        let mut canvas = Canvas::new(renderer.lit_region());
        let mut pixels = vec![0; side * side];
        let bits = PanelFrame::from_bits(random.next_u64());
        let shown = [renderer.steady(0, bits)];
        let moment = renderer.moment(seed, frame);
        renderer.frame(seed, &moment, &shown, &mut canvas, &mut pixels);
        let corners = renderer
            .corner_leds_px(0)
            .map(|corner| corner.map(|c| (c + random.random_range(-0.2..0.2)) as f32));
        let size = PanelSize::new(0.03, 1.0).expect("a panel's size");
        let seen = PanelObservation {
            frame: &Frame::new(&pixels, side, side).expect("a frame"),
            corners: &Corners::new(corners)?,
            bits,
            camera: &camera_of(&scene),
            lens: &Lens::pinhole(focal_px, [side; 2]),
            size,
        };
        let begun = Instant::now();
        let fit = self.estimator.image(&seen)?;
        let pose = Pose::of_image(&fit, size.half_side_m(), &mut self.memory)?;
        let time_s = begun.elapsed().as_secs_f64();
        let truth = (DVec3::new(x, y, distance_m), rotation);
        Ok(Trial {
            truth,
            pose,
            range_bound_m: range_bound_m(truth, &fit.information, size.half_side_m()),
            time_s,
            rounds: self.estimator.rounds(),
        })
    }
}

/// A panel's true placement.
struct PlacedPanel {
    preset: &'static str,
    distance_m: f64,
    /// Yaw, pitch and roll.
    angles_deg: [f64; 3],
    /// Offset from the frame's centre.
    off_px: [f64; 2],
}

impl Trial {
    /// Error of the range, in metres.
    pub fn range_error_m(&self) -> f64 {
        self.pose.numbers().range_m.value - self.truth.0.length()
    }

    /// Errors of translation and rotation vector.
    pub fn error(&self) -> [f64; 6] {
        error(self.truth, &self.pose)
    }

    /// The normalised estimation error squared; see [`nees`].
    pub fn nees(&self) -> f64 {
        nees(self.truth, &self.pose)
    }
}

/// Errors of a pose's translation and rotation vector.
pub fn error((place, rotation): Truth, pose: &Pose) -> [f64; 6] {
    let shift = place - DVec3::from_array(pose.translation_m);
    let measured = DMat3::from_cols_array_2d(&pose.rotation).transpose();
    let turn = glam::DQuat::from_mat3(&(rotation * measured.transpose())).to_scaled_axis();
    let turn = if turn.length() > std::f64::consts::PI {
        turn - turn.normalize() * std::f64::consts::TAU
    } else {
        turn
    };
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// Normalised estimation error squared: error by inverse covariance by error (Bar-Shalom, Li & Kirubarajan 2001, section 5.4). Its mean is
/// 6 if the covariance is correct.
pub fn nees(truth: Truth, pose: &Pose) -> f64 {
    let error = Vector6::from(error(truth, pose));
    error.dot(&solved(Matrix6::from(pose.covariance), &error))
}

/// The bound on the range at a true pose, from the image's Fisher information.
fn range_bound_m(truth: Truth, information: &[[f64; 8]; 8], half_side_m: f64) -> f64 {
    let (translation, rotation) = truth;
    let steps: [f64; 6] = std::array::from_fn(|i| if i < 3 { 1e-6 * translation.z } else { 1e-6 });
    let slopes = SMatrix::<f64, 8, 6>::from_columns(&std::array::from_fn::<_, 6, _>(|number| {
        let moved = |by: f64| {
            let mut step = [0.0; 6];
            step[number] = by;
            let turn = DMat3::from_rotation_x(step[3]) * DMat3::from_rotation_y(step[4]) * DMat3::from_rotation_z(step[5]);
            let moved = (translation + DVec3::from_slice(&step[..3]), turn * rotation);
            let PlaneImage {
                centre: [a, b],
                column: [c, d],
                row: [e, f],
                tilt: [g, h],
            } = image_of(moved, half_side_m);
            SVector::<f64, 8>::from([a, b, c, d, e, f, g, h])
        };
        (moved(steps[number]) - moved(-steps[number])) / (2.0 * steps[number])
    }));
    let normal = slopes.transpose() * SMatrix::<f64, 8, 8>::from(*information) * slopes;
    let along = translation.normalize();
    let direction = Vector6::new(along.x, along.y, along.z, 0.0, 0.0, 0.0);
    direction.dot(&solved(normal, &direction)).sqrt()
}

/// The image of a square's plane, from the definition.
pub fn image_of((translation, rotation): Truth, half_side_m: f64) -> PlaneImage {
    let centre = translation.truncate() / translation.z;
    let side = |axis: DVec3| {
        let axis = axis * half_side_m / translation.z;
        ((axis.truncate() - centre * axis.z).to_array(), axis.z)
    };
    let ((column, right), (row, down)) = (side(rotation.x_axis), side(rotation.y_axis));
    PlaneImage {
        centre: centre.to_array(),
        column,
        row,
        tilt: [right, down],
    }
}

/// Solves symmetric equations, scaled so that metres and radians are commensurate.
fn solved(matrix: Matrix6<f64>, right: &Vector6<f64>) -> Vector6<f64> {
    let size = matrix.diagonal().map(|c| c.sqrt().recip());
    let scaled = matrix.component_mul(&(size * size.transpose()));
    let solved = Cholesky::new(scaled).expect("a covariance").solve(&right.component_mul(&size));
    solved.component_mul(&size)
}
