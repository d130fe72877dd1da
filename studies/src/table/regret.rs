//! The loss of ratios other than the best.

use rand::Rng;
use serde::{Deserialize, Serialize};
use sim::random::normal;

use super::by_reach::ReachPoint;
use super::findings::{SAME, outcome, short, short_list, short_pair};
use crate::reach::{Choice, Curve};

/// Half a 95 % interval, in standard deviations.
const HALF_OF_95: f64 = 1.96;

/// The loss of ratios other than the best at one illuminance and interval. No reach counts beyond the distance at which a panel is found: a
/// ratio that is readable farther has no benefit.
#[derive(Clone, Debug, PartialEq)]
pub struct Regret {
    curve: Curve,
    /// The range of ratios.
    pub(super) range: [f64; 2],
    /// The reach of the best one, m.
    best_m: f64,
    /// The greatest distance at which the panel is found, m.
    found_m: f64,
}

impl Regret {
    /// The loss by a curve of reach over ratio in a range, the best ratio's reach, and the greatest distance at which the panel is found, m.
    pub(super) fn new(curve: Curve, range: [f64; 2], best_m: f64, found_m: f64) -> Self {
        Self {
            curve,
            range,
            best_m: best_m.min(found_m),
            found_m,
        }
    }

    /// A random resample of one through these points, whose logarithms get independent normal errors. `None` for fewer than three points.
    pub(super) fn resampled<'a>(&self, points: impl Iterator<Item = &'a ReachPoint>, random: &mut impl Rng) -> Option<Self> {
        let mut drawn = |point: &ReachPoint| {
            let [low, high] = point.reach_m_95;
            let deviation = (high / low).ln() / (2.0 * HALF_OF_95);
            (point.l2a, point.reach_m * (deviation * normal(random)).exp())
        };
        let curve = Curve::through(points.map(&mut drawn));
        let best_m = curve.judged(Choice::Best)?.verdict.reach_m;
        Some(Self::new(curve, self.range, best_m, self.found_m))
    }

    /// The best ratio's reach, m.
    pub fn best_m(&self) -> f64 {
        self.best_m
    }

    /// The reach of a ratio, m, within the range.
    pub fn reach_m(&self, l2a: f64) -> Option<f64> {
        let [low, high] = self.range;
        let is_within = (low * (1.0 - SAME)..=high * (1.0 + SAME)).contains(&l2a);
        let reach_m = self.curve.reach_m(l2a).filter(|_| is_within)?;
        Some(reach_m.min(self.found_m))
    }

    /// The loss of a ratio, as a share of the best ratio's reach, within the range; below 0 by chance.
    pub fn loss(&self, l2a: f64) -> Option<f64> {
        Some(1.0 - self.reach_m(l2a)? / self.best_m)
    }
}

/// The tables behind a table of least regret.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegretRecord {
    /// The program's version.
    pub version: String,
    /// Their files, as given.
    pub tables: Vec<String>,
    /// The common range of ratios.
    pub range: [f64; 2],
}

/// The results for one illuminance and interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegretEntry {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The transmitter's ratio.
    #[serde(serialize_with = "short")]
    pub l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub l2a_95: [f64; 2],
    /// The share of the best ratio's reach that it loses in the worst scene.
    #[serde(serialize_with = "short")]
    pub most_lost: f64,
    /// The ratios about it that lose at most 1 % more than the minimum.
    #[serde(serialize_with = "short_pair")]
    pub no_worse: [f64; 2],
    /// Whether these span a factor of two and more, so that the ratio hardly matters.
    pub is_flat: bool,
    /// Its reach in the scene of each table, m.
    #[serde(serialize_with = "short_list")]
    pub reach_m: Vec<f64>,
    /// The panel's mean luminous intensity straight ahead, cd.
    #[serde(serialize_with = "short")]
    pub mean_cd: f64,
    /// Luminous intensity with all LEDs On, cd.
    #[serde(serialize_with = "short")]
    pub peak_cd: f64,
    /// The luminance of an On LED, cd/m².
    #[serde(serialize_with = "short")]
    pub luminance_cd_m2: f64,
}

/// The loss of one ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegretPoint {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The ratio.
    #[serde(serialize_with = "short")]
    pub l2a: f64,
    /// The share of the best ratio's reach that it loses in the worst scene.
    #[serde(serialize_with = "short")]
    pub most_lost: f64,
}

outcome!(
    RegretEntry,
    RegretPoint,
    RegretRecord,
    no_worse,
    [
        ["regret_entries", "What the scenes together say of each"],
        ["regret_points", "What each ratio loses of the best one's reach, where most is lost"],
    ]
);
