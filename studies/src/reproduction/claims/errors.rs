//! Section 4.4.4: the bit error rate with the best L2A and with a random one.

use super::super::axes::PAPERS_DETECTOR;
use super::super::errors::Dimming;
use super::super::findings::Findings;
use super::super::study::Study;
use super::claim::{Claim, Test, Words};
use crate::statistics::Estimate;
use crate::statistics::FrameErrors;

const LOWER: Words = Words {
    name: "ber-lower-with-best",
    figure: "22",
    claim: "the BER of the optimal set is lower at all distances",
    quantity: "greatest ratio of the BER with the best L2A to that with a random one, over the distances at which bits are wrong",
};

pub fn claims(study: &Study, findings: &Findings) -> Vec<Claim> {
    let counted = |&distance_m: &f64| {
        let of = |dimming| findings.errors(distance_m, dimming, PAPERS_DETECTOR);
        Some((of(Dimming::Best)?, of(Dimming::Random)?))
    };
    let counted: Option<Vec<(&FrameErrors, &FrameErrors)>> = study.axes.error_distance_m.iter().map(counted).collect();
    let counted = counted.unwrap_or_default();
    let ratios: Vec<Estimate> = counted.iter().filter_map(|(best, random)| ratio(best, random)).collect();
    let silent = counted.len() - ratios.len();
    let greatest = ratios.into_iter().reduce(greater);
    let decided = greatest.map(|greatest| LOWER.decided(greatest, Test::Below(1.0)));
    decided.map(|claim| silence(claim, silent)).into_iter().collect()
}

/// At `silent` distances no bit was wrong in either set, so that the set with fewer errors is unknown: the claim may be open, but not hold.
fn silence(claim: Claim, silent: usize) -> Claim {
    match silent {
        0 => claim,
        _ => Claim {
            quantity: format!("{}; no bit is wrong at {silent} distances", claim.quantity),
            holds: claim.holds.filter(|holds| !holds),
            ..claim
        },
    }
}

/// The greater of two numbers. Its interval holds the truth if those of both do.
fn greater(a: Estimate, b: Estimate) -> Estimate {
    Estimate {
        value: a.value.max(b.value),
        low: a.low.max(b.low),
        high: a.high.max(b.high),
    }
}

/// The ratio of two error rates, its interval from the ends of theirs; `None` if no bit was wrong in either.
fn ratio(best: &FrameErrors, random: &FrameErrors) -> Option<Estimate> {
    if best.errors() == 0 && random.errors() == 0 {
        return None;
    }
    let ([best_low, best_high], [low, high]) = (best.interval_95(), random.interval_95());
    Some(Estimate {
        value: best.rate() / random.rate(),
        low: best_low / high,
        high: best_high / low,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_nothing_is_wrong_nothing_can_be_told() {
        let of = |errors: u32| {
            let mut counted = FrameErrors::default();
            (0..1000).for_each(|frame| counted.push(if frame % 10 == 0 { errors } else { 0 }));
            counted
        };
        assert_eq!(ratio(&of(0), &of(0)), None);
        let half = ratio(&of(20), &of(40)).unwrap();
        assert!(half.value == 0.5 && half.low < 0.5 && half.high < 1.0, "{half:?}");
        let holds = |silent| silence(LOWER.decided(half, Test::Below(1.0)), silent).holds;
        assert_eq!([holds(0), holds(1)], [Some(true), None]);
        let none = ratio(&of(0), &of(1)).unwrap();
        assert_eq!(none.value, 0.0);
        let both = greater(none, half);
        assert_eq!((both.value, both.low, both.high), (0.5, half.low, none.high.max(half.high)));
    }
}
