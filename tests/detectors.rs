//! Detectors against one another on noisy scenes.

use sim::accuracy::Level;
use sim::detectors::DetectorChoice;
use sim::evaluate::{Evaluator, Settings};
use sim::scene::Scene;

#[test]
fn fisher_learns_on_a_dimmed_and_noisy_panel_too() {
    for preset in ["day", "night"] {
        let scene = Scene::load(preset, &["link.l2a=2".into()]).expect("a preset");
        let rate = |detector| {
            let settings = Settings {
                frames: 500,
                seed: 7,
                random_reflectance: true,
                detector,
                level: Level::Fast,
            };
            let evaluator = Evaluator::new(&scene, settings).expect("a visible scene");
            evaluator
                .run(|_| true)
                .expect("measurable frames")
                .errors
                .rate()
        };
        let (fisher, kmeans) = (rate(DetectorChoice::Fisher), rate(DetectorChoice::KMeans));
        assert!(fisher <= kmeans, "{preset}: {fisher} against {kmeans}");
    }
}
