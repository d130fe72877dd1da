//! Section 4.4.2 (a): the effect of the LED interval.

use super::super::batches::estimate_of;
use super::super::findings::Findings;
use super::super::paper::BVAR_PEAK_INTERVAL;
use super::super::study::Study;
use super::super::sums::Sums;
use super::claim::{Claim, Test, Words};
use super::trend::{b2w, bvar, curve, greatest_rise, least_rise, percent, wvar};

/// The paper's intervals; the claims are about steps between them.
const SHOWN: [f64; 4] = [0.5, 1.0, 1.5, 2.0];

const WVAR_FALLS: Words = Words {
    name: "wvar-falls-with-interval",
    figure: "17a",
    claim: "Wvar decreases greatly as the interval increases",
    quantity: "greatest change of Wvar from one interval to the next, %",
};
const BVAR_RISES: Words = Words {
    name: "bvar-rises-with-interval",
    figure: "17a",
    claim: "Bvar increases with the interval up to 1.5",
    quantity: "least change of Bvar from one interval to the next, up to 1.5, %",
};
const BVAR_FALLS: Words = Words {
    name: "bvar-falls-at-2",
    figure: "17a",
    claim: "Bvar decreases at interval 2",
    quantity: "change of Bvar from interval 1.5 to 2, %",
};
const RANGES_SHRINK: Words = Words {
    name: "ranges-shrink-at-2",
    figure: "16d",
    claim: "because the ranges of GRI and AGR decrease",
    quantity: "change from interval 1.5 to 2 of the distance between the class means, in AGR or GRI, whichever shrinks less, %",
};
const B2W_RISES: Words = Words {
    name: "b2w-rises-with-interval",
    figure: "17b",
    claim: "B2W increases with the interval",
    quantity: "least change of B2W from one interval to the next, %",
};

pub fn claims(study: &Study, findings: &Findings) -> Vec<Claim> {
    let mut shown = study.over_interval();
    shown.retain(|setting| SHOWN.contains(&setting.interval));
    let Some(points) = curve(&shown, findings).filter(|points| points.len() > 1) else {
        return Vec::new();
    };
    let before = shown.partition_point(|setting| setting.interval < BVAR_PEAK_INTERVAL);
    let before = before.min(points.len() - 1);
    let ends = [points[before], points[points.len() - 1]];
    let fall = estimate_of(&ends, |sums| percent(bvar(&sums[0]), bvar(&sums[1])));
    let apart = |sums: &Sums, axis: usize| sums.on.mean()[axis] - sums.off.mean()[axis];
    let shrinking = estimate_of(&ends, |sums| {
        let of = |axis| percent(apart(&sums[0], axis), apart(&sums[1], axis));
        of(0).max(of(1))
    });
    vec![
        WVAR_FALLS.decided(greatest_rise(&points, wvar), Test::Below(0.0)),
        BVAR_RISES.decided(least_rise(&points[..=before], bvar), Test::Above(0.0)),
        BVAR_FALLS.decided(fall, Test::Below(0.0)),
        RANGES_SHRINK.decided(shrinking, Test::Below(0.0)),
        B2W_RISES.decided(least_rise(&points, b2w), Test::Above(0.0)),
    ]
}
