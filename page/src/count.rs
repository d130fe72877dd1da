//! Bit error rates: counts over an increasing number of frames.

use serde_json::{Value, json};
use sim::accuracy::Level;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluation, Evaluator, Settings, Workspace};

use crate::fault::Fault;

/// The counts of one setting.
pub struct Count {
    evaluator: Evaluator,
    workspace: Workspace,
    sum: Evaluation,
}

impl Count {
    /// Counts of a scene as it is, or with a reflectance that is drawn for each frame.
    pub fn new(scene: &Scene, detector: DetectorChoice, level: Level, seed: u64, random_reflectance: bool) -> Result<Self, Fault> {
        let settings = Settings {
            random_reflectance,
            level,
            ..Settings::fast(0, seed, detector)
        };
        let evaluator = Evaluator::new(scene, settings)?;
        Ok(Self {
            workspace: evaluator.workspace(),
            evaluator,
            sum: Evaluation::default(),
        })
    }

    /// Adds frames.
    pub fn add(&mut self, frames: u64) -> Result<(), Fault> {
        let from = self.sum.errors.frames();
        let part = self.evaluator.evaluate(from..from + frames, &mut self.workspace)?;
        self.sum.merge(&part);
        Ok(())
    }

    /// The result so far.
    pub fn sum(&self) -> &Evaluation {
        &self.sum
    }

    /// The result so far, as JSON for the page.
    pub fn as_json(&self) -> Value {
        let (errors, apart) = (&self.sum.errors, self.sum.distinguishability());
        json!({
            "frames": errors.frames(), "bits": errors.bits(), "bit_errors": errors.errors(), "ber": errors.rate(),
            "ber_95": errors.interval_95(), "bvar": apart.bvar, "wvar": apart.wvar, "b2w": apart.b2w,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_add_up_to_the_whole() {
        let far = [
            "pose.distance_m=70",
            "panel.interval=0.5",
            "ambient.illuminance_lx=1000",
            "effects.noise=on",
        ];
        let scene = Scene::load("paper", &far.map(String::from)).unwrap();
        let count = || Count::new(&scene, DetectorChoice::KMeans, Level::Fast, 1, false).unwrap();
        let (mut whole, mut pieces) = (count(), count());
        whole.add(300).unwrap();
        for frames in [1, 99, 200] {
            pieces.add(frames).unwrap();
        }
        assert_eq!(whole.sum().errors, pieces.sum().errors);
        assert!(whole.sum().errors.errors() > 0);
        let b2w = |count: &Count| count.as_json()["b2w"].as_f64().unwrap();
        assert!((b2w(&whole) / b2w(&pieces) - 1.0).abs() < 1e-9);
    }
}
