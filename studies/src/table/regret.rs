//! What ratios lose that are not the best, and the one to carry where nobody knows which of several scenes it will be.

use super::file::TableFile;
use crate::reach::Curve;

/// Ratios that differ by no more than this share are the same: files have five digits.
pub(super) const SAME: f64 = 1e-4;
/// Ratios that are tried, at equal factors: 1.5 % apart in the paper's range.
const TRIED: usize = 201;

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

/// A ratio, and the most that it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastRegret {
    /// The ratio.
    pub l2a: f64,
    /// The share of the best ratio's reach that it loses in the scene where it loses most.
    pub most_lost: f64,
}

impl LeastRegret {
    /// The ratio that loses least of the reach in the scene where it loses most (Savage 1951, minimax regret), by tables made by reach for
    /// those scenes. None where one of them has no such entry, or they looked at no common ratio.
    ///
    /// ```
    /// use sim::scene::Scene;
    /// use studies::detectors::DetectorChoice;
    /// use studies::reach::{Demand, ReachSearch};
    /// use studies::table::{Bounds, LeastRegret, ReachSurvey, TableFile};
    /// let survey = ReachSurvey {
    ///     search: ReachSearch { frames: 64, detector: DetectorChoice::KMeans, ..ReachSearch::default() },
    ///     demand: Demand::default(),
    ///     bounds: Bounds::default(),
    ///     illuminance_lx: vec![5000.0],
    ///     interval: vec![0.5],
    /// };
    /// let made = |setting: &str| -> Result<TableFile, Box<dyn std::error::Error>> {
    ///     let scene = Scene::load("night", &[setting.into()])?;
    ///     let mut file = TableFile::of_reach(&survey, &scene);
    ///     let (entry, points) = survey.entry(&scene, 5000.0, 0.5, &[], |_| {})?;
    ///     file.add_reach(entry, points);
    ///     Ok(file)
    /// };
    /// // A camera whose exposure nobody knows to a stop.
    /// let scenes = [made("camera.exposure_bias_ev=0")?, made("camera.exposure_bias_ev=1")?];
    /// let robust = LeastRegret::over(&scenes, 5000.0, 0.5).ok_or("an entry is missing")?;
    /// let usual = scenes[0].reach_entries[0].l2a;
    /// assert!(robust.l2a < usual);
    /// assert!(robust.most_lost < scenes[1].regret(5000.0, 0.5).and_then(|regret| regret.loss(usual)).ok_or("not looked at")?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn over(scenes: &[TableFile], illuminance_lx: f64, interval: f64) -> Option<Self> {
        let regrets = scenes.iter();
        let regrets = regrets.map(|scene| scene.regret(illuminance_lx, interval));
        let regrets: Vec<Regret> = regrets.collect::<Option<_>>()?;
        let ranges = regrets.iter().map(|regret| regret.range);
        let [low, high] =
            ranges.reduce(|one, other| [one[0].max(other[0]), one[1].min(other[1])])?;
        let tried = (0..TRIED).map(|number| {
            let share = number as f64 / (TRIED - 1) as f64;
            low * (high / low).powf(share)
        });
        let candidates = tried.filter_map(|l2a| {
            let losses: Option<Vec<f64>> = regrets.iter().map(|regret| regret.loss(l2a)).collect();
            let most_lost = losses?.into_iter().reduce(f64::max)?;
            Some(Self { l2a, most_lost })
        });
        candidates.min_by(|one, other| one.most_lost.total_cmp(&other.most_lost))
    }
}
