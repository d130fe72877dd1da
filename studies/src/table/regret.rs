//! The ratio to carry where nobody knows which of several scenes it will be.

use super::file::TableFile;

/// Ratios that are tried, at equal factors: 1.5 % apart in the paper's range.
const TRIED: usize = 201;

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
    /// assert!(robust.most_lost < scenes[1].loss(5000.0, 0.5, usual).ok_or("not looked at")?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn over(scenes: &[TableFile], illuminance_lx: f64, interval: f64) -> Option<Self> {
        let ranges = scenes
            .iter()
            .filter_map(|scene| Some(scene.reach.as_ref()?.range));
        let [low, high] = ranges.reduce(|[low, high], [other_low, other_high]| {
            [low.max(other_low), high.min(other_high)]
        })?;
        let tried = (0..TRIED).map(|number| {
            let share = number as f64 / (TRIED - 1) as f64;
            low * (high / low).powf(share)
        });
        let candidates = tried.filter_map(|l2a| {
            let losses = scenes
                .iter()
                .map(|scene| scene.loss(illuminance_lx, interval, l2a));
            let most_lost = losses
                .collect::<Option<Vec<f64>>>()?
                .into_iter()
                .reduce(f64::max)?;
            Some(Self { l2a, most_lost })
        });
        candidates.min_by(|one, other| one.most_lost.total_cmp(&other.most_lost))
    }
}
