//! The precision of the best ratio by reach, against time: the search, and a plain grid of ratios and distances.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::Measurement;
use super::diagram::Diagram;
use super::error::PrecisionError;
use super::numbers::{range, rounded, variant};
use super::point::Point;
use super::quartiles::Quartiles;
use super::scale::Scale;
use super::steps::Steps;
use crate::detectors::DetectorChoice;
use crate::monte_carlo::{Evaluator, Settings};
use crate::optimum::{RANGE, at_ratio};
use crate::parallel::on_one_thread;
use crate::reach::{Choice, ReachError, ReachSearch, reach};
use sim::scene::Scene;

/// Settings with losses on both sides of the best ratio: too dark, and too bright.
const SETTINGS: [&str; 2] = ["ambient.illuminance_lx=50", "panel.interval=0.5"];
/// The most frames of the search, at one ratio and distance.
const FRAMES: [u64; 4] = [128, 512, 2048, DEFAULT_FRAMES];
/// The default of `vocc optimize --criterion reach`.
const DEFAULT_FRAMES: u64 = 4096;
/// The variant for a first look.
const QUICK: &str = "search, 512 frames";
/// The factor on the reference's frames.
const REFERENCE: u64 = 8;
/// Searches of other seeds.
const REPEATS: usize = 8;
/// Ratios, distances and frames of plain grids.
const GRIDS: [(usize, usize, u64); 4] = [(8, 8, 128), (16, 16, 512), (32, 32, 256), (32, 64, 512)];
/// The distances of the grids, m: a factor of three either way of the reach.
const GRID_M: [f64; 2] = [20.0, 180.0];

/// The result of one run, and its time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Estimate {
    l2a: f64,
    reach_m: f64,
    ns: f64,
}

/// A variant of the search.
enum Way {
    /// With at most this many frames.
    Search(u64),
    /// Numbers of ratios and distances, and of frames at each.
    Grid(usize, usize, u64),
}

impl Way {
    fn point(&self) -> Point {
        match self {
            Self::Search(frames) => Point::new(format!("search, {frames} frames"), 0.0).on("search"),
            Self::Grid(ratios, distances, frames) => {
                let name = format!("grid of {ratios} × {distances}, {frames} frames");
                Point::new(name, 0.0).on("grid")
            }
        }
    }

    fn find(&self, scene: &Scene, seed: u64) -> Result<Estimate, PrecisionError> {
        match *self {
            Self::Search(frames) => by_search(scene, frames, seed),
            Self::Grid(ratios, distances, frames) => by_grid(scene, ratios, distances, frames, seed),
        }
    }
}

/// Measures it.
pub fn measure(scale: &Scale, steps: &mut Steps) -> Result<Measurement, PrecisionError> {
    let scene = Scene::load("night", &SETTINGS.map(String::from))?;
    let most = scale.of(DEFAULT_FRAMES as usize, 128) as u64;
    let fewer = FRAMES.into_iter().filter(|&frames| frames < most);
    let grids = GRIDS
        .into_iter()
        .map(|(ratios, distances, frames)| Way::Grid(ratios, distances, scale.of(frames as usize, 32) as u64));
    let ways: Vec<Way> = fewer.chain([most]).map(Way::Search).chain(grids).collect();
    let truth = steps.take("reference", |_| by_search(&scene, REFERENCE * most, scale.seed))?;
    // Alternate: all variants with one seed, then all with the next.
    let mut turns: Vec<Vec<Estimate>> = Vec::new();
    for number in 1..=scale.of(REPEATS, 1) as u64 {
        let found = |way: &Way| way.find(&scene, 1000 * scale.seed + number);
        turns.push(steps.take(format!("turn {number}"), |_| ways.iter().map(found).collect())?);
    }
    let default = Way::Search(most).point().variant;
    let diagrams = vec![
        diagram("best L2A", &default, &ways, &turns, |found| found.l2a / truth.l2a),
        diagram("its reach", &default, &ways, &turns, |found| found.reach_m / truth.reach_m),
    ];
    Ok(Measurement {
        method: format!(
            "The L2A with the greatest reach of 48 bytes by k-means, and that reach, at 50 lx and interval 0.5: root mean square \
             deviations over {} seeds, on one core. *search* is `vocc optimize --criterion reach --tolerance 0` with at most that many \
             frames at each ratio and distance.",
            turns.len()
        ),
        reference: format!("Another seed, with {REFERENCE} times as many frames as the longest search shown."),
        diagrams,
    })
}

