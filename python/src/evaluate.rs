//! Monte Carlo evaluation of one setting.

use std::time::Instant;

use link::panel::PanelFrame;
use numpy::{IntoPyArray, PyArray1, PyArray3, PyArray4};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use sim::accuracy::Level;
use sim::plan::Plan;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{self, AccumulatorError, EvaluateError, Evaluator, FrameSource, LabelledFrame, Labels, Settings, Tally};
use studies::sweep::{MOST_FRAMES, Results, Run, Shard, Summary, Sweep, SweepError};

use crate::arrays;
use crate::camera::camera_of;
use crate::errors::{check, guarded, refused};
use crate::frames::{all_corners, all_features, check_batch, draw, pictures};
use crate::record::record;
use crate::scene::{Decision, decisions, scene_of};
use crate::work::{Work, WorkControl};

record! {
    /// The result of an evaluation: the keys of `vocc evaluate --json`.
    Evaluation {
        /// The detector's name, or the function's.
        detector: String,
        /// Number of frames.
        frames: u64,
        /// Number of bits.
        bits: u64,
        /// Number of wrong bits; for rare events, the number of swarms that reached one.
        bit_errors: u64,
        /// The number of counted errors with the same uncertainty.
        effective_errors: f64,
        /// Bit error rate.
        ber: f64,
        /// Its 95 % interval.
        ber_95: (f64, f64),
        /// The bit error rate of frames that show one symbol; None if it is unknown.
        ber_one_symbol: Option<f64>,
        /// Its 95 % interval, or None.
        ber_one_symbol_95: Option<(f64, f64)>,
        /// Number of frames that were exposed across a change of symbols, or None.
        frames_across: Option<u64>,
        /// Number of wrong bits in these, or None.
        bit_errors_across: Option<u64>,
        /// Number of panels with a wrong bit, or None.
        panel_errors: Option<u64>,
        /// The 95 % interval of their rate, or None.
        panel_error_rate_95: Option<(f64, f64)>,
        /// Between-class variance of (AGR, GRI); None for rare events.
        bvar: Option<f64>,
        /// Within-class variance; None for rare events.
        wvar: Option<f64>,
        /// Their ratio, if it is defined.
        b2w: Option<f64>,
        /// Wrong bits of each frame, uint8 of shape (frames,); None if not requested.
        errors_by_frame: Option<Py<PyArray1<u8>>>,
        /// Duration in seconds.
        seconds: f64,
        /// The seed.
        seed: u64,
        /// The level of accuracy.
        level: String,
        /// The simulated effects with reasons.
        plan: Vec<Py<Decision>>,
    }
}

record! {
    /// The input of your own detector: frames without the truth.
    DetectorInput {
        /// The number of the first frame.
        first: u64,
        /// The region of the panel, uint8 of shape (n, height, width).
        images: Py<PyArray3<u8>>,
        /// The centres of the corner LEDs, top left, top right, bottom right and bottom left: x and y in pixels of the image, of shape
        /// (n, 4, 2).
        corners_px: Py<PyArray3<f32>>,
        /// AGR, GRI and NGR of each LED's cell, float32 of shape (n, 8, 8, 3).
        features: Py<PyArray4<f32>>,
    }
}

fn pair(interval: [f64; 2]) -> (f64, f64) {
    (interval[0], interval[1])
}

/// A level for drawing many frames.
pub fn single_precision(level: &str) -> PyResult<Level> {
    match check(level.parse())? {
        Level::Reference => Err(refused("the reference level is for single frames (render): choose fine or fast")),
        level => Ok(level),
    }
}

