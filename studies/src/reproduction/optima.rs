//! The best ratio at each interval and distance (figure 21 of Do & Yoo 2020).

use serde::{Deserialize, Serialize};

use super::operating_point::OperatingPoint;
use crate::optimum::{OptimumError, Search, optimum};
use crate::statistics::Estimate;
use sim::scene::Scene;

/// The best ratio at an interval and a distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BestRatio {
    /// The ratio, from 0.2 to 4.
    pub l2a: Estimate,
    /// The B2W that it gives.
    pub b2w: f64,
    /// Whether it is the end of that range: the true one may lie beyond.
    pub at_border: bool,
}

/// Finds it.
///
/// `going_on` is asked now and then; when it answers no the search is given up.
///
/// # Errors
/// When the scene cannot be evaluated, or the search was given up.
pub fn find(
    scene: &Scene,
    interval: f64,
    distance_m: f64,
    search: &Search,
    going_on: &dyn Fn() -> bool,
) -> Result<BestRatio, OptimumError> {
    let setting = OperatingPoint {
        interval,
        distance_m,
        l2a: 1.0,
    };
    let best = optimum(&setting.scene(scene), search, |_| going_on())?;
    let [low, high] = best.l2a_95;
    Ok(BestRatio {
        l2a: Estimate {
            value: best.l2a,
            low,
            high,
        },
        b2w: best.value,
        at_border: best.at_border,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_best_ratio_is_found_and_a_search_can_be_given_up() {
        let scene = Scene::load("paper", &[]).unwrap();
        let search = Search {
            frames: 1024,
            ..Search::default()
        };
        let best = find(&scene, 1.0, 50.0, &search, &|| true).unwrap();
        assert!(
            (best.l2a.value - 2.0).abs() < 0.25 && !best.at_border,
            "{best:?}"
        );
        let given_up = find(&scene, 1.0, 50.0, &search, &|| false);
        assert!(
            matches!(given_up, Err(OptimumError::Interrupted)),
            "{given_up:?}"
        );
    }
}
