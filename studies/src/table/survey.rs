//! The best ratio at many settings of a scene.

use super::axes::check_axes;
use super::condition::Condition;
use super::outcome::{Cell, Entry, Rule};
use crate::monte_carlo::Evaluation;
use crate::optimum::{Criterion, Optimum, OptimumError, Piece, Search, least_mean_ber, optimum_from};
use link::l2a_table::TableError;
use serde::{Deserialize, Serialize};
use sim::accuracy::Level;
use sim::scene::{RangeError, Scene};

/// The settings a search is done at: every combination of the values of four scene keys.
///
/// ```
/// use studies::optimum::Search;
/// use sim::scene::Scene;
/// use studies::table::Survey;
/// let search = Search { frames: 64, ..Search::default() };
/// let mut survey = Survey::new(search);
/// (survey.interval, survey.distance_m) = (vec![1.0], vec![50.0, 60.0]);
/// let scene = Scene::load("paper", &[])?;
/// survey.check(&scene)?;
/// let (entry, cells) = survey.entry(&scene, 10_000.0, 1.0)?;
/// assert_eq!(cells.len(), 2);
/// assert!(entry.mean_l2a > 1.5 && entry.mean_l2a < 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// What is searched for at each setting.
    pub search: Search,
    /// How the ratio that a transmitter carries is made.
    pub rule: Rule,
    /// Ambient illuminances, lx.
    pub illuminance_lx: Vec<f64>,
    /// Normalised LED intervals.
    pub interval: Vec<f64>,
    /// Distances, m.
    pub distance_m: Vec<f64>,
    /// Turns about the vertical, degrees. The first is that of the table; the others show what it costs there.
    pub yaw_deg: Vec<f64>,
}

/// The settings of the search that a table came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchRecord {
    /// The program's version.
    pub version: String,
    /// What was maximised.
    pub criterion: Criterion,
    /// How one ratio was made of those of the distances.
    pub rule: Rule,
    /// The seed.
    pub seed: u64,
    /// The most frames at one ratio.
    pub frames: u64,
    /// Half the width of the 95 % interval with which a search ended before that.
    pub tolerance: f64,
    /// The ratios looked among.
    pub range: [f64; 2],
    /// Whether reflectances were drawn.
    pub random_reflectance: bool,
    /// The detector.
    pub detector: String,
    /// How exactly frames were drawn.
    pub level: Level,
    /// The distances, m.
    pub distance_m: Vec<f64>,
    /// The turns about the vertical, degrees; the table is for the first.
    pub yaw_deg: Vec<f64>,
}

impl SearchRecord {
    /// The record of a survey.
    pub fn of(survey: &Survey) -> Self {
        let search = &survey.search;
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            criterion: search.criterion,
            rule: survey.rule,
            seed: search.seed,
            frames: search.frames,
            tolerance: search.tolerance,
            range: search.range,
            random_reflectance: search.random_reflectance,
            detector: search.detector.into(),
            level: search.level,
            distance_m: survey.distance_m.clone(),
            yaw_deg: survey.yaw_deg.clone(),
        }
    }
}

/// What a survey tells while it works.
#[derive(Clone, Copy, Debug)]
pub enum News<'a> {
    /// More frames are done.
    Piece(&'a Piece<'a>),
    /// The best ratio at one setting is known; [`Cell::table_loss`] may not be known yet, and is 1 then.
    Cell(&'a Cell),
}

/// Why a survey cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// There is nothing to try of one key.
    #[error("no {key} to try: give at least one")]
    Empty {
        /// The key.
        key: &'static str,
    },
    /// A value is not allowed.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// The illuminances and intervals are no axes of a table.
    #[error(transparent)]
    Axes(#[from] TableError),
    /// The optimum at one setting cannot be found.
    #[error("at {setting}: {source}")]
    Optimum {
        /// The setting.
        setting: Condition,
        /// Why not.
        source: OptimumError,
    },
    /// The distances have too few ratios in common.
    #[error("the mean bit error rate at {illuminance_lx} lx, interval {interval} has no minimum: give more frames")]
    NoMean {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
    },
}

impl SurveyError {
    /// Whether the caller ended the work.
    pub fn is_interruption(&self) -> bool {
        let Self::Optimum { source, .. } = self else {
            return false;
        };
        matches!(source, OptimumError::Interrupted)
    }
}

impl Survey {
    /// The paper's intervals and distances in the light of the scene `paper`, the panel parallel to the sensor.
    pub fn new(search: Search) -> Self {
        Self {
            search,
            rule: Rule::Mean,
            illuminance_lx: vec![10_000.0],
            interval: vec![0.5, 1.0, 1.5, 2.0],
            distance_m: vec![30.0, 40.0, 50.0, 60.0, 70.0],
            yaw_deg: vec![0.0],
        }
    }

