//! The distance from which on too many bits are wrong at a ratio.

use std::collections::BTreeMap;

use rx_pipeline::corners::CornersError;
use rx_pipeline::likelihood::Experience;
use rx_pipeline::locate::LEAST_PITCH_PX;
use serde::{Deserialize, Serialize};
use sim::scene::Scene;

use super::ReachError;
use crate::monte_carlo::{EvaluateError, Evaluator, Settings};
use crate::optimum::{Criterion, Sample, at_ratio};

/// Steps of the distance per octave, 4.4 % each: between two of them the log-odds of an error are straight enough to locate it to 0.1 %.
const STEPS_IN_OCTAVE: u32 = 16;
/// Steps between the distances tried at a ratio from near to far: half an octave.
const STRIDE: usize = 8;
/// Steps within which panels look alike: a fifth of the distance.
const ALIKE: u32 = 4;
/// Frames of a first trial.
const SCOUTS: u64 = 128;
/// The nearest distance, m.
const NEAREST_M: f64 = 5.0;
/// Pixels across the widest evaluated panel; nearer panels are tried from the distance of that width.
const WIDEST_PX: f64 = 110.0;
/// The pitch in pixels below which LEDs are indistinguishable, and no receiver reads them.
const CLOSEST_PX: f64 = 1.0;
/// The most moves of a crossing by a step.
const MOVES_MAX: u32 = 16;

/// Two neighbouring distances, between which too many bits start to be wrong at a ratio.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// The ratio.
    pub l2a: f64,
    /// The steps of the distance.
    pub(super) steps: [u32; 2],
    /// The result at each of them; none at the farther one if LEDs are indistinguishable there.
    pub(super) near: Sample,
    pub(super) far: Option<Sample>,
}

impl Crossing {
    /// The distances, m.
    pub fn distance_m(&self) -> [f64; 2] {
        self.steps.map(distance_m)
    }

    /// Rounds of frames behind it.
    pub fn rounds(&self) -> usize {
        self.near.rounds()
    }

    /// Frames at each of its distances.
    pub fn frames(&self) -> u64 {
        self.near.total().errors.frames()
    }
}

/// The expected place of a crossing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Guess {
    /// Within a step or two of this one.
    Near(u32),
    /// Some steps from this one.
    Beside(u32),
    /// Unknown.
    Anywhere,
}

/// The distance of a step, m, to a millimetre.
fn distance_m(step: u32) -> f64 {
    let exact = NEAREST_M * (f64::from(step) / f64::from(STEPS_IN_OCTAVE)).exp2();
    (exact * 1e3).round() / 1e3
}

/// The last step within this distance.
fn step_within(distance_m: f64) -> u32 {
    (f64::from(STEPS_IN_OCTAVE) * (distance_m / NEAREST_M).log2()).max(0.0) as u32
}

/// The log-odds of a right bit.
pub(super) fn log_odds(error_rate: f64) -> f64 {
    ((1.0 - error_rate) / error_rate).ln()
}

/// A scene's first panel at one ratio, at any distance.
pub(super) struct Probe<'a> {
    scene: &'a Scene,
    settings: Settings,
    /// The required log-odds of a right bit.
    asked: f64,
    l2a: f64,
    /// The first and the last step of the distance.
    ends: [u32; 2],
    /// The receiver's estimates from following the panel, and their step.
    experience: Option<(u32, Experience)>,
    /// Few frames, by step.
    scouts: BTreeMap<u32, Sample>,
    /// Many frames, by step.
    samples: BTreeMap<u32, Sample>,
}

impl<'a> Probe<'a> {
    pub fn new(scene: &'a Scene, settings: Settings, raw_error_rate: f64, l2a: f64) -> Self {
        let pitch_px = pitch_px_at_one_metre(scene);
        let nearest = step_within(8.0 * pitch_px / WIDEST_PX) + 1;
        Self {
            scene,
            settings,
            asked: log_odds(raw_error_rate),
            l2a,
            ends: [nearest, step_within(pitch_px / CLOSEST_PX).max(nearest + 1)],
            experience: None,
            scouts: BTreeMap::new(),
            samples: BTreeMap::new(),
        }
    }

    /// Adds known results.
    pub fn remember(&mut self, known: &Crossing) {
        let samples = [Some(&known.near), known.far.as_ref()];
        for (step, sample) in known.steps.into_iter().zip(samples.into_iter().flatten()) {
            self.samples.insert(step, sample.clone());
        }
    }

    /// The crossing, from a number of rounds of frames. `None` if too many bits are wrong at the nearest distance already.
    pub fn crossing(&mut self, rounds: usize, guess: Guess) -> Result<Option<Crossing>, ReachError> {
        let [first, last] = self.ends;
        let found = match guess {
            Guess::Near(step) => Some(step.clamp(first, last - 1)),
            Guess::Beside(step) => self.last_good(step)?,
            Guess::Anywhere => self.last_good(first.midpoint(last))?,
        };
        let Some(mut low) = found else {
            return Ok(None);
        };
        // A few frames may be wrong by a step.
        for _ in 0..MOVES_MAX {
            if low > first && !self.is_good(low, Some(rounds))? {
                low -= 1;
            } else if low + 1 < last && self.is_good(low + 1, Some(rounds))? {
                low += 1;
            } else {
                break;
            }
        }
        let steps = [low, low + 1];
        let near = self.sample(steps[0], Some(rounds))?;
        let far = self.sample(steps[1], Some(rounds))?;
        Ok(near.map(|near| Crossing {
            l2a: self.l2a,
            steps,
            near,
            far,
        }))
    }

