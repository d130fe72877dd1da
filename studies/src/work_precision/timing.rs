//! Interleaved timing of variants ([`sim::timing`]): the median over the turns counts, with the quartiles as its spread.

use std::time::Duration;

use sim::timing::{Work, by_turns, system_clock};

use super::point::Point;
use super::quartiles::Quartiles;

/// A variant and its work for timing.
pub struct Candidate<'a> {
    /// The variant, with a known error.
    pub point: Point,
    work: Work<'a>,
    /// Units of the cost per call of the work.
    units: f64,
}

impl<'a> Candidate<'a> {
    /// Work that does `units` units of the cost per call.
    pub fn new(point: Point, units: f64, work: impl FnMut() + 'a) -> Self {
        let work = Box::new(work);
        Self { point, work, units }
    }
}

/// Times all, `turns` times in a row; returns their points with costs, in ns, and ratios to that of the baseline, or of the first without
/// one.
pub fn time_by_turns(candidates: Vec<Candidate>, turns: usize) -> Vec<Point> {
    let (mut points, mut works, mut units) = (Vec::new(), Vec::new(), Vec::new());
    for candidate in candidates {
        points.push(candidate.point);
        works.push(candidate.work);
        units.push(candidate.units);
    }
    let mut ns = by_turns(&mut works, turns, Duration::MAX, system_clock);
    for (ns, units) in ns.iter_mut().zip(units) {
        ns.iter_mut().for_each(|ns| *ns /= units);
    }
    let baseline = points.iter().position(|point| point.is_baseline).unwrap_or(0);
    let yardstick = ns.get(baseline).cloned().unwrap_or_default();
    for (point, ns) in points.iter_mut().zip(ns) {
        let ratios = ns.iter().zip(&yardstick).map(|(own, base)| own / base);
        point.ratio = Quartiles::of(ratios);
        point.cost = Quartiles::of(ns);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    fn sum_to(end: u64) -> Candidate<'static> {
        Candidate::new(Point::new(end.to_string(), 0.0), 1.0, move || {
            black_box((0..black_box(end)).fold(0u64, |sum, k| black_box(sum ^ k)));
        })
    }

    #[test]
    fn more_work_takes_longer_and_the_baseline_is_one() {
        let mut baseline = sum_to(100);
        baseline.point.is_baseline = true;
        let points = time_by_turns(vec![sum_to(100_000), baseline], 5);
        assert_eq!(points[1].ratio.median, 1.0);
        // A thousand times the work; far less would suffice.
        assert!(points[0].ratio.median > 20.0, "{points:?}");
        assert!(points[0].cost.low <= points[0].cost.high);
    }

    #[test]
    fn nothing_takes_no_time() {
        assert!(time_by_turns(Vec::new(), 3).is_empty());
    }
}
