//! The axes of the figures, and their resolution.

use crate::detectors::{DETECTORS, DetectorChoice};

/// The detector of Do & Yoo 2020.
pub const PAPERS_DETECTOR: &str = "kmeans";
/// Intervals and ratios at which a detector of figure 22 is trained.
const LEARNT_AT: [usize; 2] = [6, 4];
/// The same in a first look, whose time is mostly for maximum likelihood, which follows a panel at each.
const QUICK_LEARNT_AT: [usize; 2] = [4, 2];

/// The amount of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All points of the figures.
    Figures,
    /// A first look: fewer points, and less precise best ratios.
    Quick,
    /// The points that the claims need, coarser.
    Claims,
}

/// The axes of the figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Axes {
    /// L2A of figure 14.
    pub l2a: Vec<f64>,
    /// Intervals of figure 17.
    pub interval: Vec<f64>,
    /// Distances of figure 20, in metres.
    pub distance_m: Vec<f64>,
    /// Intervals of figure 21.
    pub optimum_interval: Vec<f64>,
    /// Distances of figure 21, in metres.
    pub optimum_distance_m: Vec<f64>,
    /// Distances of figure 22, in metres.
    pub error_distance_m: Vec<f64>,
    /// The numbers of intervals and ratios at which a detector is trained.
    pub learnt_at: [usize; 2],
    /// Detectors of figure 22.
    pub detectors: Vec<&'static str>,
}

/// `count` values from `low` to `high`.
fn even(low: f64, high: f64, count: usize) -> Vec<f64> {
    let share = |k| k as f64 / (count - 1) as f64;
    (0..count).map(|k| ((low + (high - low) * share(k)) * 1e6).round() / 1e6).collect()
}

impl Axes {
    /// The axes for that amount of work.
    pub fn of(extent: Extent) -> Self {
        let l2a = even(0.2, 4.0, 20);
        let optimum_interval = even(0.5, 2.0, 4);
        match extent {
            Extent::Figures => Self {
                l2a,
                interval: even(0.5, 2.0, 7),
                distance_m: even(30.0, 70.0, 9),
                optimum_interval,
                optimum_distance_m: even(30.0, 70.0, 5),
                error_distance_m: even(30.0, 70.0, 9),
                learnt_at: LEARNT_AT,
                detectors: detectors().collect(),
            },
            Extent::Quick | Extent::Claims => Self {
                l2a,
                interval: even(0.5, 2.0, 4),
                distance_m: even(30.0, 70.0, 5),
                optimum_interval,
                optimum_distance_m: even(30.0, 70.0, 3),
                error_distance_m: even(30.0, 70.0, 3),
                learnt_at: match extent {
                    Extent::Quick => QUICK_LEARNT_AT,
                    _ => LEARNT_AT,
                },
                detectors: match extent {
                    Extent::Claims => vec![PAPERS_DETECTOR],
                    _ => detectors().collect(),
                },
            },
        }
    }
}

/// All detectors of receivers, once, by name: `best` is one of the others.
fn detectors() -> impl Iterator<Item = &'static str> {
    DETECTORS
        .iter()
        .filter(|(_, choice)| !matches!(choice, DetectorChoice::Best | DetectorChoice::Genie))
        .map(|&(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maximum likelihood learns from 256 frames of each first: 0.35 s of processor time on average.
    #[test]
    fn a_first_look_follows_no_more_panels_than_half_a_minute_allows() {
        let [quick, full] = [Extent::Quick, Extent::Figures].map(Axes::of);
        let panels = 2 * quick.learnt_at.into_iter().product::<usize>() * quick.error_distance_m.len();
        assert!(panels <= 48, "{panels}");
        assert_eq!(quick.detectors, full.detectors);
        assert_eq!((full.learnt_at, Axes::of(Extent::Claims).learnt_at), ([6, 4], [6, 4]));
    }
}
