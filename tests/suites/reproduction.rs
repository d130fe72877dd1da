//! The claims of Do & Yoo 2020 (Sensors 20, 292, section 4.4), on small seeded runs.

use sim::scene::Scene;
use studies::reproduction::{Axes, Claim, Extent, Findings, Study, judge};

const SEED: u64 = 1;

/// The claims from a study with fewer points than are published.
fn claims_of(overrides: &[&str]) -> Vec<Claim> {
    let overrides: Vec<String> = overrides.iter().map(|text| text.to_string()).collect();
    let scene = Scene::load("paper", &overrides).expect("a preset");
    let study = Study {
        axes: Axes {
            optimum_interval: vec![1.0, 1.5],
            error_distance_m: vec![70.0],
            ..Axes::of(Extent::Claims)
        },
        ..Study::new(scene, Extent::Claims, 3000, SEED)
    };
    let mut findings = Findings::default();
    for task in study.tasks() {
        let found = study.perform(&task, &findings).expect("a task");
        findings.keep(task, found.expect("not interrupted"));
    }
    judge(&study, &findings)
}

fn assert_outcome(claims: &[Claim], wanted: &[(&str, bool)]) {
    for (name, holds) in wanted {
        let claim = claims.iter().find(|claim| claim.name == *name);
        let claim = claim.unwrap_or_else(|| panic!("no claim {name}"));
        assert_eq!(claim.holds, Some(*holds), "seed {SEED}: {claim:#?}");
    }
}

#[test]
fn most_claims_hold_and_these_do_not() {
    let claims = claims_of(&[]);
    assert_outcome(
        &claims,
        &[
            ("extinction-is-higher", true),
            ("wvar-rises", true),
            ("bvar-rises", true),
            ("bvar-levels-off", true),
            ("bvar-barely-changes", true),
            ("off-catches-up", false),
            ("wvar-falls-with-interval", true),
            ("bvar-rises-with-interval", false),
            ("bvar-falls-at-2", true),
            ("ranges-shrink-at-2", true),
            ("b2w-rises-with-interval", true),
            ("bvar-falls-with-distance", true),
            ("wvar-rises-with-distance", false),
            ("b2w-falls-with-distance", true),
            ("best-is-2", true),
            ("best-rises-with-interval", true),
            ("best-is-higher-near-at-1", false),
            ("best-is-higher-near-at-1.5", false),
            ("ber-lower-with-best", true),
        ],
    );
    assert_eq!(claims.len(), 19);
}

#[test]
fn without_pi_nothing_levels_off_and_the_best_ratio_is_not_two() {
    let claims = claims_of(&["link.contrast=eq10"]);
    assert_outcome(&claims, &[("bvar-levels-off", false), ("best-is-2", false)]);
}
