//! Monte Carlo at one setting.

use std::time::Instant;

use pyo3::prelude::*;
use sim::accuracy::Level;
use sim::plan::Plan;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{self, Settings};
use studies::sweep::{MOST_FRAMES, Results, Run, Shard, Sweep, SweepError};

use crate::camera::camera_of;
use crate::errors::{check, refused};
use crate::record::record;
use crate::scene::{Decision, decisions, scene_of};
use crate::work::Work;

record! {
    /// What came out of an evaluation: the keys of `vocc evaluate --json`.
    Evaluation {
        /// The detector.
        detector: String,
        /// Frames.
        frames: u64,
        /// Bits that were looked at.
        bits: u64,
        /// Those read wrongly; of rare events, the swarms that reached one.
        bit_errors: u64,
        /// The number of counted errors that would tell as much.
        effective_errors: f64,
        /// Bit error rate.
        ber: f64,
        /// Its 95 % interval.
        ber_95: (f64, f64),
        /// The bit error rate of the frames that show one symbol; None where that is not known.
        ber_one_symbol: Option<f64>,
        /// Its 95 % interval, likewise.
        ber_one_symbol_95: Option<(f64, f64)>,
        /// Frames that are exposed across a change of symbols, likewise.
        frames_across: Option<u64>,
        /// Bits that are read wrongly of them, likewise.
        bit_errors_across: Option<u64>,
        /// Panels with any bit read wrongly, likewise.
        panel_errors: Option<u64>,
        /// The 95 % interval of their share, likewise.
        panel_error_rate_95: Option<(f64, f64)>,
        /// Between-class variance of (AGR, GRI); None for rare events.
        bvar: Option<f64>,
        /// Within-class variance, likewise.
        wvar: Option<f64>,
        /// Their ratio, where there is one.
        b2w: Option<f64>,
        /// Seconds of work.
        seconds: f64,
        /// The seed.
        seed: u64,
        /// The level of accuracy.
        level: String,
        /// Which effects were simulated, and why.
        plan: Vec<Py<Decision>>,
    }
}

fn pair(interval: [f64; 2]) -> (f64, f64) {
    (interval[0], interval[1])
}

/// A level that many frames are drawn at.
pub fn single_precision(level: &str) -> PyResult<Level> {
    match check(level.parse())? {
        Level::Reference => Err(refused("the reference level is for single frames (render): choose fine or fast")),
        level => Ok(level),
    }
}

/// Distinguishability of On and Off and the bit error rate in a scene: Monte Carlo, bit for bit that of `vocc evaluate`.
///
/// Each of `frames` frames has random bits and a random sub-pixel phase, drawn by `seed` alone, whatever `threads` are (None: all
/// processors); with `random_reflectance` a reflectance of 0.3 to 0.5, too. `detector` is best, ml, kmeans, kmeans-raw, fisher, fisher-ngr,
/// otsu or genie. `rare_events` reaches errors by splitting, for bit error rates below 1e-6. `camera` is what the receiver is told of the
/// camera. `progress` is called with how many more frames are done, as `tqdm(...).update` wants it. Ctrl-C ends it.
///
/// Raises VoccError where the scene cannot be seen, or an argument is out of its range.
///
/// >>> import vocc
/// >>> far = vocc.Scene("paper", distance_m=70, interval=0.5, illuminance_lx=1000, noise="on")
/// >>> found = vocc.evaluate(far, frames=1000)
/// >>> found.frames, found.ber_95[0] <= found.ber <= found.ber_95[1]
/// (1000, True)
/// >>> sorted(found.to_dict())[:3]
/// ['b2w', 'ber', 'ber_95']
#[pyfunction]
#[pyo3(signature = (
    scene=None, *, frames=1000, seed=1, detector="kmeans", random_reflectance=false, rare_events=false, level="fast", camera=None,
    threads=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn evaluate<'py>(
    py: Python<'py>,
    scene: Option<&Bound<'py, PyAny>>,
    frames: u64,
    seed: u64,
    detector: &str,
    random_reflectance: bool,
    rare_events: bool,
    level: &str,
    camera: Option<&Bound<'py, PyAny>>,
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Evaluation> {
    if !(1..=MOST_FRAMES).contains(&frames) {
        return Err(refused(SweepError::Frames(frames)));
    }
    let scene = scene_of(scene)?;
    let detector: DetectorChoice = check(detector.parse())?;
    let settings = Settings {
        frames,
        seed,
        random_reflectance,
        detector,
        level: single_precision(level)?,
        camera: camera.map(camera_of).transpose()?.map(|told| told.camera()),
        stop: studies::stop::Stop::NEVER,
    };
    let mut sweep = Sweep::single(scene, &settings);
    sweep.rare_events = rare_events;
    let done = Work::on(threads)?.run(py, progress, |mut ears| {
        let mut results = Results::new(sweep.clone());
        let run = Run::new(&sweep, Shard::WHOLE, None)?.until(ears.stop);
        let begun = Instant::now();
        run.advance(&mut results, |news| {
            ears.done(news.frames);
            true
        })?;
        let seconds = begun.elapsed().as_secs_f64();
        let view = monte_carlo::view(&sweep.scene, random_reflectance).map_err(EvaluateFault::View)?;
        Ok::<_, EvaluateFault>((results.summary(0), seconds, Plan::of(&view)))
    })?;
    let (found, seconds, plan) = done;
    let plan = decisions(&plan).into_iter().map(|decision| Py::new(py, decision));
    Ok(Evaluation {
        detector: found.detector.into(),
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
        seconds,
        seed,
        level: level.into(),
        plan: plan.collect::<PyResult<_>>()?,
    })
}

/// Why an evaluation cannot be done.
enum EvaluateFault {
    Sweep(SweepError),
    View(sim::view::ViewError),
}

impl From<SweepError> for EvaluateFault {
    fn from(fault: SweepError) -> Self {
        Self::Sweep(fault)
    }
}

impl std::fmt::Display for EvaluateFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sweep(fault) => fault.fmt(f),
            Self::View(fault) => fault.fmt(f),
        }
    }
}
