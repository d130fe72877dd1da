//! The file of a table found by a search: the ratios ([`sim::l2a::file`]) and all that they came from.
//!
//! Beside the ratios it has the settings of the search (`search`), the scene, the outcome of each illuminance and interval
//! (`entries`) and of each setting (`cells`). One made by reach has `reach`, `reach_entries` and, for each ratio tried, `reach_points`
//! instead; one of least regret over several of these `regret`, `regret_entries` and `regret_points`.

use std::cmp::Ordering;
use std::path::Path;

use link::l2a_table::L2aTable;
use rand::Rng;
use serde::{Deserialize, Serialize};
use sim::l2a::file::{Fault, FileError, RatioFile, read_with};
use sim::scene::Scene;

use super::by_reach::{ReachEntry, ReachPoint, ReachRecord, ReachSurvey};
use super::least_regret::{RegretEntry, RegretPoint, RegretRecord};
use super::outcome::{Cell, Entry, Rule};
use super::regret::{Regret, SAME};
use super::survey::{SearchRecord, Survey};
use crate::reach::Curve;

/// A table as it is in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct TableFile {
    /// The ratios, and their axes.
    pub ratios: RatioFile,
    /// Where they come from, if by a search.
    pub search: Option<SearchRecord>,
    /// The scene searched.
    pub scene: Option<Scene>,
    /// What was found for each illuminance and interval.
    pub entries: Vec<Entry>,
    /// What was found at each setting.
    pub cells: Vec<Cell>,
    /// Where they come from, if by a search by reach.
    pub reach: Option<ReachRecord>,
    /// What that found for each illuminance and interval.
    pub reach_entries: Vec<ReachEntry>,
    /// The reach at each ratio that it tried.
    pub reach_points: Vec<ReachPoint>,
    /// Where they come from, if they are those of least regret.
    pub regret: Option<RegretRecord>,
    /// What that is for each illuminance and interval.
    pub regret_entries: Vec<RegretEntry>,
    /// What other ratios lose.
    pub regret_points: Vec<RegretPoint>,
}

/// A search that says nothing of a ratio.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "at {illuminance_lx} lx and interval {interval} any ratio from {low} to {high} will do, for all that the search has found, which is \
     all it looked among: make this entry with `vocc optimize --criterion reach`, farther away, or with more frames"
)]
pub struct Unknown {
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
    /// The lowest ratio.
    pub low: f64,
    /// The highest ratio.
    pub high: f64,
}

impl Unknown {
    /// That of a ratio whose interval is the range it was looked for in, if it is.
    fn of(illuminance_lx: f64, interval: f64, l2a_95: [f64; 2], [low, high]: [f64; 2]) -> Option<Self> {
        let is_all = l2a_95[0] <= low * (1.0 + SAME) && l2a_95[1] >= high * (1.0 - SAME);
        is_all.then_some(Self {
            illuminance_lx,
            interval,
            low,
            high,
        })
    }
}

/// Why parts of a table are none of one.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PartError {
    /// Another survey.
    #[error("it is of another search than the first one: scene, axes and all settings must be the same")]
    OtherSurvey,
    /// An entry that is there already.
    #[error("it has the entry at {illuminance_lx} lx and interval {interval} once more: give each part once")]
    Doubled {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
    },
}

/// What a file says of where its ratios come from.
#[derive(Deserialize)]
struct Origin {
    search: Option<SearchRecord>,
    scene: Option<Scene>,
    #[serde(default)]
    entries: Vec<Entry>,
    #[serde(default)]
    cells: Vec<Cell>,
    reach: Option<ReachRecord>,
    #[serde(default)]
    reach_entries: Vec<ReachEntry>,
    #[serde(default)]
    reach_points: Vec<ReachPoint>,
    regret: Option<RegretRecord>,
    #[serde(default)]
    regret_entries: Vec<RegretEntry>,
    #[serde(default)]
    regret_points: Vec<RegretPoint>,
}

impl TableFile {
    /// A file with nothing but ratios.
    pub fn plain(ratios: RatioFile) -> Self {
        Self {
            ratios,
            search: None,
            scene: None,
            entries: Vec::new(),
            cells: Vec::new(),
            reach: None,
            reach_entries: Vec::new(),
            reach_points: Vec::new(),
            regret: None,
            regret_entries: Vec::new(),
            regret_points: Vec::new(),
        }
    }

    /// Whether a search has made it, or begun to.
    pub fn is_searched(&self) -> bool {
        let is_found = !self.entries.is_empty() || !self.reach_entries.is_empty();
        self.search.is_some() || self.reach.is_some() || is_found
    }

