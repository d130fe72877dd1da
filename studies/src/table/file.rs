//! The file of a table found by a search: the ratios ([`sim::l2a::file`]) and their origin.
//!
//! Besides the ratios it has the settings of the search (`search`), the scene, the results of each illuminance and interval (`entries`) and
//! of each setting (`cells`). A table by reach has `reach`, `reach_entries` and, for each tried ratio, `reach_points` instead; a table of
//! least regret over several of these has `regret`, `regret_entries` and `regret_points`. The last line of all these is a checksum.

use std::path::Path;

use link::l2a_table::L2aTable;
use serde::{Deserialize, Serialize};
use sim::l2a::file::{Fault, FileError, RatioFile, read_with};
use sim::scene::Scene;

use super::by_criterion::{Cell, Entry, SearchRecord};
use super::by_reach::{ReachEntry, ReachPoint, ReachRecord};
use super::condition::with_panel;
use super::findings::{Findings, Outcome, Unknown};
use super::regret::{Regret, RegretEntry, RegretPoint, RegretRecord};
use super::seal;
use super::survey::{Survey, SurveyError, SurveyEvent};
use crate::reach::{Curve, found_to_m};

/// The content of a table file.
#[derive(Clone, Debug, PartialEq)]
pub struct TableFile {
    /// The ratios, and their axes.
    pub ratios: RatioFile,
    /// The scene of the search.
    pub scene: Option<Scene>,
    /// The origin of the ratios, if from a search by variances or bit errors.
    pub search: Findings<Entry>,
    /// The origin, if from a search by reach.
    pub reach: Findings<ReachEntry>,
    /// The origin, if they are those of least regret.
    pub regret: Findings<RegretEntry>,
}

impl TableFile {
    /// The greatest distance at which a panel of this interval is found, in metres, if the table is for one scene: see [`found_to_m`].
    pub fn found_at_m(&self, interval: f64) -> Option<f64> {
        let scene = self.scene.as_ref()?;
        Some(found_to_m(&with_panel(scene, scene.ambient.illuminance_lx, interval)))
    }

    /// The greatest distance at which the panel is found, in metres, for each interval of the table: see [`Self::found_at_m`].
    pub fn found_to_m(&self) -> Option<Vec<f64>> {
        self.ratios.interval.iter().map(|&interval| self.found_at_m(interval)).collect()
    }
}

/// A result that a table file can hold.
pub trait InFile: Outcome {
    /// The results in a file.
    fn of(file: &TableFile) -> &Findings<Self>;

    /// The same, mutable.
    fn of_mut(file: &mut TableFile) -> &mut Findings<Self>;
}

macro_rules! in_file {
    ($($entry:ty: $field:ident),+) => {
        $(impl InFile for $entry {
            fn of(file: &TableFile) -> &Findings<Self> {
                &file.$field
            }

            fn of_mut(file: &mut TableFile) -> &mut Findings<Self> {
                &mut file.$field
            }
        })+
    };
}
in_file!(Entry: search, ReachEntry: reach, RegretEntry: regret);

/// Why parts of a table do not fit together.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PartError {
    /// Another survey.
    #[error("it is of another search than the first one: scene, axes and all settings must be the same")]
    OtherSurvey,
    /// An entry that is there already.
    #[error("it repeats the entry at {illuminance_lx} lx and interval {interval}: give each part once")]
    Doubled {
        /// Ambient illuminance, lx.
        illuminance_lx: f64,
        /// Normalised LED interval.
        interval: f64,
    },
}

