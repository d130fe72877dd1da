//! The transmitter's table for an unknown one of several scenes.

use crate::parallel::map;
use link::waveform::Waveform;
use sim::l2a::file::RatioFile;
use sim::random::{Purpose, stream};

use super::condition::with_panel;
use super::file::TableFile;
use super::intensity::Light;
use super::regret::{Regret, RegretEntry, RegretPoint, RegretRecord};
use super::survey::EntryAndDetails;
use crate::optimum::{RESAMPLES, percentiles};
use crate::reach::{FLAT, NOTHING};

/// Tried ratios, at equal factors: 0.75 % apart in the paper's range.
const TRIED: usize = 401;
const IN_FILE: usize = 20;

/// A ratio, and its greatest loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastRegret {
    /// The ratio.
    pub l2a: f64,
    /// The share of the best ratio's reach that it loses in the worst scene.
    pub most_lost: f64,
    /// The ratios about it that lose at most 1 % more than the minimum.
    pub no_worse: [f64; 2],
}

impl LeastRegret {
    /// The ratio of the least loss of reach in its worst scene (Savage 1951, minimax regret), from tables by reach for those scenes: the
    /// middle one, by factors, of those that lose no more than 1 % more. `None` if one of the tables has no such entry, or they have no
    /// common ratio.
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
    ///     Ok(TableFile::searched(&survey, &scene, |_| {})?)
    /// };
    /// // A camera whose exposure is not known to a stop.
    /// let scenes = [made("camera.exposure_bias_ev=0")?, made("camera.exposure_bias_ev=1")?];
    /// let robust = LeastRegret::over(&scenes, [5000.0, 0.5]).ok_or("an entry is missing")?;
    /// let usual = scenes[0].reach.entries[0].l2a;
    /// assert!(robust.l2a < usual);
    /// assert!(robust.most_lost < scenes[1].regret_at([5000.0, 0.5]).and_then(|regret| regret.loss(usual)).ok_or("not looked at")?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn over(scenes: &[TableFile], place: [f64; 2]) -> Option<Self> {
        Self::of(&regrets_at(scenes, place)?)
    }

    fn of(regrets: &[Regret]) -> Option<Self> {
        let tried = tried(regrets)?;
        let by_loss = |a: &usize, b: &usize| tried[*a].1.total_cmp(&tried[*b].1);
        let least = (0..tried.len()).min_by(by_loss)?;
        let is_no_worse = |place: &usize| tried[*place].1 <= tried[least].1 + NOTHING;
        let low = (0..least).rev().take_while(is_no_worse).last();
        let high = (least..tried.len()).take_while(is_no_worse).last();
        let no_worse = [low.unwrap_or(least), high?].map(|place| tried[place].0);
        let l2a = (no_worse[0] * no_worse[1]).sqrt();
        Some(Self {
            l2a,
            most_lost: most_lost(regrets, l2a)?,
            no_worse,
        })
    }

    /// The 95 % interval of its ratio, from the uncertainty of the reach at each ratio. Errors of neighbours count as independent, while
    /// common random numbers make them smaller: the interval is therefore too wide, if anything.
    fn l2a_95(scenes: &[TableFile], place: [f64; 2]) -> Option<[f64; 2]> {
        let regrets = regrets_at(scenes, place)?;
        let as_well = map(0..RESAMPLES, |number| {
            let random = &mut stream(0, number, Purpose::Resampling);
            let scenes = scenes.iter().zip(&regrets);
            let drawn = scenes.map(|(scene, regret)| regret.resampled(scene.reach.details_at(place), random));
            Some(Self::of(&drawn.collect::<Option<Vec<_>>>()?)?.l2a)
        });
        percentiles(&mut as_well.into_iter().flatten().collect::<Vec<_>>(), 0.025)
    }
}

/// The loss in each scene; `None` if one has no such entry.
fn regrets_at(scenes: &[TableFile], place: [f64; 2]) -> Option<Vec<Regret>> {
    scenes.iter().map(|scene| scene.regret_at(place)).collect()
}

/// The ratios within all scenes' ranges, with the greatest loss of each.
fn tried(regrets: &[Regret]) -> Option<Vec<(f64, f64)>> {
    let [low, high] = common(regrets.iter().map(|regret| regret.range))?;
    let ratio = |number: usize| low * (high / low).powf(number as f64 / (TRIED - 1) as f64);
    let lost = |l2a| Some((l2a, most_lost(regrets, l2a)?));
    (0..TRIED).map(ratio).map(lost).collect()
}

