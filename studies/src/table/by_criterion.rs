//! The best ratio at each distance by variances or bit errors, and the transmitter's ratio.

use serde::{Deserialize, Serialize};
use sim::accuracy::Level;
use sim::scene::Scene;

use super::condition::Condition;
use super::findings::{Outcome, at_place, short, short_if_any, short_pair, short_pair_if_any};
use super::survey::{EntryAndDetails, Survey, SurveyError, SurveyEvent, check_axes, unless_ended};
use crate::monte_carlo::Evaluation;
use crate::optimum::{Criterion, Optimum, Piece, Search, least_mean_ber, optimum_from};

/// The rule for one ratio from the best ones of all distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Their mean (Do & Yoo 2020, section 4.4.3).
    #[default]
    Mean,
    /// The ratio of the least bit error rate of all distances' frames together.
    LeastBer,
}

/// The best ratio at one setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// Distance, m.
    pub distance_m: f64,
    /// Turn about the vertical, degrees.
    pub yaw_deg: f64,
    /// The best ratio.
    #[serde(serialize_with = "short")]
    pub l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub l2a_95: [f64; 2],
    /// Whether it is the end of the range.
    pub at_border: bool,
    /// The ratios that are not significantly worse: the plateau about the best.
    #[serde(serialize_with = "short_pair")]
    pub not_worse: [f64; 2],
    /// The factors by which the criterion (for the bit error rate: its odds) is worse at the two ends of that range than at the best ratio.
    #[serde(default, serialize_with = "short_pair_if_any", skip_serializing_if = "Option::is_none")]
    pub not_worse_loss: Option<[f64; 2]>,
    /// B2W next to the best ratio, if defined.
    #[serde(default, serialize_with = "short_if_any", skip_serializing_if = "Option::is_none")]
    pub b2w: Option<f64>,
    /// Fisher's criterion there, if defined.
    #[serde(default, serialize_with = "short_if_any", skip_serializing_if = "Option::is_none")]
    pub fisher: Option<f64>,
    /// Bit error rate there, of all frames.
    #[serde(serialize_with = "short")]
    pub ber: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub ber_95: [f64; 2],
    /// The same for the frames that show one symbol, which the criterion `ber` uses; `None` if all do.
    #[serde(default, serialize_with = "short_if_any", skip_serializing_if = "Option::is_none")]
    pub ber_one_symbol: Option<f64>,
    /// The number of frames behind these.
    pub frames: u64,
    /// The factor by which the criterion (for the bit error rate: its odds) is worse at the table's ratio than at the best ratio.
    #[serde(serialize_with = "short")]
    pub table_loss: f64,
}

/// The results of all distances for one illuminance and interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The mean of the best ratios over the distances.
    #[serde(serialize_with = "short")]
    pub mean_l2a: f64,
    /// Its 95 % interval: the mean of theirs. All distances have the same frames, so that their errors need not cancel.
    #[serde(serialize_with = "short_pair")]
    pub mean_l2a_95: [f64; 2],
    /// The least and the greatest of the best ratios.
    #[serde(serialize_with = "short_pair")]
    pub range_l2a: [f64; 2],
    /// Whether one of them is the end of the range, so that the mean may be too low (or too high).
    pub at_border: bool,
    /// The ratio of the least mean bit error rate.
    #[serde(serialize_with = "short")]
    pub least_ber_l2a: f64,
    /// Its 95 % interval.
    #[serde(serialize_with = "short_pair")]
    pub least_ber_l2a_95: [f64; 2],
    /// The ratios whose mean bit error rate is not significantly higher.
    #[serde(serialize_with = "short_pair")]
    pub least_ber_not_worse: [f64; 2],
    /// The least mean bit error rate, by the fit.
    #[serde(serialize_with = "short")]
    pub least_ber: f64,
}

impl Entry {
    /// The transmitter's ratio by a rule.
    pub fn l2a(&self, rule: Rule) -> f64 {
        match rule {
            Rule::Mean => self.mean_l2a,
            Rule::LeastBer => self.least_ber_l2a,
        }
    }
}