    /// The nearest distance with too many wrong bits, m, in half octaves before a step.
    pub fn lost_before(&mut self, step: u32) -> Result<Option<f64>, ReachError> {
        for nearer in (self.ends[0]..step).step_by(STRIDE) {
            if !self.is_good(nearer, None)? {
                return Ok(Some(distance_m(nearer)));
            }
        }
        Ok(None)
    }

    /// The last step next to `start` that is good by a few frames, while the next one is not; `None` if there is none.
    fn last_good(&mut self, start: u32) -> Result<Option<u32>, ReachError> {
        let [first, last] = self.ends;
        let start = start.clamp(first, last - 1);
        let goes_out = self.is_good(start, None)?;
        let (mut inside, mut stride) = (start, 1);
        // In steps of doubling length to the change of the verdict, then back by halves.
        let outside = loop {
            let next = match goes_out {
                true => (inside + stride).min(last),
                false => inside.saturating_sub(stride).max(first),
            };
            if next == inside || (goes_out && next == last) {
                return Ok(goes_out.then_some(last - 1));
            }
            if self.is_good(next, None)? != goes_out {
                break next;
            }
            inside = next;
            stride *= 2;
        };
        let (mut good, mut bad) = match goes_out {
            true => (inside, outside),
            false => (outside, inside),
        };
        while bad - good > 1 {
            let middle = good.midpoint(bad);
            match self.is_good(middle, None)? {
                true => good = middle,
                false => bad = middle,
            }
        }
        Ok(Some(good))
    }

    /// Whether few enough bits are wrong, by a number of rounds of frames or by a few frames.
    fn is_good(&mut self, step: u32, rounds: Option<usize>) -> Result<bool, ReachError> {
        let sample = self.sample(step, rounds)?;
        let odds = sample.and_then(|sample| Criterion::Ber.objective(&sample.total()));
        Ok(odds >= Some(self.asked))
    }

    /// A number of rounds of frames at a step, or a few frames; `None` if LEDs are indistinguishable.
    fn sample(&mut self, step: u32, rounds: Option<usize>) -> Result<Option<Sample>, ReachError> {
        let (all, frames) = match rounds {
            Some(_) => (&mut self.samples, self.settings.frames),
            None => (&mut self.scouts, self.settings.frames.min(SCOUTS)),
        };
        let sample = all.entry(step).or_insert_with(|| Sample::none(self.l2a));
        let rounds = rounds.unwrap_or(1);
        let settings = Settings { frames, ..self.settings };
        let scene = at_distance(self.scene, distance_m(step));
        let scene = at_ratio(&scene, self.l2a);
        let experience = &mut self.experience;
        let evaluator = || {
            // Estimates from a panel far nearer or farther are for another size of spots.
            let learnt = experience.filter(|(learnt_at, _)| learnt_at.abs_diff(step) <= ALIKE);
            let learnt = learnt.map(|(_, learnt)| learnt);
            let evaluator = Evaluator::experienced(&scene, settings, learnt)?;
            if learnt.is_none() {
                *experience = Some((step, evaluator.experience()));
            }
            Ok(evaluator)
        };
        let nothing = &mut std::iter::empty();
        match sample.extend(frames, rounds, nothing, |_| {}, evaluator) {
            Ok(()) => Ok(Some(sample.first(rounds))),
            Err(EvaluateError::Corners(CornersError::PitchTooSmall { .. })) => Ok(None),
            Err(EvaluateError::Stopped) => Err(ReachError::Interrupted),
            Err(source) => Err(ReachError::Evaluate {
                l2a: self.l2a,
                distance_m: distance_m(step),
                source: Box::new(source),
            }),
        }
    }
}

/// Pixels from LED to LED of the scene's first panel from 1 m away.
fn pitch_px_at_one_metre(scene: &Scene) -> f64 {
    let focal_px = 1e3 * scene.camera.focal_length_mm / scene.camera.pixel_pitch_um;
    let pitch_m = scene.panels.first().map_or(0.0, |panel| panel.pitch_m());
    pitch_m * focal_px
}

/// The greatest distance at which a receiver finds the scene's first panel, in metres: beyond, the pitch is less than [`LEAST_PITCH_PX`].
///
/// ```
/// use sim::scene::Scene;
/// let scene = Scene::load("night", &["panel.interval=1".into()])?;
/// assert!((studies::reach::found_to_m(&scene) - 109.0).abs() < 1.0);
/// # Ok::<(), sim::scene::SceneError>(())
/// ```
pub fn found_to_m(scene: &Scene) -> f64 {
    let pose = scene.pose_of(0);
    let slant = pose.yaw_deg.to_radians().cos().min(pose.pitch_deg.to_radians().cos());
    pitch_px_at_one_metre(scene) * slant.abs() / f64::from(LEAST_PITCH_PX)
}

/// The scene with its first panel at that distance.
fn at_distance(scene: &Scene, distance_m: f64) -> Scene {
    let mut scene = scene.clone();
    scene.pose_of_mut(0).distance_m = distance_m;
    scene
}
