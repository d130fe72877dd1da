//! What it costs not to know the camera: bits read wrongly and time of a receiver that has learnt the camera from the frames, of one that
//! was told it, and of the genie.

use std::time::Instant;

use link::camera::Camera;
use link::panel::PanelFrame;
use rx_pipeline::corners::Corners;
use rx_pipeline::frame::Frame;
use rx_pipeline::likelihood::MaximumLikelihood;

use sim::accuracy::Level;
use sim::road::calibrated_camera_of;
use sim::scene::{Scene, SceneError};

use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Evaluator, PANEL_PIXELS, Settings};
use crate::stop::Stop;
use crate::work_precision::scene_at;

/// Frames from which the camera is learnt before errors count.
pub const LEARNING_FRAMES: u64 = 20;

/// A camera, and a panel before it in so little light that bits are read wrongly.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// What the camera is like.
    pub name: &'static str,
    /// Distance in m, interval, illuminance in lx, L2A.
    pub place: (f64, f64, f64, f64),
    /// The scene's settings that make the camera.
    pub settings: &'static [&'static str],
    /// Whether each pixel's grey level is one of its own light, as the genie has it.
    pub has_genie: bool,
}

/// Cameras from sharp to soft, and of several curves.
pub const CASES: [Case; 9] = [
    case("as expected: 1.5 px, γ 2.2", (70.0, 1.0, 50.0, 1.0), &[]),
    case(
        "0.7 px",
        (80.0, 0.5, 25.0, 1.0),
        &["camera.blur_sigma_px=0.7"],
    ),
    case(
        "2.2 px",
        (55.0, 1.0, 50.0, 1.0),
        &["camera.blur_sigma_px=2.2"],
    ),
    case("3 px", (46.0, 1.0, 50.0, 1.0), &["camera.blur_sigma_px=3"]),
    case(
        "linear",
        (80.0, 1.0, 50.0, 1.0),
        &["camera.encoding=linear", "camera.exposure_bias_ev=-1"],
    ),
    case("γ 2.6", (70.0, 1.0, 50.0, 1.0), &["camera.gamma=2.6"]),
    case("sRGB", (70.0, 1.0, 50.0, 1.0), &["camera.encoding=srgb"]),
    case(
        "Rec. 709, black at 16",
        (70.0, 1.0, 50.0, 1.0),
        &["camera.encoding=rec709", "camera.black_grey=16"],
    ),
    Case {
        has_genie: false,
        ..case(
            "sharpened by 1.2",
            (70.0, 1.0, 50.0, 1.0),
            &["camera.sharpening=1.2", "camera.sharpening_radius_px=1"],
        )
    },
];

const fn case(
    name: &'static str,
    place: (f64, f64, f64, f64),
    settings: &'static [&'static str],
) -> Case {
    Case {
        name,
        place,
        settings,
        has_genie: true,
    }
}

/// What one receiver read after [`LEARNING_FRAMES`].
#[derive(Clone, Debug, Default)]
pub struct Read {
    /// Wrong bits of each frame.
    pub errors: Vec<u64>,
    /// The median time of a panel, in µs.
    pub time_us: f64,
}

impl Read {
    /// Wrong bits in all.
    pub fn wrong(&self) -> u64 {
        self.errors.iter().sum()
    }

    /// The share of wrong bits.
    pub fn rate(&self) -> f64 {
        self.wrong() as f64 / (64 * self.errors.len()).max(1) as f64
    }
}

/// The same frames, read by three.
#[derive(Clone, Debug)]
pub struct Cost {
    /// By one that was told nothing.
    pub learnt: Read,
    /// By one that was told the camera.
    pub told: Read,
    /// Wrong bits of each frame by the genie, where there is one.
    pub genie: Option<Vec<u64>>,
}

/// Why a cost cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum CostError {
    /// The case is no scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The scene cannot be seen or measured.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// Reads `frames` frames after [`LEARNING_FRAMES`] others, of random bits and sub-pixel phase and of one panel.