    /// The file of a survey of which nothing is done yet.
    pub fn of(survey: &Survey, scene: &Scene) -> Self {
        let ratios = RatioFile::empty(survey.illuminance_lx.clone(), survey.interval.clone());
        Self {
            search: Some(SearchRecord::of(survey)),
            scene: Some(scene.clone()),
            ..Self::plain(ratios)
        }
    }

    /// The same of a survey by reach.
    pub fn of_reach(survey: &ReachSurvey, scene: &Scene) -> Self {
        let ratios = RatioFile::empty(survey.illuminance_lx.clone(), survey.interval.clone());
        Self {
            reach: Some(ReachRecord::of(survey)),
            scene: Some(scene.clone()),
            ..Self::plain(ratios)
        }
    }

    /// Whether both are of the same survey of the same scene, finished or not.
    pub fn is_of_same_survey(&self, other: &Self) -> bool {
        (&self.search, &self.reach, &self.scene) == (&other.search, &other.reach, &other.scene)
            && (&self.ratios.illuminance_lx, &self.ratios.interval) == (&other.ratios.illuminance_lx, &other.ratios.interval)
    }

    /// The entry of an illuminance and an interval, if it is there.
    pub fn entry(&self, illuminance_lx: f64, interval: f64) -> Option<&Entry> {
        self.entries
            .iter()
            .find(|entry| entry.illuminance_lx == illuminance_lx && entry.interval == interval)
    }

    /// The entry of an illuminance and an interval by reach, if it is there.
    pub fn reach_entry(&self, illuminance_lx: f64, interval: f64) -> Option<&ReachEntry> {
        self.reach_entries
            .iter()
            .find(|entry| entry.illuminance_lx == illuminance_lx && entry.interval == interval)
    }

    /// The entry of an illuminance and an interval by least regret, if it is there.
    pub fn regret_entry(&self, illuminance_lx: f64, interval: f64) -> Option<&RegretEntry> {
        self.regret_entries
            .iter()
            .find(|entry| entry.illuminance_lx == illuminance_lx && entry.interval == interval)
    }

    /// The reach at each ratio that was tried at an illuminance and an interval.
    pub fn points(&self, illuminance_lx: f64, interval: f64) -> impl Iterator<Item = &ReachPoint> {
        self.reach_points
            .iter()
            .filter(move |point| (point.illuminance_lx, point.interval) == (illuminance_lx, interval))
    }

    /// The reach over the ratio at an illuminance and an interval, where it is known.
    pub fn curve(&self, illuminance_lx: f64, interval: f64) -> Option<Curve> {
        let points = || self.points(illuminance_lx, interval);
        let curve = Curve::through(points().map(|point| (point.l2a, point.reach_m)));
        (points().count() > 1).then_some(curve)
    }

    /// What is lost by other ratios than the best at an illuminance and an interval, where that is known.
    pub fn regret(&self, illuminance_lx: f64, interval: f64) -> Option<Regret> {
        Some(Regret {
            curve: self.curve(illuminance_lx, interval)?,
            range: self.reach.as_ref()?.range,
            best_m: self.reach_entry(illuminance_lx, interval)?.best_reach_m,
        })
    }

    /// The same as it might have come out as well.
    pub(super) fn resampled_regret(&self, illuminance_lx: f64, interval: f64, random: &mut impl Rng) -> Option<Regret> {
        let points = self.points(illuminance_lx, interval);
        Regret::resampled(points, self.reach.as_ref()?.range, random)
    }

    /// The 95 % interval of the ratio of an illuminance and an interval, where it is known.
    pub fn l2a_95(&self, illuminance_lx: f64, interval: f64) -> Option<[f64; 2]> {
        let by_search = || {
            let rule = self.search.as_ref()?.rule;
            Some(self.entry(illuminance_lx, interval)?.l2a_95(rule))
        };
        let by_reach = self.reach_entry(illuminance_lx, interval);
        let by_regret = self.regret_entry(illuminance_lx, interval);
        by_reach
            .map(|entry| entry.l2a_95)
            .or(by_regret.map(|entry| entry.l2a_95))
            .or_else(by_search)
    }

    /// The entries of which the search says nothing.
    pub fn unknown(&self) -> impl Iterator<Item = Unknown> {
        let by_search = self.search.iter().flat_map(|search| {
            self.entries.iter().filter_map(|entry| {
                let l2a_95 = entry.l2a_95(search.rule);
                Unknown::of(entry.illuminance_lx, entry.interval, l2a_95, search.range)
            })
        });
        let by_reach = self.reach.iter().flat_map(|reach| {
            self.reach_entries.iter().filter_map(|entry| {
                let all = entry.loses_nothing;
                Unknown::of(entry.illuminance_lx, entry.interval, all, reach.range)
            })
        });
        let by_regret = self.regret.iter().flat_map(|regret| {
            self.regret_entries.iter().filter_map(|entry| {
                let all = entry.no_worse;
                Unknown::of(entry.illuminance_lx, entry.interval, all, regret.range)
            })
        });
        by_search.chain(by_reach).chain(by_regret)
    }

