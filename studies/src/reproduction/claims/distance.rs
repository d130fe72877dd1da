//! Section 4.4.2 (b): the effect of the distance.

use super::super::findings::Findings;
use super::super::study::Study;
use super::claim::{Claim, Test, Words};
use super::trend::{b2w, bvar, curve, greatest_rise, least_rise, wvar};

/// The distances in the claims, which are about steps between them.
const SHOWN_M: [f64; 5] = [30.0, 40.0, 50.0, 60.0, 70.0];

const BVAR_FALLS: Words = Words {
    name: "bvar-falls-with-distance",
    figure: "20a",
    claim: "Bvar decreases as the distance increases",
    quantity: "greatest change of Bvar from one distance to the next, %",
};
const WVAR_RISES: Words = Words {
    name: "wvar-rises-with-distance",
    figure: "20a",
    claim: "Wvar increases as the distance increases",
    quantity: "least change of Wvar from one distance to the next, %",
};
const B2W_FALLS: Words = Words {
    name: "b2w-falls-with-distance",
    figure: "20b",
    claim: "B2W decreases sharply as the distance increases",
    quantity: "greatest change of B2W from one distance to the next, %",
};

pub fn claims(study: &Study, findings: &Findings) -> Vec<Claim> {
    let mut shown = study.over_distance();
    shown.retain(|setting| SHOWN_M.contains(&setting.distance_m));
    let Some(points) = curve(&shown, findings).filter(|points| points.len() > 1) else {
        return Vec::new();
    };
    vec![
        BVAR_FALLS.decided(greatest_rise(&points, bvar), Test::Below(0.0)),
        WVAR_RISES.decided(least_rise(&points, wvar), Test::Above(0.0)),
        B2W_FALLS.decided(greatest_rise(&points, b2w), Test::Below(0.0)),
    ]
}
