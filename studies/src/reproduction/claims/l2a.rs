//! Section 4.4.1: the effect of L2A.

use super::super::batches::estimate_of;
use super::super::findings::Findings;
use super::super::paper::BVAR_LEVELS_OFF_L2A;
use super::super::study::Study;
use super::super::sums::Sums;
use super::claim::{Claim, Test, Words};
use super::trend::{bvar, curve, least_rise, percent, wvar};
use crate::interpolation::{interpolated, reaches};
use crate::statistics::Estimate;

/// The tolerance on [`BVAR_LEVELS_OFF_L2A`].
const NEAR: f64 = 0.3;
/// The share of its greatest value at which Bvar counts as levelled off.
const LEVEL: f64 = 0.9;
/// The greatest change, in percent, that counts as "barely".
const BARELY: f64 = 10.0;
/// The end of the range in which Bvar "initially" increases.
const INITIALLY: f64 = 2.0;

const EXTINCTION: Words = Words {
    name: "extinction-is-higher",
    figure: "12",
    claim: "the extinction ratio is low at low L2A and high at high L2A",
    quantity: "(grey at the centre of On LEDs / that of Off LEDs) at L2A 4 less that at 0.2",
};
const WVAR_RISES: Words = Words {
    name: "wvar-rises",
    figure: "14a",
    claim: "Wvar increases all the way as L2A increases",
    quantity: "least change of Wvar from one L2A to the next, %",
};
const BVAR_RISES: Words = Words {
    name: "bvar-rises",
    figure: "14a",
    claim: "Bvar initially increases with L2A",
    quantity: "least change of Bvar from one L2A to the next, up to 2, %",
};
const BVAR_LEVELS_OFF: Words = Words {
    name: "bvar-levels-off",
    figure: "14a",
    claim: "Bvar levels off when L2A exceeds 2.5",
    quantity: "L2A at which Bvar reaches 90 % of its greatest value (holds within 0.3 of 2.5)",
};
const BVAR_BARELY: Words = Words {
    name: "bvar-barely-changes",
    figure: "14a",
    claim: "when L2A exceeds 2.5 Bvar barely increases",
    quantity: "change of Bvar from L2A 2.5 to 4, % (holds within 10)",
};
const OFF_CATCHES_UP: Words = Words {
    name: "off-catches-up",
    figure: "14a",
    claim: "because On LEDs stand at 255 while interference still brightens Off LEDs, which approach them",
    quantity: "grey levels by which the centres of Off LEDs brighten more than those of On LEDs from L2A 2.5 to 4",
};

pub fn claims(study: &Study, findings: &Findings) -> Vec<Claim> {
    let ratios = &study.axes.l2a;
    let Some(points) = curve(&study.over_l2a(), findings).filter(|points| points.len() > 1) else {
        return Vec::new();
    };
    let initially = ratios.partition_point(|&ratio| ratio < INITIALLY + 1e-9);
    let level = estimate_of(&points, |sums| reaches(ratios, &sums.iter().map(bvar).collect::<Vec<_>>(), LEVEL));
    let from = |start: f64, of: &dyn Fn(&Sums) -> f64, change: &dyn Fn(f64, f64) -> f64| {
        estimate_of(&points, |sums| -> f64 {
            let values: Vec<f64> = sums.iter().map(of).collect();
            let end = values.last().copied().unwrap_or(f64::NAN);
            change(interpolated(ratios, &values, start), end)
        })
    };
    let difference = |from: f64, to: f64| to - from;
    let extinction = |sums: &Sums| sums.on_grey.mean()[0] / sums.off_grey.mean()[0];
    let closeness = |sums: &Sums| sums.off_grey.mean()[0] - sums.on_grey.mean()[0];
    let extinction: Estimate = from(0.0, &extinction, &difference);
    let beyond = from(BVAR_LEVELS_OFF_L2A, &bvar, &percent);
    let closing = from(BVAR_LEVELS_OFF_L2A, &closeness, &difference);
    vec![
        EXTINCTION.decided(extinction, Test::Above(0.0)),
        WVAR_RISES.decided(least_rise(&points, wvar), Test::Above(0.0)),
        BVAR_RISES.decided(least_rise(&points[..initially], bvar), Test::Above(0.0)),
        BVAR_LEVELS_OFF.decided(level, Test::Near(BVAR_LEVELS_OFF_L2A, NEAR)),
        BVAR_BARELY.decided(beyond, Test::Near(0.0, BARELY)),
        OFF_CATCHES_UP.decided(closing, Test::Above(0.0)),
    ]
}