    /// Adds what was found for one illuminance and interval. A ratio of which the search says nothing stays missing.
    pub fn add(&mut self, rule: Rule, entry: Entry, cells: Vec<Cell>) {
        self.entries.push(entry);
        self.cells.extend(cells);
        self.put(entry.illuminance_lx, entry.interval, entry.l2a(rule));
        self.sort();
    }

    /// The same by reach.
    pub fn add_reach(&mut self, entry: ReachEntry, points: Vec<ReachPoint>) {
        self.reach_entries.push(entry);
        self.reach_points.extend(points);
        self.put(entry.illuminance_lx, entry.interval, entry.l2a);
        self.sort();
    }

    /// The same by least regret.
    pub(super) fn add_regret(&mut self, entry: RegretEntry, points: Vec<RegretPoint>) {
        let (illuminance_lx, interval, l2a) = (entry.illuminance_lx, entry.interval, entry.l2a);
        self.regret_entries.push(entry);
        self.regret_points.extend(points);
        self.put(illuminance_lx, interval, l2a);
    }

    /// Adds the entries of another part of the same survey.
    ///
    /// # Errors
    /// When it is none, or has one that is there already; nothing is added then.
    pub fn merge(&mut self, part: Self) -> Result<(), PartError> {
        if !self.is_of_same_survey(&part) {
            return Err(PartError::OtherSurvey);
        }
        let is_in = |place: &[f64; 2]| self.is_found(*place) && part.is_found(*place);
        if let Some([illuminance_lx, interval]) = self.ratios.places().find(is_in) {
            return Err(PartError::Doubled { illuminance_lx, interval });
        }
        self.entries.extend(part.entries);
        self.cells.extend(part.cells);
        self.reach_entries.extend(part.reach_entries);
        self.reach_points.extend(part.reach_points);
        let own = self.ratios.l2a.iter_mut().flatten();
        for (own, found) in own.zip(part.ratios.l2a.iter().flatten()) {
            if own.is_nan() {
                *own = *found;
            }
        }
        self.sort();
        Ok(())
    }

    /// Whether something was found at an illuminance and an interval.
    fn is_found(&self, [illuminance_lx, interval]: [f64; 2]) -> bool {
        self.entry(illuminance_lx, interval).is_some() || self.reach_entry(illuminance_lx, interval).is_some()
    }

    /// The places at which nothing was found yet.
    pub fn missing(&self) -> impl Iterator<Item = [f64; 2]> {
        self.ratios.places().filter(|place| !self.is_found(*place))
    }

    /// Puts all findings in the order of the axes, whatever was finished first.
    fn sort(&mut self) {
        in_order(&mut self.entries, |entry| [entry.illuminance_lx, entry.interval]);
        in_order(&mut self.cells, |cell| [cell.illuminance_lx, cell.interval]);
        in_order(&mut self.reach_entries, |entry| [entry.illuminance_lx, entry.interval]);
        in_order(&mut self.reach_points, |point| [point.illuminance_lx, point.interval]);
    }

    /// Puts a ratio in its place, where something is known of it.
    fn put(&mut self, illuminance_lx: f64, interval: f64, l2a: f64) {
        let is_it = |unknown: Unknown| (unknown.illuminance_lx, unknown.interval) == (illuminance_lx, interval);
        if self.unknown().any(is_it) {
            return;
        }
        let ratios = &mut self.ratios;
        let row = ratios.illuminance_lx.iter().position(|&e| e == illuminance_lx);
        let column = ratios.interval.iter().position(|&i| i == interval);
        let place = row.and_then(|row| ratios.l2a.get_mut(row)?.get_mut(column?));
        if let Some(ratio) = place {
            // To a thousandth: finer than any uncertainty, and what a reader can take in.
            *ratio = (l2a * 1e3).round() / 1e3;
        }
    }

