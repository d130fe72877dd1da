//! The width of a number's interval against time, with common random numbers and without.

use rand::Rng;

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, variant};
use super::point::Point;
use super::quartiles::Quartiles;
use super::scale::Scale;
use super::steps::Steps;
use super::timing::{Candidate, time_by_turns};
use crate::detectors::DetectorChoice;
use crate::monte_carlo::{Evaluator, Settings};
use crate::optimum::{Criterion, Peak, Samples, Window, at_ratio};
use crate::reproduction::{Batches, Sums, estimate_of};
use crate::statistics::share_95;
use crate::stop::Stop;
use sim::random::{Purpose, stream};
use sim::scene::Scene;

/// Frames at one setting.
const FRAMES: [u64; 6] = [256, 1024, 4096, 16_384, 65_536, DEFAULT_FRAMES];
/// The default maximum of `vocc optimize`.
const DEFAULT_FRAMES: u64 = 100_000;
/// Runs of other seeds, for comparison with the reference.
const REPEATS: usize = 24;
/// The most frames of repeated runs.
const REPEATED: u64 = 4096;
/// The factor on the reference's frames.
const REFERENCE: u64 = 4;
/// The ratios of the search for the best one, by a parabola.
const GRID: [f64; 9] = [1.6, 1.7, 1.8, 1.9, 2.0, 2.1, 2.2, 2.3, 2.4];
/// Two ratios to compare.
const PAIR: [f64; 2] = [1.6, 2.0];
/// Settings with enough wrong bits to count.
const WRONG: [&str; 4] = [
    "pose.distance_m=70",
    "panel.interval=0.5",
    "link.l2a=1",
    "ambient.illuminance_lx=1000",
];

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let paper = Scene::load("paper", &[])?;
    let wrong = WRONG.map(String::from).into_iter().chain(["effects.noise=on".into()]);
    let wrong = Scene::load("paper", &wrong.collect::<Vec<_>>())?;
    let study = Study {
        frame_ns: steps.take("time of a frame", |_| {
            Ok([time_of_frame(&paper, scale)?, time_of_frame(&wrong, scale)?])
        })?,
        paper,
        wrong,
        scale: *scale,
    };
    let diagrams = vec![
        steps.take("b2w", |_| study.b2w())?,
        steps.take("pair", |_| study.pair())?,
        steps.take("best", |_| study.best())?,
        steps.take("errors", |_| study.errors())?,
    ];
    Ok(Measurement {
        method: format!(
            "The error is half the width of the 95 % interval. *common*: all ratios see the same frames; *independent*: each has its \
             own. *true error*: the deviation that 95 % of {REPEATS} other seeds do not exceed. Bit errors are those of k-means at 70 m, \
             interval 0.5, L2A 1, 1000 lx."
        ),
        reference: format!("Another seed, with {REFERENCE} times as many frames as the longest run shown."),
        diagrams,
    })
}

fn settings(frames: u64, seed: u64) -> Settings {
    Settings::fast(frames, seed, DetectorChoice::KMeans)
}

/// Rendering, measuring and reading one frame.
fn time_of_frame(scene: &Scene, scale: &Scale) -> Result<Quartiles, PrecisionError> {
    let evaluator = Evaluator::new(scene, settings(1, scale.seed))?;
    let mut workspace = evaluator.workspace();
    evaluator.evaluate(0..1, &mut workspace)?;
    let mut frame = 0;
    let candidate = Candidate::new(Point::new("one frame", 0.0), 1.0, move || {
        frame += 1;
        // The first frame could be measured, and so can the others.
        let _ = std::hint::black_box(evaluator.evaluate(frame..frame + 1, &mut workspace));
    });
    let timed = time_by_turns(vec![candidate], scale.turns);
    Ok(timed[0].cost)
}

/// Two scenes and the time of a frame of each.
struct Study {
    paper: Scene,
    wrong: Scene,
    frame_ns: [Quartiles; 2],
    scale: Scale,
}

/// The random numbers of a comparison's settings.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Numbers {
    Common,
    Independent,
}

impl Study {
    /// The longest run is the default's, or a share of it.
    fn frames(&self) -> Vec<u64> {
        let most = self.scale.of(DEFAULT_FRAMES as usize, 1024) as u64;
        let fewer = FRAMES.into_iter().filter(|&frames| frames < most);
        fewer.chain([most]).collect()
    }

    /// The seeds of runs for comparison with the reference.
    fn seeds(&self, frames: u64) -> std::ops::Range<u64> {
        let repeats = self.scale.of(REPEATS, 4) as u64;
        let first = 1000 * (1 + self.scale.seed) + frames;
        if frames <= REPEATED {
            first..first + repeats
        } else {
            first..first + 1
        }
    }

    fn reference_frames(&self) -> u64 {
        REFERENCE * self.frames().last().copied().unwrap_or(DEFAULT_FRAMES)
    }

