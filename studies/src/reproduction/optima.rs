//! The best ratio at each interval and distance (figure 21 of Do & Yoo 2020).

use serde::{Deserialize, Serialize};

use super::operating_point::OperatingPoint;
use super::pieces::Pieces;
use crate::optimum::{OptimumError, Search, optimum_from};
use crate::statistics::Estimate;
use sim::scene::Scene;

/// The best ratio at an interval and a distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BestRatio {
    /// The ratio, from 0.2 to 4.
    pub l2a: Estimate,
    /// Its B2W.
    pub b2w: f64,
    /// Whether it is the end of that range: the true one may lie beyond.
    pub at_border: bool,
}

/// Finds the best ratio, continuing from finished pieces of the search's rounds, to which it adds; calls `tell` with them from time to
/// time.
///
/// # Errors
/// If the scene cannot be evaluated, or the search was stopped.
pub fn find(
    scene: &Scene,
    interval: f64,
    distance_m: f64,
    search: &Search,
    pieces: &mut Pieces,
    mut tell: impl FnMut(&Pieces),
) -> Result<BestRatio, OptimumError> {
    let setting = OperatingPoint {
        interval,
        distance_m,
        l2a: 1.0,
    };
    let known = &mut std::mem::take(&mut pieces.rounds).into_iter();
    let best = optimum_from(&setting.scene(scene), search, known, |piece| {
        pieces.rounds.push(piece.batches.to_vec());
        tell(pieces);
    })?;
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
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::stop::Stop;

    #[test]
    fn the_papers_best_ratio_is_found_and_a_search_can_be_given_up() {
        let scene = Scene::load("paper", &[]).unwrap();
        let search = Search {
            frames: 1024,
            ..Search::default()
        };
        let find = |search: &Search| find(&scene, 1.0, 50.0, search, &mut Pieces::default(), |_| {});
        let best = find(&search).unwrap();
        assert!((best.l2a.value - 2.0).abs() < 0.25 && !best.at_border, "{best:?}");
        static ASKED: AtomicBool = AtomicBool::new(true);
        let stopped = Search {
            stop: Stop::at(&ASKED),
            ..search
        };
        let given_up = find(&stopped);
        assert!(matches!(given_up, Err(OptimumError::Interrupted)), "{given_up:?}");
    }
}