    /// The table of a file, and all that the file says of it.
    ///
    /// # Errors
    /// Says what is wrong, where, and what to do: see [`Fault`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        read_with(path, Self::from_toml)
    }

    /// The same of a file that a transmitter can use, and the table as it carries it.
    ///
    /// # Errors
    /// Also where there is no such table: see [`RatioFile::table`].
    pub fn read_with_table(path: &Path) -> Result<(Self, L2aTable), FileError> {
        read_with(path, |text| {
            let file = Self::from_toml(text)?;
            let table = file.ratios.table()?;
            Ok((file, table))
        })
    }

    /// The same of a text.
    ///
    /// # Errors
    /// When it is no TOML with the keys of a table, or of another version.
    pub fn from_toml(text: &str) -> Result<Self, Fault> {
        let ratios = RatioFile::from_toml(text)?;
        let origin: Origin = toml::from_str(text).map_err(Box::new)?;
        Ok(Self {
            ratios,
            search: origin.search,
            scene: origin.scene,
            entries: origin.entries,
            cells: origin.cells,
            reach: origin.reach,
            reach_entries: origin.reach_entries,
            reach_points: origin.reach_points,
            regret: origin.regret,
            regret_entries: origin.regret_entries,
            regret_points: origin.regret_points,
        })
    }

    /// The file's text, the same for the same content.
    ///
    /// # Errors
    /// When TOML has no word for something in it.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let mut text = self.ratios.to_toml();
        text += &lines("entries", "What the distances together say of each", &self.entries)?;
        text += &lines("cells", "What was found at each setting", &self.cells)?;
        text += &lines("reach_entries", "What the reach says of each", &self.reach_entries)?;
        text += &lines("reach_points", "The reach at each ratio", &self.reach_points)?;
        text += &lines("regret_entries", "What the scenes together say of each", &self.regret_entries)?;
        text += &lines(
            "regret_points",
            "What each ratio loses of the best one's reach, where most is lost",
            &self.regret_points,
        )?;
        #[derive(Serialize)]
        struct Origin<'a> {
            #[serde(skip_serializing_if = "Option::is_none")]
            search: &'a Option<SearchRecord>,
            #[serde(skip_serializing_if = "Option::is_none")]
            reach: &'a Option<ReachRecord>,
            #[serde(skip_serializing_if = "Option::is_none")]
            regret: &'a Option<RegretRecord>,
            #[serde(skip_serializing_if = "Option::is_none")]
            scene: &'a Option<Scene>,
        }
        let origin = Origin {
            search: &self.search,
            reach: &self.reach,
            regret: &self.regret,
            scene: &self.scene,
        };
        Ok(format!("{text}\n{}", toml::to_string(&origin)?))
    }
}

/// Sorts findings by their places.
fn in_order<Finding>(findings: &mut [Finding], place: impl Fn(&Finding) -> [f64; 2]) {
    findings.sort_by(|a, b| place(a).partial_cmp(&place(b)).unwrap_or(Ordering::Equal));
}

/// A list of tables, one a line; nothing of an empty one.
fn lines(key: &str, comment: &str, values: &[impl Serialize]) -> Result<String, toml::ser::Error> {
    if values.is_empty() {
        return Ok(String::new());
    }
    let mut text = format!("\n# {comment}.\n{key} = [\n");
    for value in values {
        let mut line = String::new();
        value.serialize(toml::ser::ValueSerializer::new(&mut line))?;
        text += &format!("  {line},\n");
    }
    Ok(text + "]\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimum::Search;

    #[test]
    fn what_was_written_is_read_back() {
        let scene = Scene::load("night", &[]).unwrap();
        let mut survey = Survey::new(Search::default());
        survey.illuminance_lx = vec![50.0, 100.0];
        let mut file = TableFile::of(&survey, &scene);
        let entry = Entry {
            illuminance_lx: 100.0,
            interval: 1.5,
            mean_l2a: 2.345_678_9,
            mean_l2a_95: [2.1, 2.6],
            range_l2a: [2.0, 3.0],
            at_border: true,
            least_ber_l2a: 2.5,
            least_ber_l2a_95: [2.4, 2.6],
            least_ber_not_worse: [2.2, 2.8],
            least_ber: 1.234_567_891e-7,
        };
        let cell = Cell {
            illuminance_lx: 100.0,
            interval: 1.5,
            distance_m: 30.0,
            yaw_deg: 0.0,
            l2a: 2.0,
            l2a_95: [1.9, 2.1],
            at_border: false,
            not_worse: [1.8, 2.2],
            b2w: Some(12.0),
            fisher: None,
            ber: 0.0,
            ber_95: [0.0, 1e-3],
            frames: 1 << 40,
            table_loss: 1.01,
        };
        file.add(Rule::Mean, entry, vec![cell; 5]);
        let text = file.to_toml().unwrap();
        let back = TableFile::from_toml(&text).unwrap_or_else(|fault| panic!("{fault}\n{text}"));
        assert!(back.is_of_same_survey(&file));
        let [found] = back.entries[..] else { panic!("one entry") };
        assert_eq!((found.mean_l2a, found.least_ber), (2.3457, 1.2346e-7), "five digits");
        assert_eq!(back.cells, file.cells);
        assert_eq!(back.ratios.l2a[1][2], 2.346);
        assert_eq!(back.entry(100.0, 1.5), Some(&found));
        assert_eq!(back.to_toml().unwrap(), text);
        let missing = back.ratios.table().unwrap_err().to_string();
        assert!(missing.contains("50 lx and interval 0.5"), "{missing}");
    }
}