    /// That all settings are valid ones of `scene`.
    ///
    /// # Errors
    /// Names the first value that is not, or the key that has none.
    pub fn check(&self, scene: &Scene) -> Result<(), SurveyError> {
        let keys: [(&str, &[f64]); 4] = [
            ("illuminance", &self.illuminance_lx),
            ("interval", &self.interval),
            ("distance", &self.distance_m),
            ("yaw", &self.yaw_deg),
        ];
        if let Some((key, _)) = keys.iter().find(|(_, values)| values.is_empty()) {
            return Err(SurveyError::Empty { key });
        }
        let most = keys.iter().map(|(_, values)| values.len()).max().unwrap_or(0);
        for k in 0..most {
            let pick = |values: &[f64]| values.get(k).copied().unwrap_or(values[0]);
            let [illuminance_lx, interval, distance_m, yaw_deg] = keys.map(|(_, values)| pick(values));
            let setting = Condition {
                illuminance_lx,
                interval,
                distance_m,
                yaw_deg,
            };
            setting.of(scene).validate()?;
        }
        Ok(check_axes(&self.illuminance_lx, &self.interval)?)
    }

    /// How many settings there are of each illuminance and interval.
    pub fn cells_of_entry(&self) -> usize {
        self.distance_m.len() * self.yaw_deg.len()
    }

    /// Searches all distances and yaws of one illuminance and interval.
    ///
    /// # Errors
    /// When a setting cannot be searched, or [`Search::stop`] ended the work.
    pub fn entry(&self, scene: &Scene, illuminance_lx: f64, interval: f64) -> Result<(Entry, Vec<Cell>), SurveyError> {
        let known = &mut std::iter::empty();
        self.entry_from(scene, illuminance_lx, interval, known, |_| {})
    }

    /// The same, gone on from the pieces of rounds that an earlier run has finished of this entry, in the order in which it was told of
    /// them.
    ///
    /// # Errors
    /// As [`Survey::entry`].
    pub fn entry_from(
        &self,
        scene: &Scene,
        illuminance_lx: f64,
        interval: f64,
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        mut tell: impl FnMut(News),
    ) -> Result<(Entry, Vec<Cell>), SurveyError> {
        let at = |distance_m, yaw_deg| Condition {
            illuminance_lx,
            interval,
            distance_m,
            yaw_deg,
        };
        let mut parallel = Vec::new();
        for &distance_m in &self.distance_m {
            parallel.push(self.best(scene, at(distance_m, self.yaw_deg[0]), None, known, &mut tell)?);
        }
        let entry = self.summary(illuminance_lx, interval, &parallel)?;
        let carried = entry.l2a(self.rule);
        let mut cells: Vec<Cell> = parallel
            .into_iter()
            .map(|(cell, optimum)| cell.with_loss(&optimum, self.search.criterion, carried))
            .collect();
        for &yaw_deg in &self.yaw_deg[1..] {
            for &distance_m in &self.distance_m {
                let (cell, _) = self.best(scene, at(distance_m, yaw_deg), Some(carried), known, &mut tell)?;
                cells.push(cell);
            }
        }
        Ok((entry, cells))
    }

    /// The best ratio at one setting, and what another one costs there.
    fn best(
        &self,
        scene: &Scene,
        setting: Condition,
        carried: Option<f64>,
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        tell: &mut impl FnMut(News),
    ) -> Result<(Cell, Optimum), SurveyError> {
        let fault = |source| SurveyError::Optimum { setting, source };
        let optimum = optimum_from(&setting.of(scene), &self.search, known, |piece| tell(News::Piece(piece))).map_err(fault)?;
        let cell = Cell::of(setting, &optimum);
        let cell = carried.map_or(cell, |carried| cell.with_loss(&optimum, self.search.criterion, carried));
        tell(News::Cell(&cell));
        Ok((cell, optimum))
    }

    /// What the distances together say.
    fn summary(&self, illuminance_lx: f64, interval: f64, parallel: &[(Cell, Optimum)]) -> Result<Entry, SurveyError> {
        let optima: Vec<&Optimum> = parallel.iter().map(|(_, optimum)| optimum).collect();
        let least = least_mean_ber(&optima, &self.search).ok_or(SurveyError::NoMean { illuminance_lx, interval })?;
        let mean = |of: &dyn Fn(&Cell) -> f64| parallel.iter().map(|(cell, _)| of(cell)).sum::<f64>() / parallel.len() as f64;
        let best = parallel.iter().map(|(cell, _)| cell.l2a);
        Ok(Entry {
            illuminance_lx,
            interval,
            mean_l2a: mean(&|cell| cell.l2a),
            mean_l2a_95: [0, 1].map(|end| mean(&|cell| cell.l2a_95[end])),
            range_l2a: [best.clone().fold(f64::INFINITY, f64::min), best.fold(f64::NEG_INFINITY, f64::max)],
            at_border: parallel.iter().any(|(cell, _)| cell.at_border),
            least_ber_l2a: least.l2a,
            least_ber_l2a_95: least.l2a_95,
            least_ber_not_worse: least.not_worse,
            least_ber: least.value,
        })
    }
}