/// Measures distinguishability of On and Off and the bit error rate in a scene by Monte Carlo, bit for bit as `vocc evaluate` does.
///
/// Each of `frames` frames has random bits and a random sub-pixel phase, which depend only on `seed`, not on `threads` (None: all
/// processors). With `random_reflectance`, each also has a random reflectance of 0.3 to 0.5. `detector` is best, ml, kmeans, kmeans-raw,
/// fisher, fisher-ngr, otsu or genie, or your own function. `by_frame` also counts the errors of each frame: with the same scene, seed and
/// `random_reflectance`, frame k is the same for all detectors. `rare_events` reaches errors by splitting, for bit error rates below 1e-6.
/// `camera` is the receiver's configuration of the camera. `progress` is called with the number of frames done since its last call, as
/// `tqdm(...).update` expects. Ctrl-C ends the evaluation.
///
/// A function receives a DetectorInput of up to `batch` frames, in order, in the calling thread, and returns an array of shape (n, 8, 8) or
/// (n, 64), LED 8*row + column: bool, True for On, or float, soft values such as log likelihood ratios, On above 0. An exception in it ends
/// the call. Detectors with a name need no `batch`, and give the same counts with any. To train a detector, take frames with the truth from
/// `frames` with another seed.
///
/// Raises VoccError if the scene cannot be seen, if an argument is out of its range, or if the function returns another shape or values
/// that are not numbers, and TypeError if it returns another type.
///
/// >>> import vocc
/// >>> far = vocc.Scene("paper", distance_m=70, interval=0.5, illuminance_lx=1000, noise="on")
/// >>> found = vocc.evaluate(far, frames=1000)
/// >>> found.frames, found.ber_95[0] <= found.ber <= found.ber_95[1]
/// (1000, True)
/// >>> sorted(found.to_dict())[:3]
/// ['b2w', 'ber', 'ber_95']
/// >>> def brighter_than_average(frames):
/// ...     return frames.features[..., 0] - 1
/// >>> own = vocc.evaluate(far, frames=1000, detector=brighter_than_average, by_frame=True)
/// >>> own.detector, int(own.errors_by_frame.sum()) == own.bit_errors, own.bvar == found.bvar
/// ('brighter_than_average', True, True)
#[pyfunction]
#[pyo3(
    signature = (
        scene=None, *, frames=1000, seed=1, detector=None, random_reflectance=false, rare_events=false, level="fast", camera=None,
        threads=None, progress=None, batch=1024, by_frame=false
    ),
    text_signature = "(scene=None, *, frames=1000, seed=1, detector='kmeans', random_reflectance=False, rare_events=False, \
                      level='fast', camera=None, threads=None, progress=None, batch=1024, by_frame=False)"
)]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn evaluate<'py>(
    py: Python<'py>,
    scene: Option<&Bound<'py, PyAny>>,
    frames: u64,
    seed: u64,
    detector: Option<&Bound<'py, PyAny>>,
    random_reflectance: bool,
    rare_events: bool,
    level: &str,
    camera: Option<&Bound<'py, PyAny>>,
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
    batch: u64,
    by_frame: bool,
) -> PyResult<Evaluation> {
    if !(1..=MOST_FRAMES).contains(&frames) {
        return Err(refused(SweepError::Frames(frames)));
    }
    if by_frame && frames > BY_FRAME_MAX {
        return Err(refused(format!(
            "frames = {frames}: give at most {BY_FRAME_MAX} with by_frame, or leave that out"
        )));
    }
    if by_frame && rare_events {
        return Err(refused("rare_events counts no errors of frames: leave it or by_frame out"));
    }
    let scene = scene_of(scene)?;
    let detector = Detector::of(detector)?;
    if batch == 0 && matches!(detector, Detector::Named(_)) {
        return Err(refused("batch = 0: give 1 frame or more at a time"));
    }
    let settings = Settings {
        frames,
        seed,
        random_reflectance,
        detector: detector.choice(),
        level: single_precision(level)?,
        camera: camera.map(camera_of).transpose()?.map(|told| told.camera()),
        stop: studies::stop::Stop::NEVER,
    };
    if let (Detector::Own(_), true) = (&detector, rare_events || settings.camera.is_some()) {
        return Err(refused(
            "rare_events and camera are for detectors by name, and a function has neither: leave them out",
        ));
    }
    let work = Work::on(threads)?;
    let begun = Instant::now();
    let counts = Counts::new(by_frame);
    let (found, errors_by_frame) = match &detector {
        Detector::Own(function) => {
            let evaluator = guarded(|| py.detach(|| check(Evaluator::new(&scene, settings))))?;
            let labels = Labels {
                features: true,
                ..Labels::default()
            };
            let source = FrameSource::new(evaluator, labels);
            check_batch(batch, &source, "")?;
            read_by_function(py, &source, function, batch, &work, progress, counts)?.finish("")?
        }
        Detector::Named(choice) if by_frame => work
            .run(py, progress, |control| read_by_name(&scene, settings, counts, control))?
            .finish(choice.name())?,
        Detector::Named(_) => {
            let mut sweep = Sweep::single(scene.clone(), &settings);
            sweep.rare_events = rare_events;
            let found = work.run(py, progress, |mut control| {
                let mut results = Results::new(sweep.clone());
                let run = Run::new(&sweep, Shard::WHOLE, None)?.until(control.stop);
                run.advance(&mut results, |news| {
                    control.done(news.frames);
                    true
                })?;
                Ok::<_, SweepError>(results.summary(0))
            })?;
            (found, None)
        }
    };
    let seconds = begun.elapsed().as_secs_f64();
    let plan = guarded(|| py.detach(|| check(monte_carlo::view(&scene, random_reflectance).map(|view| Plan::of(&view)))))?;
    let plan = decisions(&plan).into_iter().map(|decision| Py::new(py, decision));
    Ok(Evaluation {
        detector: detector.name()?,
        frames: found.frames,
        bits: found.bits,
        bit_errors: found.bit_errors,
        effective_errors: found.effective_errors,
        ber: found.ber,
        ber_95: pair(found.ber_95),
        ber_one_symbol: found.ber_one_symbol,
        ber_one_symbol_95: found.ber_one_symbol_95.map(pair),
        frames_across: found.frames_across,
        bit_errors_across: found.bit_errors_across,
        panel_errors: found.panel_errors,
        panel_error_rate_95: found.panel_error_rate_95.map(pair),
        bvar: found.bvar,
        wvar: found.wvar,
        b2w: found.b2w,
        errors_by_frame: errors_by_frame.map(|errors| errors.into_pyarray(py).unbind()),
        seconds,
        seed,
        level: level.into(),
        plan: plan.collect::<PyResult<_>>()?,
    })
}

