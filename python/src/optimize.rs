//! The optimum L2A, and the table that a transmitter carries.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use studies::detectors::DetectorChoice;
use studies::optimum::{Criterion, RANGE, Search};
use studies::table::{Cell, CriterionSurvey, Entry, Rule, SurveyEvent, TableFile};

use crate::errors::{check, refused};
use crate::evaluate::single_precision;
use crate::record::record;
use crate::scene::scene_of;
use crate::table::Table;
use crate::work::Work;

record! {
    /// The optimum L2A at one setting: the keys of `vocc optimize --json`.
    Optimum {
        /// Ambient illuminance, in lux.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// Distance, in metres.
        distance_m: f64,
        /// Rotation about the vertical, in degrees.
        yaw_deg: f64,
        /// The optimum, in 1/sr.
        l2a: f64,
        /// Its 95 % interval.
        l2a_95: (f64, f64),
        /// Whether it is at the end of the range: the true optimum may lie beyond.
        at_border: bool,
        /// The range of L2A that is not significantly worse.
        not_worse: (f64, f64),
        /// B2W near the optimum, if it is defined.
        b2w: Option<f64>,
        /// Fisher's criterion near the optimum, if it is defined.
        fisher: Option<f64>,
        /// Bit error rate near the optimum.
        ber: f64,
        /// Its 95 % interval.
        ber_95: (f64, f64),
        /// Number of frames for these values.
        frames: u64,
        /// The factor by which the criterion is worse at the L2A of the table.
        table_loss: f64,
    }
}

record! {
    /// The result of all distances for an illuminance and an interval.
    TableEntry {
        /// Ambient illuminance, in lux.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
        /// The mean of the optima over the distances.
        mean_l2a: f64,
        /// Its 95 % interval.
        mean_l2a_95: (f64, f64),
        /// The minimum and the maximum of the optima.
        range_l2a: (f64, f64),
        /// Whether one of them is at the end of the range.
        at_border: bool,
        /// The L2A with the least mean bit error rate.
        least_ber_l2a: f64,
        /// Its 95 % interval.
        least_ber_l2a_95: (f64, f64),
        /// The range of L2A whose mean bit error rate is not significantly higher.
        least_ber_not_worse: (f64, f64),
        /// The least mean bit error rate according to the fit.
        least_ber: f64,
    }
}

/// The result of a search for optima.
#[pyclass(frozen, module = "vocc")]
pub struct Optimization {
    /// The optimum at each setting.
    #[pyo3(get)]
    optima: Vec<Py<Optimum>>,
    /// The result of all distances for each illuminance and interval.
    #[pyo3(get)]
    entries: Vec<Py<TableEntry>>,
    file: TableFile,
}

#[pymethods]
impl Optimization {
    /// The table of the result, as a transmitter carries it.
    ///
    /// Raises VoccError if a transmitter cannot use it, for example because of an L2A outside 0.2 to 4.
    #[getter]
    fn table(&self) -> PyResult<Table> {
        Table::of(self.file.clone())
    }

    /// The table's file as TOML: `vocc table` accepts it, and `vocc optimize` writes the same.
    fn to_toml(&self) -> PyResult<String> {
        check(self.file.to_toml())
    }

    /// The optima and entries as lists of dicts: `pandas.DataFrame(found.to_dict()["optima"])`.
    fn to_dict<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        crate::record::to_dict(slf.as_any(), &["optima", "entries"])
    }

    fn __repr__(&self) -> String {
        format!("Optimization({} optima, {} entries)", self.optima.len(), self.entries.len())
    }
}

