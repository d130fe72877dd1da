//! The best ratio by reach at many lights and intervals.

use serde::{Deserialize, Serialize};
use sim::accuracy::Level;
use sim::scene::Scene;

use super::condition::with_panel;
use super::findings::{outcome, short, short_pair};
use super::intensity::{Bounds, Light, panel_cd};
use super::survey::{EntryAndDetails, Survey, SurveyError, SurveyEvent, check_axes, unless_ended};
use crate::reach::{Choice, Crossing, Demand, Reach, ReachSearch, reach_from};

/// The illuminances and intervals of a search by reach: every combination.
///
/// ```
/// use sim::scene::Scene;
/// use studies::reach::{Demand, ReachSearch};
/// use studies::detectors::DetectorChoice;
/// use studies::table::{Bounds, ReachSurvey, Survey};
/// let search = ReachSearch { frames: 64, detector: DetectorChoice::KMeans, ..ReachSearch::default() };
/// let survey = ReachSurvey {
///     search,
///     demand: Demand::default(),
///     bounds: Bounds::default(),
///     illuminance_lx: vec![50.0, 5000.0],
///     interval: vec![0.5],
/// };
/// let scene = Scene::load("night", &[])?;
/// survey.check(&scene)?;
/// let found = survey.find(&scene, [50.0, 0.5], Vec::new(), |_| {})?;
/// let (entry, points) = found.ok_or("ended early")?;
/// assert!(entry.loses_nothing[0] <= entry.l2a && entry.l2a <= entry.loses_nothing[1]);
/// assert!(points.iter().all(|point| point.reach_m <= 1.01 * entry.best_reach_m));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ReachSurvey {
    /// The search at each; its range is limited to [`ReachSurvey::bounds`].
    pub search: ReachSearch,
    /// The demand on the link, from which [`ReachSearch::raw_error_rate`] follows.
    pub demand: Demand,
    /// The required and the allowed light of the panel.
    pub bounds: Bounds,
    /// Ambient illuminances, lx.
    pub illuminance_lx: Vec<f64>,
    /// Normalised LED intervals.
    pub interval: Vec<f64>,
}

/// The results for one illuminance and interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachEntry {
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
    /// Its reach, m.
    #[serde(serialize_with = "short")]
    pub reach_m: f64,
    /// The best ratio.
    #[serde(serialize_with = "short")]
    pub best_l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub best_l2a_95: [f64; 2],
    /// Whether it is an end of the range, so that the true one may be beyond it.
    pub at_border: bool,
    /// Its reach, m.
    #[serde(serialize_with = "short")]
    pub best_reach_m: f64,
    /// The 95 % interval of that.
    #[serde(serialize_with = "short_pair")]
    pub best_reach_m_95: [f64; 2],
    /// The ratios about the best that lose no more than 1 % of its reach.
    #[serde(serialize_with = "short_pair")]
    pub loses_nothing: [f64; 2],
    /// Whether these span a factor of two and more, so that the ratio hardly matters.
    pub is_flat: bool,
    /// The nearest distance before the reach at which too many bits are wrong, m, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost_at_m: Option<f64>,
    /// The panel's mean luminous intensity straight ahead at [`ReachEntry::l2a`], cd.
    #[serde(serialize_with = "short")]
    pub mean_cd: f64,
    /// Luminous intensity with all LEDs On, cd.
    #[serde(serialize_with = "short")]
    pub peak_cd: f64,
    /// The luminance of an On LED, cd/m².
    #[serde(serialize_with = "short")]
    pub luminance_cd_m2: f64,
    /// Frames at each ratio and distance.
    pub frames: u64,
}

/// The reach at one ratio.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachPoint {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The ratio.
    #[serde(serialize_with = "short")]
    pub l2a: f64,
    /// Its reach, m.
    #[serde(serialize_with = "short")]
    pub reach_m: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub reach_m_95: [f64; 2],
}

/// The settings of a search by reach that made a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReachRecord {
    /// The program's version.
    pub version: String,
    /// The demand on the link.
    pub demand: Demand,
    /// The tolerable share of wrong bits for it.
    pub raw_error_rate: f64,
    /// The required and the allowed light of the panel.
    pub bounds: Bounds,
    /// The choice of the ratio.
    pub choice: Choice,
    /// The seed.
    pub seed: u64,
    /// The most frames at one ratio and distance.
    pub frames: u64,
    /// The tolerance: the share of the ratio for the ± of its 95 % interval.
    pub tolerance: f64,
    /// The range of ratios.
    pub range: [f64; 2],
    /// Whether reflectances were drawn.
    pub random_reflectance: bool,
    /// The detector.
    pub detector: String,
    /// The accuracy of frames.
    pub level: Level,
}