/// Maximum number of frames for errors by frame: 4 GB.
const BY_FRAME_MAX: u64 = 1 << 32;
/// Number of frames drawn at a time if the caller does not see them.
const BATCH: u64 = 4096;

/// The reader of the frames.
enum Detector<'a, 'py> {
    Named(DetectorChoice),
    Own(&'a Bound<'py, PyAny>),
}

impl<'a, 'py> Detector<'a, 'py> {
    fn of(object: Option<&'a Bound<'py, PyAny>>) -> PyResult<Self> {
        let Some(object) = object else {
            return Ok(Self::Named(DetectorChoice::KMeans));
        };
        if let Ok(name) = object.cast::<PyString>() {
            return check(name.to_cow()?.parse()).map(Self::Named);
        }
        match object.is_callable() {
            true => Ok(Self::Own(object)),
            false => Err(PyTypeError::new_err(format!(
                "detector is of type {}: give a name, such as 'ml', or a function that gets a DetectorInput",
                object.get_type().name()?
            ))),
        }
    }

    /// The detector by which frames are measured.
    fn choice(&self) -> DetectorChoice {
        match self {
            Self::Named(choice) => *choice,
            Self::Own(_) => DetectorChoice::KMeans,
        }
    }

    fn name(&self) -> PyResult<String> {
        match self {
            Self::Named(choice) => Ok(choice.name().into()),
            Self::Own(function) => match function.getattr("__name__").and_then(|name| name.extract()) {
                Ok(name) => Ok(name),
                Err(_) => Ok(function.get_type().name()?.to_string()),
            },
        }
    }
}

/// The errors of all frames and, if requested, of each.
struct Counts {
    tally: Tally,
    by_frame: Option<Vec<u8>>,
}

impl Counts {
    fn new(by_frame: bool) -> Self {
        Self {
            tally: Tally::default(),
            by_frame: by_frame.then(Vec::new),
        }
    }

    fn add(&mut self, frame: &LabelledFrame, read: PanelFrame) -> Result<(), AccumulatorError> {
        if let Some(by_frame) = &mut self.by_frame {
            by_frame.push(read.distance(frame.bits) as u8);
        }
        self.tally.push(frame, read)
    }

    fn finish(self, detector: &'static str) -> PyResult<(Summary, Option<Vec<u8>>)> {
        Ok((Summary::of(&check(self.tally.finish())?, detector), self.by_frame))
    }
}

/// Reads all frames with a function.
fn read_by_function(
    py: Python<'_>,
    source: &FrameSource,
    function: &Bound<'_, PyAny>,
    batch: u64,
    work: &Work,
    progress: Option<&Bound<'_, PyAny>>,
    mut counts: Counts,
) -> PyResult<Counts> {
    let end = source.evaluator().settings().frames;
    let mut first = 0;
    while first < end {
        let count = batch.min(end - first) as usize;
        let (images, frames) = draw(py, source, work, first, count)?;
        let input = DetectorInput {
            first,
            images: pictures(py, source, images)?,
            corners_px: all_corners(py, &frames)?,
            features: all_features(py, &frames)?,
        };
        let read = arrays::panels_read(&function.call1((input,))?, first, count)?;
        for (frame, read) in frames.iter().zip(read) {
            check(counts.add(frame, read))?;
        }
        first += count as u64;
        if let Some(progress) = progress {
            progress.call1((count,))?;
        }
    }
    Ok(counts)
}

/// Reads all frames with the configured detector.
fn read_by_name(scene: &Scene, settings: Settings, mut counts: Counts, mut control: WorkControl) -> Result<Counts, EvaluateError> {
    let stop = control.stop;
    let labels = Labels {
        features: true,
        reading: true,
    };
    let source = FrameSource::new(Evaluator::new(scene, Settings { stop, ..settings })?, labels);
    let mut images = Vec::new();
    for first in (0..settings.frames).step_by(BATCH as usize) {
        let count = BATCH.min(settings.frames - first);
        images.resize(count as usize * source.pixels(), 0);
        for frame in source.draw_many(first, &mut images, stop)? {
            counts.add(&frame, frame.read.unwrap_or_default())?;
        }
        control.done(first + count);
    }
    Ok(counts)
}
