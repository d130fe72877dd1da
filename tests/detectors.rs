//! Detectors against one another, and against what is possible, on noisy scenes.

use sim::accuracy::Level;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};

/// The bit errors of a detector in a number of frames.
fn errors(scene: &Scene, detector: DetectorChoice, frames: u64) -> u64 {
    let settings = Settings {
        frames,
        seed: 7,
        random_reflectance: true,
        detector,
        level: Level::Fast,
    };
    let evaluator = Evaluator::new(scene, settings).expect("a visible scene");
    evaluator
        .run(|_| true)
        .expect("measurable frames")
        .errors
        .errors()
}

#[test]
fn fisher_learns_on_a_dimmed_and_noisy_panel_too() {
    for preset in ["day", "night"] {
        let scene = Scene::load(preset, &["link.l2a=2".into()]).expect("a preset");
        let [fisher, with_ngr, kmeans] = [
            DetectorChoice::Fisher,
            DetectorChoice::FisherNgr,
            DetectorChoice::KMeans,
        ]
        .map(|detector| errors(&scene, detector, 500));
        assert!(fisher <= kmeans, "{preset}: {fisher} against {kmeans}");
        assert!(with_ngr <= kmeans, "{preset}: {with_ngr} against {kmeans}");
    }
}

/// At 70 m, noisy: interval, ISO, L2A.
const NOISY: [(f64, f64, f64); 5] = [
    (0.5, 100.0, 0.2),
    (0.5, 1600.0, 1.0),
    (0.5, 32_000.0, 2.0),
    (1.0, 32_000.0, 2.0),
    (0.5, 100.0, 4.0),
];

#[test]
fn maximum_likelihood_errs_a_tenth_as_often_as_kmeans_and_the_genie_no_more_often() {
    let mut total = [0; 3];
    for (interval, iso, l2a) in NOISY {
        let overrides = [
            "pose.distance_m=70".into(),
            format!("panel.interval={interval}"),
            format!("ambient.illuminance_lx={}", 16_000.0 * 100.0 / iso),
            format!("link.l2a={l2a}"),
            "effects.noise=on".into(),
        ];
        let scene = Scene::load("paper", &overrides).expect("a valid scene");
        let [kmeans, found, genie] = [
            DetectorChoice::KMeans,
            DetectorChoice::MaximumLikelihood,
            DetectorChoice::Genie,
        ]
        .map(|detector| errors(&scene, detector, 24));
        println!("interval {interval}, ISO {iso}, L2A {l2a}: {kmeans}, {found}, {genie} (seed 7)");
        assert!(10 * found <= kmeans, "{found} against {kmeans}");
        total = [total[0] + kmeans, total[1] + found, total[2] + genie];
    }
    let [kmeans, found, genie] = total;
    assert!(
        30 * found <= kmeans && genie <= found,
        "{found} between {genie} and {kmeans}"
    );
}