/// Runs on one thread, and returns the time.
fn timed<E: Send>(run: impl FnOnce() -> Result<[f64; 2], E> + Send) -> Result<Estimate, PrecisionError>
where
    PrecisionError: From<E>,
{
    let timed = || {
        let start = Instant::now();
        run().map(|found| (found, start.elapsed().as_secs_f64() * 1e9))
    };
    let ([l2a, reach_m], ns) = on_one_thread(timed)??;
    Ok(Estimate { l2a, reach_m, ns })
}

fn by_search(scene: &Scene, frames: u64, seed: u64) -> Result<Estimate, PrecisionError> {
    let search = ReachSearch {
        frames,
        seed,
        tolerance: 0.0,
        detector: DetectorChoice::KMeans,
        choice: Choice::Best,
        ..ReachSearch::default()
    };
    timed(|| -> Result<_, ReachError> {
        let verdict = reach(scene, &search)?.judged.verdict;
        Ok([verdict.best, verdict.reach_m])
    })
}

fn by_grid(scene: &Scene, ratios: usize, distances: usize, frames: u64, seed: u64) -> Result<Estimate, PrecisionError> {
    let settings = Settings::fast(frames, seed, DetectorChoice::KMeans);
    let most_wrong = ReachSearch::default().raw_error_rate;
    let is_read = |l2a, distance_m| -> Result<bool, PrecisionError> {
        let mut scene = at_ratio(scene, l2a);
        scene.pose.distance_m = distance_m;
        let errors = Evaluator::new(&scene, settings)?.run(|_| true)?.of_one_symbol();
        Ok(errors.rate() <= most_wrong)
    };
    timed(|| -> Result<_, PrecisionError> {
        let mut best = (0.0, Vec::new());
        for l2a in points(RANGE, ratios) {
            let mut reach_m = 0.0;
            for distance_m in points(GRID_M, distances) {
                if !is_read(l2a, distance_m)? {
                    break;
                }
                reach_m = distance_m;
            }
            if reach_m > best.0 {
                best = (reach_m, Vec::new());
            }
            if reach_m == best.0 {
                best.1.push(l2a);
            }
        }
        let (reach_m, farthest) = best;
        Ok([farthest[farthest.len() / 2], reach_m])
    })
}

/// Points between two, ends included, at equal factors.
fn points([low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let step = move |point: usize| point as f64 / (count - 1) as f64;
    (0..count).map(move |point| low * (high / low).powf(step(point)))
}

/// The deviation of each variant's runs from 1, and their time over the default's, turn by turn.
fn diagram(title: &str, default: &str, ways: &[Way], turns: &[Vec<Estimate>], over_truth: impl Fn(&Estimate) -> f64) -> Diagram {
    let yardstick = ways.iter().position(|way| way.point().variant == default).unwrap_or(0);
    let point = |(number, way): (usize, &Way)| {
        let runs = turns.iter().map(|turn| turn[number]);
        let squares = runs.clone().map(|run| (over_truth(&run) - 1.0).powi(2));
        Point {
            error: (squares.sum::<f64>() / turns.len() as f64).sqrt(),
            cost: Quartiles::of(runs.map(|run| run.ns)),
            ratio: Quartiles::of(turns.iter().map(|turn| turn[number].ns / turn[yardstick].ns)),
            ..way.point().with_default(number == yardstick)
        }
    };
    let points = ways.iter().enumerate().map(point).collect();
    Diagram::of(title, ["root mean square, over the reference", ""], "one entry of a table", points)
}

/// The default, and the reason.
pub fn why(diagrams: &[Diagram]) -> String {
    let errors = |of: fn(&Point) -> bool| {
        let percent = move |diagram: &Diagram| {
            let points = diagram.points.iter().filter(|point| of(point));
            range(points.map(|point| 100.0 * point.error))
        };
        diagrams.iter().map(percent).collect::<Vec<_>>().join(" and ")
    };
    let quick = diagrams.first().and_then(|diagram| variant(diagram, QUICK));
    let quick = quick.map_or(String::new(), |quick| {
        format!(
            " With 512 frames (`--quick`) a search is {} times as fast, with errors of {} %.",
            rounded(1.0 / quick.ratio.median),
            errors(|point| point.variant == QUICK)
        )
    });
    let grids = diagrams.iter().take(1).flat_map(|diagram| &diagram.points);
    let grids = grids.filter(|point| point.curve == "grid");
    format!(
        "{DEFAULT_FRAMES} frames or as many as the tolerance needs: ratio and reach are off by {} %.{quick} Grids take {} times as long as \
         the default, with errors of {} %.",
        errors(|point| point.is_default),
        range(grids.map(|point| point.ratio.median)),
        errors(|point| point.curve == "grid"),
    )
}
