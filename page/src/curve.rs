//! Distinguishability of On and Off as a function of L2A: a curve that grows on the page.

use link::l2a_table::{L2A_MAX, L2A_MIN};
use serde::Deserialize;
use serde_json::{Value, json};
use sim::accuracy::Level;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::optimum::{Criterion, Search, optimum};

use crate::count::Count;
use crate::fault::Fault;

/// The quantity that is plotted.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Between-class over within-class variance.
    B2w,
    /// The bit error rate.
    Ber,
}

/// Values of L2A with the result for each.
pub struct Curve {
    measure: Measure,
    points: Vec<(f64, Count)>,
}

impl Curve {
    /// `points` values of L2A, evenly spaced by their logarithm, over a transmitter's range. Reflectances are drawn at random, as in the
    /// paper's Figure 14.
    pub fn new(scene: &Scene, measure: Measure, detector: DetectorChoice, level: Level, seed: u64, points: usize) -> Result<Self, Fault> {
        if !(3..=100).contains(&points) {
            return Err(Fault::Range {
                what: "the number of ratios",
                value: points as f64,
                allowed: "give 3 to 100",
            });
        }
        let [low, high] = [L2A_MIN, L2A_MAX].map(f64::from);
        let at = |point: usize| {
            let l2a = low * (high / low).powf(point as f64 / (points - 1) as f64);
            let scene = scene.with("the page", &[format!("link.l2a={l2a}")])?;
            Ok((l2a, Count::new(&scene, detector, level, seed, true)?))
        };
        Ok(Self {
            measure,
            points: (0..points).map(at).collect::<Result<_, Fault>>()?,
        })
    }

    /// Adds frames to each point.
    pub fn add(&mut self, frames: u64) -> Result<(), Fault> {
        self.points.iter_mut().try_for_each(|(_, count)| count.add(frames))
    }

    /// The curve for the page.
    pub fn as_json(&self) -> Value {
        let values: Vec<_> = self.points.iter().map(|(l2a, count)| (*l2a, self.value(count))).collect();
        let better = |a: f64, b: f64| match self.measure {
            Measure::B2w => a > b,
            Measure::Ber => a < b,
        };
        let known = values.iter().filter_map(|&(l2a, value)| Some((l2a, value?[0])));
        let best = known.reduce(|best, next| if better(next.1, best.1) { next } else { best });
        let points = values.iter().map(|(l2a, value)| {
            let [value, low, high] = value.map_or([None; 3], |value| value.map(Some));
            json!({ "l2a": l2a, "value": value, "low": low, "high": high })
        });
        json!({
            "frames": self.points[0].1.sum().errors.frames(), "points": points.collect::<Vec<_>>(),
            "best": best.map(|(l2a, value)| json!({ "l2a": l2a, "value": value })),
        })
    }

    /// The value and its 95 % interval; for a ratio of variances, the interval is unknown.
    fn value(&self, count: &Count) -> Option<[f64; 3]> {
        let sum = count.sum();
        match self.measure {
            Measure::B2w => sum.distinguishability().b2w.map(|b2w| [b2w; 3]),
            Measure::Ber => {
                let [low, high] = sum.errors.interval_95();
                Some([sum.errors.rate(), low, high])
            }
        }
    }
}

/// The best L2A, as `vocc optimize` finds it.
pub fn best(scene: &Scene, detector: DetectorChoice, measure: Measure, frames: u64, seed: u64) -> Result<Value, Fault> {
    let search = Search {
        criterion: match measure {
            Measure::B2w => Criterion::B2w,
            Measure::Ber => Criterion::Ber,
        },
        frames,
        seed,
        detector,
        ..Search::default()
    };
    let best = optimum(scene, &search)?;
    Ok(json!({ "l2a": best.l2a, "l2a_95": best.l2a_95, "at_border": best.at_border, "frames": frames }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_of_the_curve_is_about_where_the_search_finds_it() {
        let far = [
            "pose.distance_m=50",
            "panel.interval=0.5",
            "ambient.illuminance_lx=1000",
            "effects.noise=on",
        ];
        let scene = Scene::load("paper", &far.map(String::from)).unwrap();
        let mut curve = Curve::new(&scene, Measure::B2w, DetectorChoice::KMeans, Level::Fast, 1, 9).unwrap();
        curve.add(256).unwrap();
        let on_the_curve = curve.as_json()["best"]["l2a"].as_f64().unwrap();
        let found = best(&scene, DetectorChoice::KMeans, Measure::B2w, 512, 1).unwrap();
        let found = found["l2a"].as_f64().unwrap();
        assert!((on_the_curve / found).ln().abs() < 0.6, "{on_the_curve} {found}");
        assert!(Curve::new(&scene, Measure::Ber, DetectorChoice::KMeans, Level::Fast, 1, 2).is_err());
    }
}