/// Searches the optimum LED-to-ambient ratio (L2A) at each setting, with its uncertainty, bit for bit as `vocc optimize` does.
///
/// A setting is an illuminance (by default the scene's), an interval, a distance and a yaw. `criterion` is maximised: b2w, fisher or ber
/// (the least bit error rate). `rule` computes the table's L2A from those of the distances: mean or least-ber. A search ends when the 95 %
/// interval is no wider than +-`tolerance`, or with `frames` at one L2A. `range` is the range that is searched. `detector`, `level`,
/// `seed`, `threads` and `progress` are as for evaluate; `random_reflectance` draws each frame's reflectance from 0.3 to 0.5. Ctrl-C ends
/// the search.
///
/// Raises VoccError if a setting is impossible, or if its optimum is not defined.
///
/// >>> import vocc
/// >>> found = vocc.optimize("paper", intervals=[1], distances=[50], frames=2048, tolerance=0.05)
/// >>> best = found.optima[0]
/// >>> best.l2a_95[0] <= best.l2a <= best.l2a_95[1]
/// True
#[pyfunction]
#[pyo3(signature = (
    scene=None, *, intervals=None, distances=None, illuminances=None, yaws=None, criterion="b2w", rule="mean", frames=100_000,
    tolerance=0.01, range=None, random_reflectance=true, detector="kmeans", level="fast", seed=1, threads=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn optimize<'py>(
    py: Python<'py>,
    scene: Option<&Bound<'py, PyAny>>,
    intervals: Option<Vec<f64>>,
    distances: Option<Vec<f64>>,
    illuminances: Option<Vec<f64>>,
    yaws: Option<Vec<f64>>,
    criterion: &str,
    rule: &str,
    frames: u64,
    tolerance: f64,
    range: Option<(f64, f64)>,
    random_reflectance: bool,
    detector: &str,
    level: &str,
    seed: u64,
    threads: Option<usize>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Optimization> {
    let scene = scene_of(scene)?;
    let criterion: Criterion = check(criterion.parse())?;
    let detector: DetectorChoice = check(detector.parse())?;
    let rule = rule_of(rule)?;
    let usual = CriterionSurvey::new(Search::default());
    let search = Search {
        criterion,
        range: range.map_or(RANGE, |(low, high)| [low, high]),
        frames,
        tolerance,
        seed,
        random_reflectance,
        detector,
        level: single_precision(level)?,
        ..Search::default()
    };
    let mut survey = CriterionSurvey {
        search,
        rule,
        illuminance_lx: illuminances.unwrap_or(vec![scene.ambient.illuminance_lx]),
        interval: intervals.unwrap_or(usual.interval),
        distance_m: distances.unwrap_or(usual.distance_m),
        yaw_deg: yaws.unwrap_or(usual.yaw_deg),
    };
    check(survey.check(&scene))?;
    let file = Work::on(threads)?.run(py, progress, |mut control| {
        survey.search.stop = control.stop;
        let mut done = 0;
        TableFile::searched(&survey, &scene, |news| {
            if let SurveyEvent::Piece { work, .. } = news {
                done += work;
                control.done(done);
            }
        })
    })?;
    let optima = file.search.details.iter().map(|cell| Py::new(py, Optimum::of(cell)));
    let entries = file.search.entries.iter();
    let entries = entries.map(|entry| Py::new(py, TableEntry::of(entry)));
    Ok(Optimization {
        optima: optima.collect::<PyResult<_>>()?,
        entries: entries.collect::<PyResult<_>>()?,
        file,
    })
}

fn rule_of(name: &str) -> PyResult<Rule> {
    match name {
        "mean" => Ok(Rule::Mean),
        "least-ber" => Ok(Rule::LeastBer),
        _ => Err(refused(format!("no rule {name:?}: choose mean or least-ber"))),
    }
}

impl Optimum {
    fn of(cell: &Cell) -> Self {
        Self {
            illuminance_lx: cell.illuminance_lx,
            interval: cell.interval,
            distance_m: cell.distance_m,
            yaw_deg: cell.yaw_deg,
            l2a: cell.l2a,
            l2a_95: cell.l2a_95.into(),
            at_border: cell.at_border,
            not_worse: cell.not_worse.into(),
            b2w: cell.b2w,
            fisher: cell.fisher,
            ber: cell.ber,
            ber_95: cell.ber_95.into(),
            frames: cell.frames,
            table_loss: cell.table_loss,
        }
    }
}

impl TableEntry {
    fn of(entry: &Entry) -> Self {
        Self {
            illuminance_lx: entry.illuminance_lx,
            interval: entry.interval,
            mean_l2a: entry.mean_l2a,
            mean_l2a_95: entry.mean_l2a_95.into(),
            range_l2a: entry.range_l2a.into(),
            at_border: entry.at_border,
            least_ber_l2a: entry.least_ber_l2a,
            least_ber_l2a_95: entry.least_ber_l2a_95.into(),
            least_ber_not_worse: entry.least_ber_not_worse.into(),
            least_ber: entry.least_ber,
        }
    }
}