at_place!(Entry, Cell);

impl Outcome for Entry {
    type Record = SearchRecord;
    type Detail = Cell;
    const KEYS: [[&str; 2]; 2] = [
        ["entries", "What the distances together say of each"],
        ["cells", "What was found at each setting"],
    ];

    fn carried(&self, record: &SearchRecord) -> f64 {
        self.l2a(record.rule)
    }

    fn carried_95(&self, record: &SearchRecord) -> [f64; 2] {
        match record.rule {
            Rule::Mean => self.mean_l2a_95,
            Rule::LeastBer => self.least_ber_l2a_95,
        }
    }

    fn undecided(&self, record: &SearchRecord) -> [f64; 2] {
        self.carried_95(record)
    }

    fn range(record: &SearchRecord) -> [f64; 2] {
        record.range
    }
}

impl Cell {
    pub(super) fn of(setting: Condition, optimum: &Optimum, criterion: Criterion) -> Self {
        let ends = optimum.not_worse.map(|l2a| optimum.loss_at(criterion, l2a));
        let one_symbol = optimum.evaluation.of_one_symbol();
        let variances = optimum.evaluation.distinguishability();
        Self {
            illuminance_lx: setting.illuminance_lx,
            interval: setting.interval,
            distance_m: setting.distance_m,
            yaw_deg: setting.yaw_deg,
            l2a: optimum.l2a,
            l2a_95: optimum.l2a_95,
            at_border: optimum.at_border,
            not_worse: optimum.not_worse,
            not_worse_loss: ends[0].zip(ends[1]).map(<[f64; 2]>::from),
            b2w: variances.b2w,
            fisher: variances.fisher,
            ber: optimum.evaluation.errors.rate(),
            ber_95: optimum.evaluation.errors.interval_95(),
            ber_one_symbol: (one_symbol != optimum.evaluation.errors).then(|| one_symbol.rate()),
            frames: optimum.frames,
            table_loss: 1.0,
        }
    }

    pub(super) fn with_loss(self, optimum: &Optimum, criterion: Criterion, carried: f64) -> Self {
        Self {
            table_loss: optimum.loss_at(criterion, carried).unwrap_or(1.0),
            ..self
        }
    }
}

/// The settings of a search: every combination of the values of four scene keys.
///
/// ```
/// use studies::optimum::Search;
/// use sim::scene::Scene;
/// use studies::table::{CriterionSurvey, Survey};
/// let search = Search { frames: 64, ..Search::default() };
/// let mut survey = CriterionSurvey::new(search);
/// (survey.interval, survey.distance_m) = (vec![1.0], vec![50.0, 60.0]);
/// let scene = Scene::load("paper", &[])?;
/// survey.check(&scene)?;
/// let found = survey.find(&scene, [10_000.0, 1.0], Vec::new(), |_| {})?;
/// let (entry, cells) = found.ok_or("ended early")?;
/// assert_eq!(cells.len(), 2);
/// assert!(entry.mean_l2a > 1.5 && entry.mean_l2a < 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CriterionSurvey {
    /// The search at each setting.
    pub search: Search,
    /// The rule for the transmitter's ratio.
    pub rule: Rule,
    /// Ambient illuminances, lx.
    pub illuminance_lx: Vec<f64>,
    /// Normalised LED intervals.
    pub interval: Vec<f64>,
    /// Distances, m.
    pub distance_m: Vec<f64>,
    /// Rotations about the vertical, degrees. The first is that of the table; the others show the loss there.
    pub yaw_deg: Vec<f64>,
}

/// The settings of the search that made a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchRecord {
    /// The program's version.
    pub version: String,
    /// The criterion.
    pub criterion: Criterion,
    /// The rule for one ratio from those of the distances.
    pub rule: Rule,
    /// The seed.
    pub seed: u64,
    /// The most frames at one ratio.
    pub frames: u64,
    /// Half the width of the 95 % interval at which a search ended early.
    pub tolerance: f64,
    /// The range of ratios.
    pub range: [f64; 2],
    /// Whether reflectances were drawn.
    pub random_reflectance: bool,
    /// The detector.
    pub detector: String,
    /// The accuracy of frames.
    pub level: Level,
    /// The distances, m.
    pub distance_m: Vec<f64>,
    /// The rotations about the vertical, degrees; the table is for the first.
    pub yaw_deg: Vec<f64>,
}