///
/// # Errors
/// When the scene cannot be seen or a frame not be measured.
pub fn cost(case: &Case, frames: u64, seed: u64) -> Result<Cost, CostError> {
    let settings: Vec<String> = case.settings.iter().map(ToString::to_string).collect();
    let scene = scene_at(case.place, &settings)?;
    let told = calibrated_camera_of(&scene);
    let seen = Seen::new(&scene, LEARNING_FRAMES + frames, seed)?;
    let genie = case.has_genie.then(|| genie_errors(&scene, frames, seed));
    Ok(Cost {
        learnt: seen.read(Camera::default())?,
        told: seen.read(told)?,
        genie: genie.transpose()?,
    })
}

fn evaluator(
    scene: &Scene,
    seed: u64,
    detector: DetectorChoice,
) -> Result<Evaluator, EvaluateError> {
    let settings = Settings {
        frames: 0,
        seed,
        random_reflectance: false,
        detector,
        level: Level::Fast,
        camera: None,
        stop: Stop::NEVER,
    };
    Evaluator::new(scene, settings)
}

fn genie_errors(scene: &Scene, frames: u64, seed: u64) -> Result<Vec<u64>, EvaluateError> {
    let evaluator = evaluator(scene, seed, DetectorChoice::Genie)?;
    let mut workspace = evaluator.workspace();
    (LEARNING_FRAMES..LEARNING_FRAMES + frames)
        .map(|frame| {
            let read = evaluator.evaluate(frame..frame + 1, &mut workspace)?;
            Ok(read.errors.errors())
        })
        .collect()
}

/// Frames of a panel whose place and bits are known.
struct Seen {
    size: [usize; 2],
    frames: Vec<(Vec<u8>, Corners, PanelFrame)>,
}

impl Seen {
    fn new(scene: &Scene, frames: u64, seed: u64) -> Result<Self, EvaluateError> {
        let evaluator = evaluator(scene, seed, DetectorChoice::KMeans)?;
        let mut workspace = evaluator.workspace();
        let region = evaluator.region();
        let frames = (0..frames).map(|frame| {
            let observed = evaluator.observe(frame, &mut workspace)?;
            Ok((workspace.grey().to_vec(), observed.corners, observed.bits))
        });
        Ok(Self {
            size: [region.width, region.height],
            frames: frames.collect::<Result<_, EvaluateError>>()?,
        })
    }

    /// Reads frame after frame as one who begins with a camera; errors and time count after [`LEARNING_FRAMES`].
    fn read(&self, camera: Camera) -> Result<Read, EvaluateError> {
        let mut detector = Box::new(MaximumLikelihood::<PANEL_PIXELS>::new(camera));
        let [width, height] = self.size;
        let (mut errors, mut times_us) = (Vec::new(), Vec::new());
        for (number, (grey, corners, bits)) in self.frames.iter().enumerate() {
            let frame = Frame::new(grey, width, height)?;
            let begun = Instant::now();
            let read = detector.detect(&frame, corners);
            let time_us = 1e6 * begun.elapsed().as_secs_f64();
            if number as u64 >= LEARNING_FRAMES {
                let read = read.map_or(PanelFrame::default(), |detection| detection.bits);
                errors.push(u64::from(read.distance(*bits)));
                times_us.push(time_us);
            }
        }
        times_us.sort_by(f64::total_cmp);
        let time_us = times_us
            .get(times_us.len() / 2)
            .copied()
            .unwrap_or(f64::NAN);
        Ok(Read { errors, time_us })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_genie_reads_the_frames_that_the_others_read() {
        let cost = cost(&CASES[0], 4, 1).unwrap();
        assert_eq!(cost.learnt.errors.len(), 4);
        assert_eq!(cost.told.errors.len(), 4);
        assert_eq!(cost.genie.unwrap().len(), 4);
    }
}