/// The origin of the ratios.
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
            scene: None,
            search: Findings::default(),
            reach: Findings::default(),
            regret: Findings::default(),
        }
    }

    /// The file of a survey without results.
    pub fn of<S: Survey<Entry: InFile>>(survey: &S, scene: &Scene) -> Self {
        let [illuminance_lx, interval] = survey.axes().map(<[f64]>::to_vec);
        let mut file = Self::plain(RatioFile::empty(illuminance_lx, interval));
        // The scene of a survey that was checked; `check` refuses a file in which they differ.
        file.ratios.waveform = scene.link.waveform().unwrap_or_default();
        file.scene = Some(scene.clone());
        S::Entry::of_mut(&mut file).record = Some(survey.record());
        file
    }

    /// The file of a survey; if the survey is ended early, with the results so far.
    ///
    /// # Errors
    /// If a place cannot be searched.
    pub fn searched<S: Survey<Entry: InFile>>(
        survey: &S,
        scene: &Scene,
        mut tell: impl FnMut(SurveyEvent<S::Piece>) + Send,
    ) -> Result<Self, SurveyError> {
        let mut file = Self::of(survey, scene);
        for place in file.ratios.places().collect::<Vec<_>>() {
            let Some((entry, details)) = survey.find(scene, place, Vec::new(), &mut tell)? else {
                break;
            };
            file.add(entry, details);
        }
        Ok(file)
    }

    /// Whether a search has made it, or started to.
    pub fn is_searched(&self) -> bool {
        let is_found = !self.search.entries.is_empty() || !self.reach.entries.is_empty();
        self.search.record.is_some() || self.reach.record.is_some() || is_found
    }

    /// Whether both are of the same survey of the same scene, finished or not.
    pub fn is_of_same_survey(&self, other: &Self) -> bool {
        (&self.search.record, &self.reach.record) == (&other.search.record, &other.reach.record)
            && (&self.regret.record, &self.scene) == (&other.regret.record, &other.scene)
            && (&self.ratios.illuminance_lx, &self.ratios.interval) == (&other.ratios.illuminance_lx, &other.ratios.interval)
            && self.ratios.waveform == other.ratios.waveform
    }

    /// The reach over the ratio at a place, if known.
    fn curve(&self, place: [f64; 2]) -> Option<Curve> {
        let points = || self.reach.details_at(place);
        let curve = Curve::through(points().map(|point| (point.l2a, point.reach_m)));
        (points().count() > 1).then_some(curve)
    }

    /// The loss by other ratios than the best at a place, if known.
    pub fn regret_at(&self, place: [f64; 2]) -> Option<Regret> {
        let range = self.reach.record.as_ref()?.range;
        let best_m = self.reach.entry(place)?.best_reach_m;
        // A file without a scene does not state the distance at which its panel is found.
        let found_m = self.found_at_m(place[1]).unwrap_or(f64::INFINITY);
        Some(Regret::new(self.curve(place)?, range, best_m, found_m))
    }

    /// The 95 % interval of the ratio of a place, if known.
    pub fn l2a_95(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let by_reach = self.reach.carried_95(place);
        by_reach
            .or_else(|| self.regret.carried_95(place))
            .or_else(|| self.search.carried_95(place))
    }

    /// The entries that the search does not decide.
    pub fn unknown(&self) -> impl Iterator<Item = Unknown> {
        let by_search = self.search.unknown();
        by_search.chain(self.reach.unknown()).chain(self.regret.unknown())
    }

    /// Adds the result at a place. A ratio that the search does not decide stays missing.
    pub fn add<E: InFile>(&mut self, entry: E, details: Vec<E::Detail>) {
        let place = entry.place();
        let findings = E::of_mut(self);
        let carried = findings.record.as_ref().map(|record| entry.carried(record));
        findings.extend([entry], details);
        let is_it = |unknown: Unknown| [unknown.illuminance_lx, unknown.interval] == place;
        if let Some(l2a) = carried.filter(|_| !self.unknown().any(is_it)) {
            self.put(place, l2a);
        }
    }

    /// Adds the entries of another part of the same survey.
    ///
    /// # Errors
    /// If it is not one, or overlaps; nothing is added then.
    pub fn merge(&mut self, part: Self) -> Result<(), PartError> {
        if !self.is_of_same_survey(&part) {
            return Err(PartError::OtherSurvey);
        }
        let is_in = |place: &[f64; 2]| self.is_found(*place) && part.is_found(*place);
        if let Some([illuminance_lx, interval]) = self.ratios.places().find(is_in) {
            return Err(PartError::Doubled { illuminance_lx, interval });
        }
        self.search.extend(part.search.entries, part.search.details);
        self.reach.extend(part.reach.entries, part.reach.details);
        self.regret.extend(part.regret.entries, part.regret.details);
        let own = self.ratios.l2a.iter_mut().flatten();
        for (own, found) in own.zip(part.ratios.l2a.iter().flatten()) {
            if own.is_nan() {
                *own = *found;
            }
        }
        Ok(())
    }

    /// Whether the program made it: by a search, or as the ratios of least regret over several searches.
    fn is_made(&self) -> bool {
        self.is_searched() || self.regret.record.is_some()
    }

    /// Whether a place has a result, or a ratio in a table without an origin.
    fn is_found(&self, place: [f64; 2]) -> bool {
        let is_plain = !self.is_made();
        self.search.entry(place).is_some()
            || self.reach.entry(place).is_some()
            || self.regret.entry(place).is_some()
            || is_plain && self.ratio(place).is_some_and(|ratio| !ratio.is_nan())
    }

    /// The ratio at a place, if there is one.
    pub(super) fn ratio(&self, place: [f64; 2]) -> Option<f64> {
        let [row, column] = self.row_and_column(place)?;
        self.ratios.l2a.get(row)?.get(column).copied()
    }

    fn row_and_column(&self, [illuminance_lx, interval]: [f64; 2]) -> Option<[usize; 2]> {
        let row = self.ratios.illuminance_lx.iter().position(|&e| e == illuminance_lx)?;
        let column = self.ratios.interval.iter().position(|&i| i == interval)?;
        Some([row, column])
    }

    /// The places without results.
    pub fn missing(&self) -> impl Iterator<Item = [f64; 2]> {
        self.ratios.places().filter(|place| !self.is_found(*place))
    }

    fn put(&mut self, place: [f64; 2], l2a: f64) {
        let place = self.row_and_column(place);
        if let Some(ratio) = place.and_then(|[row, column]| self.ratios.l2a.get_mut(row)?.get_mut(column)) {
            // To a thousandth: finer than any uncertainty, and readable.
            *ratio = (l2a * 1e3).round() / 1e3;
        }
    }

    /// The table of a file, and its origin.
    ///
    /// # Errors
    /// [`FileError`] gives the fault, its place, and the remedy.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        read_with(path, Self::from_toml)
    }

    /// As [`Self::read`], for a usable file, with the transmitter's table.
    ///
    /// # Errors
    /// Also if there is no such table: see [`RatioFile::table`].
    pub fn read_with_table(path: &Path) -> Result<(Self, L2aTable), FileError> {
        read_with(path, |text| {
            let file = Self::from_toml(text)?;
            let table = file.ratios.table()?;
            Ok((file, table))
        })
    }

    /// The table of a file's text, and its origin.
    ///
    /// # Errors
    /// If it is not TOML with the keys of a table, has another version, or was changed after it was written.
    pub fn from_toml(text: &str) -> Result<Self, Fault> {
        let ratios = RatioFile::from_toml(text)?;
        seal::verify(text)?;
        let origin: Origin = toml::from_str(text).map_err(Box::new)?;
        Ok(Self {
            ratios,
            scene: origin.scene,
            search: Findings {
                record: origin.search,
                entries: origin.entries,
                details: origin.cells,
            },
            reach: Findings {
                record: origin.reach,
                entries: origin.reach_entries,
                details: origin.reach_points,
            },
            regret: Findings {
                record: origin.regret,
                entries: origin.regret_entries,
                details: origin.regret_points,
            },
        })
    }

    /// The file's text, the same for the same content.
    ///
    /// # Errors
    /// If a value cannot be written in TOML.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let findings = [self.search.lines()?, self.reach.lines()?, self.regret.lines()?];
        let text = self.ratios.to_toml() + &findings.concat();
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
            search: &self.search.record,
            reach: &self.reach.record,
            regret: &self.regret.record,
            scene: &self.scene,
        };
        let text = format!("{text}\n{}", toml::to_string(&origin)?);
        Ok(if self.is_made() { seal::sealed(&text) } else { text })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimum::Search;
    use crate::table::CriterionSurvey;

    const PLAIN: &str = "illuminance_lx = [50, 5000]\ninterval = [1, 2]\nl2a = [[2, 3], [nan, nan]]\n";

    #[test]
    fn plain_tables_are_merged_by_their_ratios() {
        let part = |text: &str| TableFile::from_toml(text).unwrap();
        let other = PLAIN.replace("[2, 3], [nan, nan]", "[nan, nan], [1.5, 2.5]");
        let mut whole = part(PLAIN);
        whole.merge(part(&other)).unwrap();
        assert_eq!(whole.ratios.l2a, [[2.0, 3.0], [1.5, 2.5]]);
        assert_eq!(whole.missing().count(), 0);
        let again = whole.merge(part(PLAIN)).unwrap_err();
        assert!(matches!(again, PartError::Doubled { .. }), "{again}");
        let carried = whole.merge(part(&format!("carrier_cycles = 16\n{PLAIN}"))).unwrap_err();
        assert_eq!(carried, PartError::OtherSurvey);
    }

    #[test]
    fn tables_of_least_regret_keep_what_they_lose() {
        let entry = |illuminance_lx: f64, l2a: f64| RegretEntry {
            illuminance_lx,
            interval: 1.0,
            l2a,
            l2a_95: [l2a - 0.1, l2a + 0.1],
            most_lost: 0.02,
            no_worse: [l2a - 0.2, l2a + 0.2],
            is_flat: false,
            reach_m: vec![60.0, 50.0],
            mean_cd: 1.0,
            peak_cd: 2.0,
            luminance_cd_m2: 3.0,
        };
        let part = |illuminance_lx, l2a| {
            let mut part = TableFile::plain(RatioFile::empty(vec![50.0, 5000.0], vec![1.0]));
            part.regret.record = Some(RegretRecord {
                version: "0".into(),
                tables: vec!["a.toml".into(), "b.toml".into()],
                range: [0.2, 4.0],
            });
            part.add(entry(illuminance_lx, l2a), Vec::new());
            part
        };
        let mut whole = part(5000.0, 2.5);
        whole.merge(part(50.0, 1.5)).unwrap();
        assert_eq!(whole.ratios.l2a, [[1.5], [2.5]]);
        assert_eq!((whole.regret.entries.len(), whole.missing().count()), (2, 0));
        whole.check().unwrap();
        let again = whole.merge(part(50.0, 1.5)).unwrap_err();
        assert!(matches!(again, PartError::Doubled { .. }), "{again}");
    }

    /// A text without its checksum.
    fn own(text: &str) -> String {
        let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("# checksum")).collect();
        lines.join("\n")
    }

    #[test]
    fn what_was_written_is_read_back() {
        let scene = Scene::load("night", &[]).unwrap();
        let mut survey = CriterionSurvey::new(Search::default());
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
            not_worse_loss: Some([1.02, 1.03]),
            b2w: Some(12.0),
            fisher: None,
            ber: 0.0,
            ber_95: [0.0, 1e-3],
            ber_one_symbol: None,
            frames: 1 << 40,
            table_loss: 1.01,
        };
        file.add(entry, vec![cell; 5]);
        let text = file.to_toml().unwrap();
        let back = TableFile::from_toml(&text).unwrap_or_else(|fault| panic!("{fault}\n{text}"));
        assert!(back.is_of_same_survey(&file));
        let [found] = back.search.entries[..] else { panic!("one entry") };
        assert_eq!((found.mean_l2a, found.least_ber), (2.3457, 1.2346e-7), "five digits");
        assert_eq!(back.search.details, file.search.details);
        assert_eq!(back.ratios.l2a[1][2], 2.346);
        assert_eq!(back.search.entry([100.0, 1.5]), Some(&found));
        assert_eq!(back.to_toml().unwrap(), text);
        back.check().unwrap();
        for (from, to, words) in [
            ("2.346", "3.95", &["100 lx and interval 1.5 is 3.95", "found 2.346", "entries"][..]),
            ("2.346", "nan", &["is NaN"]),
            ("mean_l2a = 2.3457", "mean_l2a = 0.2", &["found 0.200"]),
            ("[2.1, 2.6]", "[nan, -inf]", &["mean_l2a_95 = [nan, -inf]", "must be a number"]),
            ("least_ber = 0.00000012346", "least_ber = -5.0", &["least_ber = -5.0", "below 0"]),
            (" ber = 0.0,", " ber = 5.0,", &["cells", "ber = 5.0", "0 to 1"]),
            ("[1.9, 2.1]", "[2.1, 1.9]", &["lower end"]),
            (
                "100.0, interval = 1.5, mean",
                "200.0, interval = 1.5, mean",
                &["200 lx", "1 entries"],
            ),
        ] {
            assert!(text.contains(from), "{from} is to be replaced in {text}");
            let edited = text.replacen(from, to, 1);
            let fault = TableFile::from_toml(&edited).unwrap_err();
            assert!(matches!(fault, Fault::Changed { .. }), "{fault}");
            // Without a checksum it counts as a user's own table, or as one of an earlier version.
            let changed = TableFile::from_toml(&own(&edited)).unwrap();
            let said = changed.check().expect_err(to).to_string();
            words
                .iter()
                .for_each(|word| assert!(said.contains(word), "{word:?} is not in: {said}"));
        }
        let carried = TableFile::from_toml(&format!("carrier_cycles = 16\n{}", own(&text))).unwrap();
        let said = carried.check().expect_err("another waveform than the scene's").to_string();
        assert!(
            said.contains("carrier_cycles = 16") && said.contains("link.carrier_cycles = 0"),
            "{said}"
        );
        let missing = back.ratios.table().unwrap_err().to_string();
        assert!(missing.contains("50 lx and interval 0.5"), "{missing}");
    }
}