impl CriterionSurvey {
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

    /// Checks that all settings are valid for `scene`.
    ///
    /// # Errors
    /// The first invalid value, or the key without values.
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

    /// The number of settings of each illuminance and interval.
    pub fn settings_of_place(&self) -> usize {
        self.distance_m.len() * self.yaw_deg.len()
    }

    /// All distances and yaws of a place.
    fn search_place(
        &self,
        scene: &Scene,
        [illuminance_lx, interval]: [f64; 2],
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        tell: &mut impl FnMut(SurveyEvent<Vec<Evaluation>>),
    ) -> Result<EntryAndDetails<Entry>, SurveyError> {
        let at = |distance_m, yaw_deg| Condition {
            illuminance_lx,
            interval,
            distance_m,
            yaw_deg,
        };
        let mut parallel = Vec::new();
        for &distance_m in &self.distance_m {
            parallel.push(self.best(scene, at(distance_m, self.yaw_deg[0]), None, known, tell)?);
        }
        let entry = self.summary(illuminance_lx, interval, &parallel)?;
        let carried = entry.l2a(self.rule);
        let mut cells: Vec<Cell> = parallel
            .into_iter()
            .map(|(cell, optimum)| cell.with_loss(&optimum, self.search.criterion, carried))
            .collect();
        for &yaw_deg in &self.yaw_deg[1..] {
            for &distance_m in &self.distance_m {
                let (cell, _) = self.best(scene, at(distance_m, yaw_deg), Some(carried), known, tell)?;
                cells.push(cell);
            }
        }
        Ok((entry, cells))
    }

    /// The best ratio at one setting, and the loss of another one there.
    fn best(
        &self,
        scene: &Scene,
        setting: Condition,
        carried: Option<f64>,
        known: &mut dyn Iterator<Item = Vec<Evaluation>>,
        tell: &mut impl FnMut(SurveyEvent<Vec<Evaluation>>),
    ) -> Result<(Cell, Optimum), SurveyError> {
        let fault = |source| SurveyError::Optimum { setting, source };
        let told = |piece: &Piece| {
            tell(SurveyEvent::Piece {
                piece: piece.batches,
                work: piece.frames(),
                is_known: piece.is_known,
            });
        };
        let optimum = optimum_from(&setting.of(scene), &self.search, known, told).map_err(fault)?;
        let cell = Cell::of(setting, &optimum, self.search.criterion);
        let cell = carried.map_or(cell, |carried| cell.with_loss(&optimum, self.search.criterion, carried));
        tell(SurveyEvent::Setting);
        Ok((cell, optimum))
    }

    /// The results of all distances together.
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

impl Survey for CriterionSurvey {
    type Entry = Entry;
    type Piece = Vec<Evaluation>;

    fn axes(&self) -> [&[f64]; 2] {
        [&self.illuminance_lx, &self.interval]
    }

    fn record(&self) -> SearchRecord {
        let search = &self.search;
        SearchRecord {
            version: env!("CARGO_PKG_VERSION").into(),
            criterion: search.criterion,
            rule: self.rule,
            seed: search.seed,
            frames: search.frames,
            tolerance: search.tolerance,
            range: search.range,
            random_reflectance: search.random_reflectance,
            detector: search.detector.into(),
            level: search.level,
            distance_m: self.distance_m.clone(),
            yaw_deg: self.yaw_deg.clone(),
        }
    }

    fn find(
        &self,
        scene: &Scene,
        place: [f64; 2],
        known: Vec<Vec<Evaluation>>,
        mut tell: impl FnMut(SurveyEvent<Vec<Evaluation>>) + Send,
    ) -> Result<Option<EntryAndDetails<Entry>>, SurveyError> {
        unless_ended(self.search_place(scene, place, &mut known.into_iter(), &mut tell))
    }
}
