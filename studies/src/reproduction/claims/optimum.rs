//! Sections 4.4.1 and 4.4.3: the best L2A.

use super::super::findings::Findings;
use super::super::operating_point::OperatingPoint;
use super::super::optima::BestRatio;
use super::super::paper::BEST_L2A;
use super::super::study::Study;
use super::claim::{Claim, Test, Words};
use crate::statistics::Estimate;

/// The tolerance on the paper's best ratio.
const NEAR: f64 = 0.25;

const BEST_IS_TWO: Words = Words {
    name: "best-is-2",
    figure: "14b",
    claim: "at interval 1 and 50 m the best L2A is 2",
    quantity: "L2A of the greatest B2W (holds within 0.25 of 2)",
};
const RISES_WITH_INTERVAL: Words = Words {
    name: "best-rises-with-interval",
    figure: "21a",
    claim: "the best L2A is higher at large intervals",
    quantity: "least difference of the best L2A between an interval and the next, at any distance",
};
const WHEN_NEAR: Words = Words {
    name: "best-is-higher-near",
    figure: "21a",
    claim: "the best L2A is higher at short distances",
    quantity: "best L2A at 30 m less that at 70 m",
};

pub fn claims(study: &Study, findings: &Findings) -> Vec<Claim> {
    let best = |interval: f64, distance_m: f64| findings.optimum(interval, distance_m);
    let intervals = &study.axes.optimum_interval;
    let distances = &study.axes.optimum_distance_m;
    let at = OperatingPoint::REFERENCE;
    let is_two = best(at.interval, at.distance_m).map(|best| BEST_IS_TWO.decided(best.l2a, Test::Near(BEST_L2A, NEAR)));
    let pairs = intervals
        .windows(2)
        .flat_map(|pair| distances.iter().map(move |&distance_m| (pair, distance_m)));
    let rises: Option<Vec<Difference>> = pairs
        .map(|(pair, distance_m)| Some(difference(best(pair[1], distance_m)?, best(pair[0], distance_m)?)))
        .collect();
    let rises = rises
        .and_then(|rises| rises.into_iter().min_by(|a, b| a.number.value.total_cmp(&b.number.value)))
        .map(|least| least.decides(&RISES_WITH_INTERVAL));
    let near = intervals.iter().filter_map(|&interval| {
        let (near, far) = (distances.first()?, distances.last()?);
        let decided = difference(best(interval, *near)?, best(interval, *far)?).decides(&WHEN_NEAR);
        Some(Claim {
            name: format!("{}-at-{interval}", decided.name),
            claim: format!("{} (at interval {interval})", decided.claim),
            ..decided
        })
    });
    is_two.into_iter().chain(rises).chain(near).collect()
}

/// The difference of two best ratios.
struct Difference {
    number: Estimate,
    /// Whether both are the end of the range, so that their difference is unknown.
    is_beyond: bool,
}

impl Difference {
    /// The verdict on the claim that it is positive.
    fn decides(&self, words: &Words) -> Claim {
        let decided = words.decided(self.number, Test::Above(0.0));
        if !self.is_beyond {
            return decided;
        }
        Claim {
            quantity: format!("{} (both at the end of the range)", decided.quantity),
            holds: None,
            ..decided
        }
    }
}

/// The difference of two best ratios, treated as independent.
fn difference(a: &BestRatio, b: &BestRatio) -> Difference {
    let reach = |best: &BestRatio| (best.l2a.high - best.l2a.low) / 2.0;
    let reach = reach(a).hypot(reach(b));
    let value = a.l2a.value - b.l2a.value;
    Difference {
        number: Estimate {
            value,
            low: value - reach,
            high: value + reach,
        },
        is_beyond: a.at_border && b.at_border,
    }
}