    /// A curve of half widths, and the errors that they bound.
    ///
    /// `estimate` gives a value and its half width, from a number of frames of a seed.
    fn curve(
        &self,
        name: &str,
        settings: usize,
        frame_ns: Quartiles,
        truth: f64,
        estimate: impl Fn(u64, u64) -> Result<(f64, f64), PrecisionError>,
    ) -> Result<Vec<Point>, PrecisionError> {
        let (mut widths, mut errors) = (Vec::new(), Vec::new());
        for frames in self.frames() {
            let runs = self.seeds(frames).map(|seed| estimate(frames, seed));
            let runs: Vec<(f64, f64)> = runs.collect::<Result<_, _>>()?;
            let half = Quartiles::of(runs.iter().map(|run| run.1)).median;
            let cost = frame_ns.times(frames as f64 * settings as f64);
            let point = |variant: String, error, curve: &str| Point {
                cost,
                ..Point::new(variant, error).on(curve)
            };
            widths.push(point(format!("{name}, {frames}"), half, name));
            if runs.len() > 1 {
                let mut off: Vec<f64> = runs.iter().map(|run| (run.0 - truth).abs()).collect();
                off.sort_by(f64::total_cmp);
                let held = runs.iter().filter(|run| (run.0 - truth).abs() <= run.1).count();
                let last = widths.len() - 1;
                widths[last].note = format!("held the reference in {held} of {} runs", runs.len());
                let bound = off[(0.95 * off.len() as f64).ceil() as usize - 1];
                let curve = format!("{name}, true error");
                errors.push(point(format!("{curve}, {frames}"), bound, &curve));
            }
        }
        widths.extend(errors);
        Ok(widths)
    }

    fn b2w(&self) -> Result<Diagram, PrecisionError> {
        let truth = Batches::measure(&self.paper, self.reference_frames(), self.scale.seed, Stop::NEVER)?
            .estimate(b2w)
            .value;
        let points = self.curve("one setting", 1, self.frame_ns[0], truth, |frames, seed| {
            let estimate = Batches::measure(&self.paper, frames, seed, Stop::NEVER)?.estimate(b2w);
            Ok((estimate.value, estimate.value - estimate.low))
        })?;
        let error = ["half width of the interval, over B2W", ""];
        Ok(diagram("B2W at L2A 2", error, relative(points, truth)))
    }

    fn pair(&self) -> Result<Diagram, PrecisionError> {
        let scenes = PAIR.map(|l2a| at_ratio(&self.paper, l2a));
        let ratio = |sums: &[Sums]| b2w(&sums[0]) / b2w(&sums[1]);
        let estimate = |frames, seed, numbers| {
            let seeds = [seed, other_seed(seed, 1, numbers)];
            let [one, other] = [0, 1].map(|k| Batches::measure(&scenes[k], frames, seeds[k], Stop::NEVER));
            let estimate = estimate_of(&[&one?, &other?], ratio);
            Ok((estimate.value, estimate.value - estimate.low))
        };
        let (truth, _): (f64, f64) = estimate(self.reference_frames(), self.scale.seed, Numbers::Common)?;
        self.both("B2W at L2A 1.6 over that at 2", "", 2, truth, estimate)
    }

    fn best(&self) -> Result<Diagram, PrecisionError> {
        let estimate = |frames, seed, numbers| {
            let mut samples = Samples::default();
            for (k, &l2a) in (0..).zip(&GRID) {
                let settings = settings(frames, other_seed(seed, k, numbers));
                samples.extend(&self.paper, settings, l2a, usize::MAX)?;
            }
            let range = [GRID[0], GRID[GRID.len() - 1]];
            let peak = Peak::of(&samples, Criterion::B2w, Window::All, range, seed);
            Ok(peak.map_or((f64::NAN, f64::NAN), |peak| (peak.l2a, (peak.l2a_95[1] - peak.l2a_95[0]) / 2.0)))
        };
        let (truth, _) = estimate(self.reference_frames(), self.scale.seed, Numbers::Common)?;
        self.both("best L2A", "1/sr", GRID.len(), truth, estimate)
    }

    /// With common random numbers and with independent ones.
    fn both(
        &self,
        title: &str,
        error_unit: &str,
        settings: usize,
        truth: f64,
        estimate: impl Fn(u64, u64, Numbers) -> Result<(f64, f64), PrecisionError>,
    ) -> Result<Diagram, PrecisionError> {
        let mut points = Vec::new();
        for (name, numbers) in [("common", Numbers::Common), ("independent", Numbers::Independent)] {
            let estimate = |frames, seed| estimate(frames, seed, numbers);
            points.extend(self.curve(name, settings, self.frame_ns[0], truth, estimate)?);
        }
        Ok(diagram(title, ["half width of the interval", error_unit], points))
    }

