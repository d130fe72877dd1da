//! Bit errors over distance with the best L2A and with a random one (figure 22 of Do & Yoo 2020).
//!
//! In both sets the interval is drawn evenly from 0.5 to 2, in the one set the ratio is the best for that interval, in the other
//! it is drawn evenly from 0.2 to 4. The draws are spread evenly: strata of the interval, each with a ratio from a
//! golden-ratio sequence, all with equally many frames. Both sets have the same intervals, bits, phases and reflectances.

use crate::parallel::prelude::*;
use serde::{Deserialize, Serialize};

use super::operating_point::OperatingPoint;
use super::pieces::Pieces;
use crate::monte_carlo::{EvaluateError, Evaluator, Settings, Workspace};
use crate::statistics::FrameErrors;
use sim::scene::Scene;

/// The intervals of Table 1 of Do & Yoo 2020.
pub const INTERVALS: [f64; 2] = [0.5, 2.0];
/// The ratios of Table 1.
pub const RATIOS: [f64; 2] = [0.2, 4.0];
/// (√5 − 1)/2: multiples of it fill the unit interval evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Frames of a stratum between two looks at the number of errors.
const ROUND: u64 = 16;

/// How the panel is dimmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dimming {
    /// To the best ratio for its interval.
    Best,
    /// To any ratio.
    Random,
}

/// The interval and the ratio of each of so many strata; `best` gives the best ratio for an interval.
pub fn strata(count: u64, dimming: Dimming, best: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let between = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
    let stratum = |index: u64| {
        let interval = between(INTERVALS, (index as f64 + 0.5) / count as f64);
        let ratio = match dimming {
            Dimming::Best => best(interval),
            Dimming::Random => between(RATIOS, ((index as f64 + 0.5) * GOLDEN).fract()),
        };
        (interval, ratio)
    };
    (0..count).map(stratum).collect()
}

/// Counts bit errors at a distance over strata of intervals and ratios: in as many frames as `settings` say, rounded up to whole rounds of
/// all strata, or until there are `enough`.
///
/// A detector that learns does so on other frames of each stratum. It goes on from the rounds that are finished, to which it adds;
/// `tell` is shown them now and then.
///
/// # Errors
/// When the scene cannot be seen or measured, the detector not be trained, or [`Settings::stop`] has ended it.
pub fn count(
    scene: &Scene,
    distance_m: f64,
    strata: &[(f64, f64)],
    settings: Settings,
    enough: u64,
    pieces: &mut Pieces,
    mut tell: impl FnMut(&Pieces),
) -> Result<FrameErrors, EvaluateError> {
    let prepare = |&(interval, l2a): &(f64, f64)| {
        let setting = OperatingPoint { interval, distance_m, l2a };
        let evaluator = Evaluator::new(&setting.scene(scene), settings)?;
        let workspace = evaluator.workspace();
        Ok((evaluator, workspace))
    };
    let mut prepared = strata
        .par_iter()
        .map(prepare)
        .collect::<Result<Vec<(Evaluator, Workspace)>, EvaluateError>>()?;
    let of_all = (strata.len() as u64 * ROUND).max(1);
    while pieces.errors.frames() < settings.frames && pieces.errors.errors() < enough {
        // No two strata share a frame's random numbers.
        let done = pieces.errors.frames() / of_all * of_all;
        let frames = |stratum: usize| {
            let first = done + stratum as u64 * ROUND;
            first..first + ROUND
        };
        let round = prepared
            .par_iter_mut()
            .enumerate()
            .map(|(stratum, (evaluator, workspace))| Ok(evaluator.evaluate(frames(stratum), workspace)?.errors))
            .collect::<Result<Vec<_>, EvaluateError>>()?;
        round.iter().for_each(|errors| pieces.errors.merge(errors));
        tell(pieces);
        if strata.is_empty() {
            break;
        }
    }
    Ok(std::mem::take(&mut pieces.errors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detectors::DetectorChoice;

    fn scene() -> Scene {
        Scene::load("paper", &[]).unwrap()
    }

    #[test]
    fn strata_fill_their_ranges_evenly() {
        let random = strata(24, Dimming::Random, |_| 0.0);
        for (of, [low, high]) in [
            (random.iter().map(|s| s.0).collect::<Vec<_>>(), INTERVALS),
            (random.iter().map(|s| s.1).collect(), RATIOS),
        ] {
            let mean = of.iter().sum::<f64>() / of.len() as f64;
            assert!((mean - (low + high) / 2.0).abs() < 0.03 * (high - low));
            assert!(of.iter().all(|x| (low..high).contains(x)));
        }
        let best = strata(24, Dimming::Best, |interval| 2.0 * interval);
        assert!(best.iter().zip(&random).all(|(b, r)| b.0 == r.0 && b.1 == 2.0 * b.0));
    }

    #[test]
    fn a_count_ends_at_its_frames_or_at_its_errors() {
        let strata = strata(24, Dimming::Random, |_| 2.0);
        let count = |frames, errors| {
            let settings = Settings::fast(frames, 1, DetectorChoice::KMeans);
            let pieces = &mut Pieces::default();
            count(&scene(), 70.0, &strata, settings, errors, pieces, |_| {}).unwrap()
        };
        let all = count(1000, u64::MAX);
        assert_eq!(all.frames(), 1152, "three rounds of all strata");
        assert!(all.errors() > 100);
        assert_eq!(count(1000, 1).frames(), 384);
        assert_eq!(count(0, 1).frames(), 0);
    }
}
