//! Timing by turns: each variant runs for a moment, then the next, again and again.
//!
//! What else the machine does then falls on all alike. In a turn the fastest of a few runs counts, one that had the processor to
//! itself; over the turns the median, with the quartiles as its spread.

use std::time::Instant;

use super::diagram::Point;
use super::quartiles::Quartiles;

/// A variant and the work that is timed.
pub struct Candidate<'a> {
    /// The variant, its error known.
    pub point: Point,
    /// The work.
    pub work: Box<dyn FnMut() + 'a>,
    /// How many times the work does what its cost is given of.
    pub units: f64,
}

/// Runs shorter than this are repeated until they take so long: below, the clock's own steps count.
const SHORTEST_NS: f64 = 20_000.0;
/// Of runs up to this time in all the fastest is taken in a turn.
const TURN_NS: f64 = 2e6;
/// Most runs of a turn.
const RUNS: usize = 8;

/// Times all, `turns` times in a row; gives their points back with costs, in ns, and ratios to that of the baseline, or of the
/// first if none is it.
pub fn time_by_turns(candidates: Vec<Candidate>, turns: usize) -> Vec<Point> {
    let (mut points, mut works) = (Vec::new(), Vec::new());
    for candidate in candidates {
        points.push(candidate.point);
        works.push((candidate.work, candidate.units));
    }
    let plans: Vec<(usize, usize)> = works.iter_mut().map(|(work, _)| plan(work)).collect();
    let mut ns = vec![Vec::new(); works.len()];
    for _ in 0..turns.max(1) {
        for (((work, units), &plan), ns) in works.iter_mut().zip(&plans).zip(&mut ns) {
            ns.push(turn(work, plan) / *units);
        }
    }
    let baseline = points
        .iter()
        .position(|point| point.is_baseline)
        .unwrap_or(0);
    let yardstick = ns.get(baseline).cloned().unwrap_or_default();
    for (point, ns) in points.iter_mut().zip(ns) {
        let ratios = ns.iter().zip(&yardstick).map(|(own, base)| own / base);
        point.ratio = Quartiles::of(ratios);
        point.cost = Quartiles::of(ns);
    }
    points
}

/// Repetitions of a run and runs of a turn, from a first run.
fn plan(work: &mut Box<dyn FnMut() + '_>) -> (usize, usize) {
    let once = run(work, 1).max(1.0);
    let repetitions = (SHORTEST_NS / once).ceil().max(1.0);
    let runs = (TURN_NS / (once * repetitions)).clamp(1.0, RUNS as f64);
    (repetitions as usize, runs as usize)
}

fn turn(work: &mut Box<dyn FnMut() + '_>, (repetitions, runs): (usize, usize)) -> f64 {
    let runs = (0..runs).map(|_| run(work, repetitions) / repetitions as f64);
    runs.fold(f64::INFINITY, f64::min)
}

/// The time of so many repetitions, in ns.
fn run(work: &mut Box<dyn FnMut() + '_>, repetitions: usize) -> f64 {
    let started = Instant::now();
    (0..repetitions).for_each(|_| work());
    started.elapsed().as_secs_f64() * 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    fn sum_to(end: u64) -> Candidate<'static> {
        Candidate {
            point: Point::new(end.to_string(), 0.0),
            work: Box::new(move || {
                black_box((0..black_box(end)).fold(0u64, |sum, k| black_box(sum ^ k)));
            }),
            units: 1.0,
        }
    }

    #[test]
    fn more_work_takes_longer_and_the_baseline_is_one() {
        let mut baseline = sum_to(100);
        baseline.point.is_baseline = true;
        let points = time_by_turns(vec![sum_to(100_000), baseline], 5);
        assert_eq!(points[1].ratio.median, 1.0);
        // A thousand times the work; far less would do.
        assert!(points[0].ratio.median > 20.0, "{points:?}");
        assert!(points[0].cost.low <= points[0].cost.high);
    }

    #[test]
    fn nothing_takes_no_time() {
        assert!(time_by_turns(Vec::new(), 3).is_empty());
    }
}