outcome!(
    ReachEntry,
    ReachPoint,
    ReachRecord,
    loses_nothing,
    [
        ["reach_entries", "What the reach says of each"],
        ["reach_points", "The reach at each ratio"],
    ]
);

impl ReachSurvey {
    /// Checks that all settings are valid for `scene`, and that each has ratios within the bounds.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn check(&self, scene: &Scene) -> Result<(), SurveyError> {
        check_axes(&self.illuminance_lx, &self.interval)?;
        for &illuminance_lx in &self.illuminance_lx {
            for &interval in &self.interval {
                with_panel(scene, illuminance_lx, interval).validate()?;
                self.range(scene, illuminance_lx, interval)?;
            }
        }
        Ok(())
    }

    /// The ratios within the bounds.
    fn range(&self, scene: &Scene, illuminance_lx: f64, interval: f64) -> Result<[f64; 2], SurveyError> {
        let [low, high] = self.search.range;
        let Some(panel) = scene.panels.first() else {
            return Ok([low, high]);
        };
        let within = self.bounds.ratios([low, high], panel, illuminance_lx);
        let [least_cd, most_cd] = [low, high].map(|l2a| panel_cd(panel, illuminance_lx, l2a));
        within.ok_or_else(|| SurveyError::Bounds {
            illuminance_lx,
            interval,
            low,
            high,
            wanted: self.bounds.to_string(),
            least_cd,
            most_cd,
        })
    }
}

impl Survey for ReachSurvey {
    type Entry = ReachEntry;
    type Piece = Crossing;

    fn axes(&self) -> [&[f64]; 2] {
        [&self.illuminance_lx, &self.interval]
    }

    fn record(&self) -> ReachRecord {
        let search = &self.search;
        ReachRecord {
            version: env!("CARGO_PKG_VERSION").into(),
            demand: self.demand,
            raw_error_rate: search.raw_error_rate,
            bounds: self.bounds,
            choice: search.choice,
            seed: search.seed,
            frames: search.frames,
            tolerance: search.tolerance,
            range: search.range,
            random_reflectance: search.random_reflectance,
            detector: search.detector.into(),
            level: search.level,
        }
    }

    fn find(
        &self,
        scene: &Scene,
        [illuminance_lx, interval]: [f64; 2],
        known: Vec<Crossing>,
        mut tell: impl FnMut(SurveyEvent<Crossing>) + Send,
    ) -> Result<Option<EntryAndDetails<ReachEntry>>, SurveyError> {
        let search = ReachSearch {
            range: self.range(scene, illuminance_lx, interval)?,
            ..self.search
        };
        let scene = with_panel(scene, illuminance_lx, interval);
        let told = |piece: &Crossing| {
            tell(SurveyEvent::Piece {
                piece,
                work: 1,
                is_known: false,
            });
        };
        let found = reach_from(&scene, &search, &known, told).map_err(|source| SurveyError::Reach {
            illuminance_lx,
            interval,
            source,
        });
        let Some(found) = unless_ended(found)? else {
            return Ok(None);
        };
        tell(SurveyEvent::Setting);
        let points = found.curve.points().map(|(l2a, reach_m, reach_m_95)| ReachPoint {
            illuminance_lx,
            interval,
            l2a,
            reach_m,
            reach_m_95,
        });
        let points = points.collect();
        Ok(Some((entry(&scene, interval, &found), points)))
    }
}

fn entry(scene: &Scene, interval: f64, found: &Reach) -> ReachEntry {
    let Reach { judged, curve, .. } = found;
    let verdict = judged.verdict;
    let light = Light::of(scene, verdict.chosen);
    ReachEntry {
        illuminance_lx: scene.ambient.illuminance_lx,
        interval,
        l2a: verdict.chosen,
        l2a_95: judged.chosen_95,
        reach_m: curve.reach_m(verdict.chosen).unwrap_or(0.0),
        best_l2a: verdict.best,
        best_l2a_95: judged.best_95,
        at_border: found.at_border,
        best_reach_m: verdict.reach_m,
        best_reach_m_95: judged.reach_m_95,
        loses_nothing: verdict.loses_nothing,
        is_flat: verdict.is_flat(),
        lost_at_m: found.lost_at_m,
        mean_cd: light.mean_cd,
        peak_cd: light.peak_cd,
        luminance_cd_m2: light.luminance_cd_m2,
        frames: found.frames,
    }
}
