//! Equal seeds give equal bytes, on one thread or two.

use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluation, Evaluator, Settings};

fn evaluate(preset: &str, detector: DetectorChoice, frames: u64, threads: usize, seed: u64) -> Evaluation {
    let scene = Scene::load(preset, &[]).expect("a preset");
    let settings = Settings::fast(frames, seed, detector);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| {
        Evaluator::new(&scene, settings)
            .expect("a visible scene")
            .run(|_| true)
            .expect("measurable frames")
    })
}

#[test]
fn threads_change_nothing() {
    for (preset, detector, frames) in [
        ("paper", DetectorChoice::KMeans, 3000),
        ("night", DetectorChoice::KMeans, 3000),
        ("night", DetectorChoice::MaximumLikelihood, 600),
    ] {
        let run = |threads, seed| evaluate(preset, detector, frames, threads, seed);
        let one = run(1, 7);
        assert_eq!(one, run(2, 7), "{preset}");
        assert_ne!(one, run(2, 8), "{preset}: another seed must differ, or this shows nothing");
    }
}

#[test]
fn a_frame_does_not_depend_on_those_before_it() {
    let scene = Scene::load("night", &[]).expect("a preset");
    let settings = Settings::fast(0, 7, DetectorChoice::KMeans);
    let evaluator = Evaluator::new(&scene, settings).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let alone = evaluator.observe(40, &mut evaluator.workspace()).expect("a measurable frame");
    for frame in [3, 40] {
        let after_another = evaluator.observe(frame, &mut workspace).expect("a measurable frame");
        assert_eq!(after_another.features.gri == alone.features.gri, frame == 40);
        assert_eq!(after_another.bits == alone.bits, frame == 40);
    }
}