fn most_lost(regrets: &[Regret], l2a: f64) -> Option<f64> {
    let mut losses = regrets.iter().map(|regret| regret.loss(l2a));
    losses.try_fold(f64::NEG_INFINITY, |most, loss| Some(most.max(loss?)))
}

/// The common part of all ranges; `None` if it is empty.
fn common(ranges: impl Iterator<Item = [f64; 2]>) -> Option<[f64; 2]> {
    let range = ranges.reduce(|one, other| [one[0].max(other[0]), one[1].min(other[1])]);
    range.filter(|[low, high]| low < high)
}

/// Why no table of least regret can be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RegretError {
    /// No table is given.
    #[error("no table to make it from: give at least one that `vocc optimize --criterion reach` made")]
    NoTable,
    /// Tables are made for different waveforms.
    #[error("the tables are made for {} and {} cycles of a carrier a symbol, 0 for still panels: give tables of one", .0[0], .0[1])]
    Waveforms([u16; 2]),
    /// A table has no such entry, or other ratios.
    #[error(
        "at {illuminance_lx} lx and interval {interval} no ratio was searched in all scenes: make their tables with the same axes and range"
    )]
    NothingCommon {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
    },
}

impl TableFile {
    /// The table of the ratios with the least loss in their worst scene ([`LeastRegret::over`]), from tables by reach, each with its file's
    /// name; the axes, and the panel for the intensities, are those of the first.
    ///
    /// # Errors
    /// If there is no table, or at an entry no ratio common to all of them.
    pub fn of_least_regret(tables: &[(String, Self)]) -> Result<Self, RegretError> {
        let (names, scenes): (Vec<String>, Vec<Self>) = tables.iter().cloned().unzip();
        let first = scenes.first().ok_or(RegretError::NoTable)?;
        let axes = &first.ratios;
        let other = scenes
            .iter()
            .map(|scene| scene.ratios.waveform)
            .find(|&waveform| waveform != axes.waveform);
        if let Some(other) = other {
            return Err(RegretError::Waveforms([axes.waveform, other].map(Waveform::cycles)));
        }
        let mut made = Self::plain(RatioFile {
            waveform: axes.waveform,
            ..RatioFile::empty(axes.illuminance_lx.clone(), axes.interval.clone())
        });
        let records = scenes.iter().filter_map(|scene| scene.reach.record.as_ref());
        made.regret.record = Some(RegretRecord {
            version: env!("CARGO_PKG_VERSION").into(),
            tables: names,
            range: common(records.map(|record| record.range)).ok_or(RegretError::NoTable)?,
        });
        for place @ [illuminance_lx, interval] in first.ratios.places() {
            let nothing = RegretError::NothingCommon { illuminance_lx, interval };
            let (entry, points) = least_at(&scenes, place).ok_or(nothing)?;
            made.add(entry, points);
        }
        Ok(made)
    }
}

/// The entry of an illuminance and an interval, and the loss of other ratios there.
fn least_at(scenes: &[TableFile], place: [f64; 2]) -> Option<EntryAndDetails<RegretEntry>> {
    let [illuminance_lx, interval] = place;
    let regrets = regrets_at(scenes, place)?;
    let LeastRegret { l2a, most_lost, no_worse } = LeastRegret::of(&regrets)?;
    let reach = regrets.iter().map(|regret| regret.reach_m(l2a));
    let of_panel = |scene| Light::of(&with_panel(scene, illuminance_lx, interval), l2a);
    let light = scenes.first()?.scene.as_ref().map(of_panel);
    let light = light.unwrap_or_default();
    let entry = RegretEntry {
        illuminance_lx,
        interval,
        l2a,
        l2a_95: LeastRegret::l2a_95(scenes, place)?,
        most_lost,
        no_worse,
        is_flat: no_worse[1] >= FLAT * no_worse[0],
        reach_m: reach.collect::<Option<_>>()?,
        mean_cd: light.mean_cd,
        peak_cd: light.peak_cd,
        luminance_cd_m2: light.luminance_cd_m2,
    };
    let points = tried(&regrets)?.into_iter().step_by(IN_FILE);
    let point = |(l2a, most_lost)| RegretPoint {
        illuminance_lx,
        interval,
        l2a,
        most_lost,
    };
    Some((entry, points.map(point).collect()))
}
