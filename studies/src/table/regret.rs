//! What ratios lose that are not the best.

use rand::Rng;
use sim::random::normal;

use super::by_reach::ReachPoint;
use crate::reach::{Choice, Curve};

/// Ratios that differ by no more than this share are the same: files have five digits.
pub(super) const SAME: f64 = 1e-4;
/// Half a 95 % interval is so many standard deviations.
const HALF_OF_95: f64 = 1.96;

/// What other ratios than the best lose at one illuminance and interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Regret {
    pub(super) curve: Curve,
    /// The ratios looked among.
    pub(super) range: [f64; 2],
    /// The reach of the best one, m.
    pub(super) best_m: f64,
}

impl Regret {
    /// As it might have come out as well, by points whose logarithms err as normal numbers do, each by itself. None of fewer than three.
    pub(super) fn resampled<'a>(points: impl Iterator<Item = &'a ReachPoint>, range: [f64; 2], random: &mut impl Rng) -> Option<Self> {
        let mut drawn = |point: &ReachPoint| {
            let [low, high] = point.reach_m_95;
            let deviation = (high / low).ln() / (2.0 * HALF_OF_95);
            (point.l2a, point.reach_m * (deviation * normal(random)).exp())
        };
        let curve = Curve::through(points.map(&mut drawn));
        let best_m = curve.judged(Choice::Best)?.verdict.reach_m;
        Some(Self { curve, range, best_m })
    }

    /// The reach of a ratio, m, where it was looked at.
    pub fn reach_m(&self, l2a: f64) -> Option<f64> {
        let [low, high] = self.range;
        let is_within = (low * (1.0 - SAME)..=high * (1.0 + SAME)).contains(&l2a);
        self.curve.reach_m(l2a).filter(|_| is_within)
    }

    /// The share of the best ratio's reach that another one loses, where it was looked at; below 0 by chance.
    pub fn loss(&self, l2a: f64) -> Option<f64> {
        Some(1.0 - self.reach_m(l2a)? / self.best_m)
    }
}
