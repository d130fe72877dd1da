//! A panel at 150 m, whose LED images nearly merge: the operator to invert is nearly singular.
//! `rx-pipeline/src/likelihood/least_squares/tests.rs` compares the detector's initial solver with the exact inverse.

use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};

const FRAMES: u64 = 32;

/// 150 m at night: noise at ISO 32 000.
fn scene() -> Scene {
    let overrides = [
        "pose.distance_m=150",
        "panel.interval=1.5",
        "ambient.illuminance_lx=50",
        "link.l2a=2",
        "effects.noise=on",
    ];
    Scene::load("paper", &overrides.map(String::from)).expect("a scene")
}

#[test]
fn the_likeliest_bits_at_150_m_are_no_worse_than_otsu_s_and_near_the_genie_s() {
    let rate = |detector| {
        let settings = Settings::fast(FRAMES, 7, detector);
        let evaluator = Evaluator::new(&scene(), settings).expect("a visible scene");
        evaluator.run(|_| true).expect("measurable frames").errors.rate()
    };
    let [kmeans, otsu, found, genie] = [
        DetectorChoice::KMeans,
        DetectorChoice::Otsu,
        DetectorChoice::MaximumLikelihood,
        DetectorChoice::Genie,
    ]
    .map(rate);
    println!("BER {kmeans:.3} by k-means, {otsu:.3} by Otsu, {found:.3} the likeliest bits, {genie:.3} the genie (seed 7)");
    assert!((0.30..0.42).contains(&otsu) && kmeans > 0.3, "{otsu}, {kmeans}");
    assert!(found <= otsu && found <= 1.5 * genie, "{found} between {genie} and {otsu}");
}