    fn errors(&self) -> Result<Diagram, PrecisionError> {
        let count = |frames, seed| -> Result<_, PrecisionError> {
            let evaluator = Evaluator::new(&self.wrong, settings(frames, seed))?;
            Ok(evaluator.run(|_| true)?.errors)
        };
        let truth = count(self.reference_frames(), self.scale.seed)?.rate();
        let mut points = self.curve("one setting", 1, self.frame_ns[1], truth, |frames, seed| {
            let errors = count(frames, seed)?;
            let [low, high] = errors.interval_95();
            Ok((errors.rate(), (high - low) / 2.0))
        })?;
        points.extend(self.curve("as if independent", 1, self.frame_ns[1], truth, |frames, seed| {
            let errors = count(frames, seed)?;
            let [low, high] = share_95(errors.errors() as f64, errors.bits() as f64);
            Ok((errors.rate(), (high - low) / 2.0))
        })?);
        points.retain(|point| point.curve != "as if independent, true error");
        let title = format!("bit error rate of {truth:.3}");
        let error = ["half width of the interval, over the rate", ""];
        Ok(diagram(&title, error, relative(points, truth)))
    }
}

/// Errors relative to the value.
fn relative(points: Vec<Point>, value: f64) -> Vec<Point> {
    let relative = |point: Point| Point {
        error: point.error / value,
        ..point
    };
    points.into_iter().map(relative).collect()
}

/// The seed of setting `k`.
fn other_seed(seed: u64, k: u64, numbers: Numbers) -> u64 {
    match numbers {
        Numbers::Common => seed,
        Numbers::Independent => stream(seed, k, Purpose::Resampling).next_u64(),
    }
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let with = |title: fn(&str) -> bool| diagrams.iter().filter(move |diagram| title(&diagram.title));
    let gain_of = |title| range(with(title).flat_map(gain));
    format!(
        "Common random numbers, and {DEFAULT_FRAMES} frames or as many as the tolerance needs. Common numbers divide the error of a \
         comparison of two ratios by {}, and that of the best L2A by {}, at no cost. Intervals of bit errors, treated *as if independent* \
         within a frame, are {} times as wide.",
        gain_of(|title| title.starts_with("B2W at L2A 1.6")),
        gain_of(|title| title == "best L2A"),
        range(with(|title| title.starts_with("bit error rate")).flat_map(as_if_independent))
    )
}

/// The intervals with independent bits, relative to those of frames.
fn as_if_independent(diagram: &Diagram) -> Vec<f64> {
    over(diagram, "as if independent", "one setting")
}

/// The factor by which common frames narrow intervals.
fn gain(diagram: &Diagram) -> Vec<f64> {
    over(diagram, "independent", "common")
}

/// The errors on one curve relative to those with as many frames on another.
fn over(diagram: &Diagram, above: &str, below: &str) -> Vec<f64> {
    let points = diagram.points.iter().filter(|point| point.curve == below);
    let ratio = |point: &Point| {
        let frames = point.variant.strip_prefix(below)?;
        Some(variant(diagram, &format!("{above}{frames}"))?.error / point.error)
    };
    points.filter_map(ratio).collect()
}

/// B2W of the frames at one setting: defined, because random bits hold both classes, and random phases and reflectance scatter them.
fn b2w(sums: &Sums) -> f64 {
    sums.distinguishability().b2w.unwrap_or_default()
}

/// Costs relative to that of the first curve's longest run, the default.
fn diagram(title: &str, error: [&str; 2], mut points: Vec<Point>) -> Diagram {
    let first = points.first().map(|point| point.curve.clone()).unwrap_or_default();
    let default = points.iter().rposition(|point| point.curve == first).unwrap_or(0);
    let yardstick = points.get(default).map_or(1.0, |point| point.cost.median);
    for (k, point) in points.iter_mut().enumerate() {
        (point.is_default, point.is_baseline) = (k == default, k == default);
        point.ratio = Quartiles::exactly(point.cost.median / yardstick);
    }
    // Intervals compete; the errors that they bound do not.
    let (intervals, errors): (Vec<_>, Vec<_>) = points
        .into_iter()
        .partition(|point| !point.curve.ends_with("true error") && point.curve != "as if independent");
    let mut diagram = Diagram::of(title, error, "all frames", intervals);
    diagram.points.extend(errors);
    diagram
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_random_numbers_are_surer_of_a_difference_and_more_frames_of_all() {
        let scenes = PAIR.map(|l2a| at_ratio(&Scene::load("paper", &[]).unwrap(), l2a));
        let width = |frames, numbers| {
            let seeds = [7, other_seed(7, 1, numbers)];
            let points = [0, 1].map(|k| Batches::measure(&scenes[k], frames, seeds[k], Stop::NEVER).unwrap());
            let estimate = estimate_of(&[&points[0], &points[1]], |sums| b2w(&sums[0]) / b2w(&sums[1]));
            estimate.high - estimate.low
        };
        let common = width(2048, Numbers::Common);
        assert!(common < width(2048, Numbers::Independent) / 1.5);
        assert!(common < width(256, Numbers::Common) / 1.5);
    }
}
