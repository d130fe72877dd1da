//! The features of many frames at one setting, in batches, so that statistics of them have an interval.

use crate::parallel::{threads, try_map_with};
use link::panel::LEDS;
use serde::{Deserialize, Serialize};

use super::pieces::Pieces;
use super::sums::Sums;
use crate::detectors::DetectorChoice;
use crate::monte_carlo::{EvaluateError, Evaluator, Settings, Workspace};
use crate::optimum::PIECE;
use crate::statistics::{BATCHES, Estimate, jackknife};
use crate::stop::Stop;
use sim::scene::Scene;

/// The frames at one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Batches {
    batches: Vec<Sums>,
}

impl Batches {
    /// Measures `frames` random frames of `scene`, rounded up to whole batches, each with its own reflectance.
    ///
    /// # Errors
    /// If the scene cannot be seen or measured, or `stop` ended it.
    pub fn measure(scene: &Scene, frames: u64, seed: u64, stop: Stop) -> Result<Self, EvaluateError> {
        Self::measure_on(scene, frames, seed, stop, &mut Pieces::default(), |_| {})
    }

    /// As [`Batches::measure`], continued from finished batches, to which it adds; calls `tell` with them from time to time.
    ///
    /// # Errors
    /// As [`Batches::measure`]; finished batches are in `pieces`.
    pub(super) fn measure_on(
        scene: &Scene,
        frames: u64,
        seed: u64,
        stop: Stop,
        pieces: &mut Pieces,
        mut tell: impl FnMut(&Pieces),
    ) -> Result<Self, EvaluateError> {
        let settings = Settings {
            stop,
            ..Settings::fast(frames, seed, DetectorChoice::KMeans)
        };
        let evaluator = Evaluator::new(scene, settings)?;
        let frames = frames.div_ceil(BATCHES as u64).max(1);
        let batch = |workspace: &mut Workspace, batch: u64| -> Result<Sums, EvaluateError> {
            let mut sums = Sums::default();
            for frame in batch * frames..(batch + 1) * frames {
                let observed = evaluator.observe(frame, workspace)?;
                sums.push(&observed, &evaluator.led_greys(workspace));
            }
            Ok(sums)
        };
        let at_once = ((PIECE / frames) as usize).max(1).next_multiple_of(threads());
        while pieces.batches.len() < BATCHES {
            let begun = pieces.batches.len();
            let piece = (begun..BATCHES.min(begun + at_once)).map(|index| index as u64);
            let piece = try_map_with(piece, || evaluator.workspace(), batch)?;
            pieces.batches.extend(piece);
            tell(pieces);
        }
        Ok(Self {
            batches: std::mem::take(&mut pieces.batches),
        })
    }

    /// The sums of all batches, or all but one.
    pub fn total(&self, left_out: Option<usize>) -> Sums {
        let mut total = Sums::default();
        let is_in = |&(batch, _): &(usize, &Sums)| Some(batch) != left_out;
        for (_, sums) in self.batches.iter().enumerate().filter(is_in) {
            total.merge(sums);
        }
        total
    }

    /// Frames measured.
    pub fn frames(&self) -> u64 {
        let total = self.total(None);
        (total.on.count() + total.off.count()) / LEDS as u64
    }

    /// A statistic of the sums.
    pub fn estimate(&self, statistic: impl Fn(&Sums) -> f64) -> Estimate {
        jackknife(|left_out| statistic(&self.total(left_out)))
    }
}

/// A statistic of several points whose frames have the same random numbers.
pub fn estimate_of(points: &[&Batches], statistic: impl Fn(&[Sums]) -> f64) -> Estimate {
    jackknife(|left_out| {
        let totals: Vec<Sums> = points.iter().map(|point| point.total(left_out)).collect();
        statistic(&totals)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(frames: u64, seed: u64) -> Batches {
        let scene = Scene::load("paper", &[]).unwrap();
        Batches::measure(&scene, frames, seed, Stop::NEVER).unwrap()
    }

    fn b2w(sums: &Sums) -> f64 {
        sums.distinguishability().b2w.expect("frames that vary")
    }

    #[test]
    fn a_point_is_what_the_evaluator_gives() {
        let scene = Scene::load("paper", &[]).unwrap();
        let settings = Settings::fast(320, 5, DetectorChoice::KMeans);
        let evaluation = Evaluator::new(&scene, settings).unwrap().run(|_| true).unwrap();
        let point = point(320, 5);
        assert_eq!(point.frames(), 320);
        let (a, b) = (point.estimate(b2w).value, evaluation.distinguishability().b2w.unwrap());
        assert!((a / b - 1.0).abs() < 1e-9, "{a} against {b}");
    }

    #[test]
    fn an_led_is_bright_at_its_centre() {
        let total = point(320, 1).total(None);
        let [on, off] = [total.on_grey.mean()[0], total.off_grey.mean()[0]];
        let mean = |agr: f64| agr * 150.0;
        assert!(on > 230.0 && off < 160.0, "{on} and {off}");
        assert!(mean(total.on.mean()[0]) < on, "a cell holds darker pixels than its LED's centre");
    }

    #[test]
    fn intervals_hold_the_value_of_many_frames_and_shrink() {
        let exact = point(20_000, 100).estimate(b2w).value;
        let estimates: Vec<Estimate> = (1..=20).map(|seed| point(640, seed).estimate(b2w)).collect();
        let held = estimates.iter().filter(|e| (e.low..=e.high).contains(&exact)).count();
        assert!(held >= 16, "{held} of 20 hold {exact} (seeds 1 to 20)");
        let width = |e: &Estimate| e.high - e.low;
        let narrow = point(64 * 160, 1).estimate(b2w);
        let ratio = estimates.iter().map(width).sum::<f64>() / 20.0 / width(&narrow);
        assert!((2.5..6.5).contains(&ratio), "16 times the frames: {ratio}");
    }
}
