//! The file of a table: readable, versioned, with all that it came from.
//!
//! ```toml
//! format = 1
//! illuminance_lx = [50.0, 5000.0]   # ascending, 1 to 16
//! interval = [1.0, 2.0]             # ascending, 1 to 8
//! l2a = [                           # a row for each illuminance, a column for each interval, 0.2 to 4
//!   [2.0, 3.0],
//!   [1.8, 2.9],
//! ]
//! ```
//!
//! is a whole table. One made by a search has its settings (`search`), the scene, the outcome of each illuminance and interval
//! (`entries`) and of each setting (`cells`) besides. A ratio that is not found yet is `nan`: such a table cannot be used.

use std::cmp::Ordering;
use std::path::Path;

use link::l2a_table::{L2A_MAX, L2A_MIN, L2aTable, TableError};
use serde::{Deserialize, Serialize};

use crate::accuracy::Level;
use crate::optimum::Criterion;
use crate::scene::Scene;

use super::survey::{Cell, Entry, Rule, Survey};

/// The version of the format.
pub const FORMAT: u32 = 1;

/// Why a file holds no table that can be used.
#[derive(Debug, thiserror::Error)]
#[error("table {path:?}: {fault}")]
pub struct FileError {
    /// The file.
    pub path: String,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What can be wrong with a table's file.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// It cannot be read.
    #[error("cannot read it: {0}")]
    Read(#[from] std::io::Error),
    /// It is not TOML, or a key is missing, unknown or of the wrong type.
    #[error(transparent)]
    Parse(#[from] Box<toml::de::Error>),
    /// It is of another version.
    #[error(
        "format = {found}: this program reads format {FORMAT}; make it anew with `vocc optimize`, or use the program that wrote it"
    )]
    Format {
        /// The version.
        found: u32,
    },
    /// There is not a row for each illuminance.
    #[error("l2a has {found} rows, and there are {wanted} illuminances: give one row for each")]
    Rows {
        /// Rows there are.
        found: usize,
        /// Rows there should be.
        wanted: usize,
    },
    /// A row is longer or shorter than its axis.
    #[error(
        "row {row} of l2a, for {illuminance_lx} lx, has {found} ratios, and there are {wanted} intervals: give one for each"
    )]
    Ragged {
        /// Which row, from 0.
        row: usize,
        /// Its illuminance.
        illuminance_lx: f64,
        /// Its length.
        found: usize,
        /// The length it should have.
        wanted: usize,
    },
    /// A ratio has not been found yet.
    #[error(
        "the ratio for {illuminance_lx} lx and interval {interval} is missing (nan): finish the table with `vocc optimize --resume`, or fill it in"
    )]
    Missing {
        /// The illuminance of its row.
        illuminance_lx: f64,
        /// The interval of its column.
        interval: f64,
    },
    /// A ratio is out of range.
    #[error(
        "the ratio for {illuminance_lx} lx and interval {interval} is {ratio}: it must be {L2A_MIN} to {L2A_MAX}"
    )]
    Ratio {
        /// The illuminance of its row.
        illuminance_lx: f64,
        /// The interval of its column.
        interval: f64,
        /// The ratio.
        ratio: f64,
    },
    /// An axis is not allowed.
    #[error(transparent)]
    Axes(#[from] TableError),
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

/// A table as it is in a file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableFile {
    /// The version of the format; 1 where it is left out.
    #[serde(default = "this_format")]
    pub format: u32,
    /// Ambient illuminances of the rows, lx, ascending.
    pub illuminance_lx: Vec<f64>,
    /// Intervals of the columns, ascending.
    pub interval: Vec<f64>,
    /// The ratios.
    pub l2a: Vec<Vec<f64>>,
    /// Where they come from, if by a search.
    pub search: Option<SearchRecord>,
    /// The scene searched.
    pub scene: Option<Scene>,
    /// What was found for each illuminance and interval.
    #[serde(default)]
    pub entries: Vec<Entry>,
    /// What was found at each setting.
    #[serde(default)]
    pub cells: Vec<Cell>,
}

fn this_format() -> u32 {
    FORMAT
}

impl TableFile {
    /// The file of a survey of which nothing is done yet.
    pub fn of(survey: &Survey, scene: &Scene) -> Self {
        Self {
            format: FORMAT,
            illuminance_lx: survey.illuminance_lx.clone(),
            interval: survey.interval.clone(),
            l2a: vec![vec![f64::NAN; survey.interval.len()]; survey.illuminance_lx.len()],
            search: Some(SearchRecord::of(survey)),
            scene: Some(scene.clone()),
            entries: Vec::new(),
            cells: Vec::new(),
        }
    }

    /// Whether both are of the same survey of the same scene, finished or not.
    pub fn is_of_same_survey(&self, other: &Self) -> bool {
        (&self.search, &self.scene) == (&other.search, &other.scene)
            && (&self.illuminance_lx, &self.interval) == (&other.illuminance_lx, &other.interval)
    }

    /// The entry of an illuminance and an interval, if it is there.
    pub fn entry(&self, illuminance_lx: f64, interval: f64) -> Option<&Entry> {
        self.entries
            .iter()
            .find(|entry| entry.illuminance_lx == illuminance_lx && entry.interval == interval)
    }

    /// Adds what was found for one illuminance and interval.
    pub fn add(&mut self, rule: Rule, entry: Entry, cells: Vec<Cell>) {
        let row = self
            .illuminance_lx
            .iter()
            .position(|&e| e == entry.illuminance_lx);
        let column = self.interval.iter().position(|&i| i == entry.interval);
        let place = row.and_then(|row| self.l2a.get_mut(row)?.get_mut(column?));
        if let Some(ratio) = place {
            // To a thousandth: finer than any uncertainty, and what a reader can take in.
            *ratio = (entry.l2a(rule) * 1e3).round() / 1e3;
        }
        self.entries.push(entry);
        self.cells.extend(cells);
        // In the order of the axes, whatever was finished first.
        let order = |a: [f64; 2], b: [f64; 2]| a.partial_cmp(&b).unwrap_or(Ordering::Equal);
        self.entries.sort_by(|a, b| {
            order(
                [a.illuminance_lx, a.interval],
                [b.illuminance_lx, b.interval],
            )
        });
        self.cells.sort_by(|a, b| {
            order(
                [a.illuminance_lx, a.interval],
                [b.illuminance_lx, b.interval],
            )
        });
    }

    /// The table of a file, and all that the file says of it.
    ///
    /// # Errors
    /// Says what is wrong, where, and what to do: see [`Fault`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        std::fs::read_to_string(path)
            .map_err(Fault::Read)
            .and_then(|text| Self::from_toml(&text))
            .map_err(|fault| FileError {
                path: path.display().to_string(),
                fault,
            })
    }

    /// The same of a text.
    ///
    /// # Errors
    /// When it is no TOML with the keys of a table, or of another version.
    pub fn from_toml(text: &str) -> Result<Self, Fault> {
        // Of a later version, only the version is known.
        #[derive(Deserialize)]
        struct Versioned {
            #[serde(default = "this_format")]
            format: u32,
        }
        let Versioned { format } = toml::from_str(text).map_err(Box::new)?;
        if format != FORMAT {
            return Err(Fault::Format { found: format });
        }
        Ok(toml::from_str(text).map_err(Box::new)?)
    }

    /// What a transmitter carries of it.
    ///
    /// # Errors
    /// When its shape is wrong, an axis does not ascend, or a number is missing or out of range: says where.
    pub fn table(&self) -> Result<L2aTable, Fault> {
        if self.l2a.len() != self.illuminance_lx.len() {
            return Err(Fault::Rows {
                found: self.l2a.len(),
                wanted: self.illuminance_lx.len(),
            });
        }
        for (row, (ratios, &illuminance_lx)) in
            self.l2a.iter().zip(&self.illuminance_lx).enumerate()
        {
            if ratios.len() != self.interval.len() {
                return Err(Fault::Ragged {
                    row,
                    illuminance_lx,
                    found: ratios.len(),
                    wanted: self.interval.len(),
                });
            }
            for (&ratio, &interval) in ratios.iter().zip(&self.interval) {
                check_ratio(illuminance_lx, interval, ratio)?;
            }
        }
        let single = |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<_>>();
        Ok(L2aTable::new(
            &single(&self.illuminance_lx),
            &single(&self.interval),
            &single(&self.l2a.concat()),
        )?)
    }

    /// The file's text, the same for the same content.
    ///
    /// # Errors
    /// When TOML has no word for something in it.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let mut text = format!(
            "# The best LED-to-ambient ratio, L2A = L/(E·R): a row for each illuminance, a column for each LED interval.\n\
             format = {}\nilluminance_lx = {:?}\ninterval = {:?}\nl2a = [\n",
            self.format, self.illuminance_lx, self.interval
        );
        for (row, illuminance) in self.l2a.iter().zip(&self.illuminance_lx) {
            let ratios: Vec<String> = row.iter().map(|&ratio| number(ratio)).collect();
            text += &format!("  [{}],  # {illuminance} lx\n", ratios.join(", "));
        }
        text += "]\n";
        text += &lines(
            "entries",
            "What the distances together say of each",
            &self.entries,
        )?;
        text += &lines("cells", "What was found at each setting", &self.cells)?;
        #[derive(Serialize)]
        struct Origin<'a> {
            #[serde(skip_serializing_if = "Option::is_none")]
            search: &'a Option<SearchRecord>,
            #[serde(skip_serializing_if = "Option::is_none")]
            scene: &'a Option<Scene>,
        }
        let origin = Origin {
            search: &self.search,
            scene: &self.scene,
        };
        Ok(format!("{text}\n{}", toml::to_string(&origin)?))
    }
}

fn check_ratio(illuminance_lx: f64, interval: f64, ratio: f64) -> Result<(), Fault> {
    if ratio.is_nan() {
        return Err(Fault::Missing {
            illuminance_lx,
            interval,
        });
    }
    if (L2A_MIN..=L2A_MAX).contains(&(ratio as f32)) {
        return Ok(());
    }
    Err(Fault::Ratio {
        illuminance_lx,
        interval,
        ratio,
    })
}

/// A number as TOML writes it.
fn number(value: f64) -> String {
    if value.is_nan() {
        "nan".into()
    } else {
        format!("{value:?}")
    }
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
    use proptest::prelude::*;

    const PLAIN: &str =
        "illuminance_lx = [50, 5000]\ninterval = [1, 2]\nl2a = [[2, 3], [1.8, 2.9]]\n";

    fn complaint(from: &str, to: &str) -> String {
        assert!(
            PLAIN.contains(from),
            "{from:?} must be there to be replaced"
        );
        let file = TableFile::from_toml(&PLAIN.replacen(from, to, 1));
        file.and_then(|file| file.table()).unwrap_err().to_string()
    }

    #[test]
    fn a_table_of_three_keys_is_enough() {
        let table = TableFile::from_toml(PLAIN).unwrap().table().unwrap();
        assert_eq!(
            table.values()[2].to_num::<f64>(),
            1.8f64.mul_add(8192.0, 0.5).floor() / 8192.0
        );
        assert_eq!(
            (table.illuminances_lx().len(), table.intervals().len()),
            (2, 2)
        );
    }

    #[test]
    fn faults_are_told_with_their_place() {
        for (from, to, words) in [
            ("1.8", "nan", &["5000 lx and interval 1", "missing"][..]),
            ("2.9", "4.5", &["5000 lx and interval 2", "4.5", "0.2 to 4"]),
            ("2.9", "inf", &["inf", "0.2 to 4"]),
            (
                "1.8, ",
                "",
                &["row 1", "5000 lx", "1 ratios", "2 intervals"],
            ),
            (", [1.8, 2.9]", "", &["1 rows", "2 illuminances"]),
            (
                "50, 5000",
                "5000, 50",
                &["illuminance", "number 1", "50", "sort"],
            ),
            ("1, 2", "1, 1", &["interval", "number 1", "sort"]),
            ("1, 2", "1, nan", &["interval", "NaN", "0.05 to 15"]),
            (
                "50, 5000",
                "0, 5000",
                &["illuminance", "number 0", "0.01 to 1000000"],
            ),
            ("50, 5000", "", &["2 rows", "0 illuminances"]),
            ("interval", "intervals", &["intervals"]),
            ("illuminance_lx = [50, 5000]\n", "", &["illuminance_lx"]),
            ("50,", "\"dark\",", &["line 1", "dark"]),
            (
                "illuminance_lx",
                "format = 2\nilluminance_lx",
                &["format = 2", "reads format 1"],
            ),
            (
                "illuminance_lx",
                "format = 2\nunknown_lx",
                &["format = 2", "reads format 1"],
            ),
            ("illuminance_lx", "format = -1\nilluminance_lx", &["-1"]),
        ] {
            let complaint = complaint(from, to);
            for word in words {
                assert!(
                    complaint.contains(word),
                    "{from:?} as {to:?} should speak of {word:?}: {complaint}"
                );
            }
        }
    }

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
        let [found] = back.entries[..] else {
            panic!("one entry")
        };
        assert_eq!(
            (found.mean_l2a, found.least_ber),
            (2.3457, 1.2346e-7),
            "five digits"
        );
        assert_eq!(back.cells, file.cells);
        assert_eq!(back.l2a[1][2], 2.346);
        assert_eq!(back.entry(100.0, 1.5), Some(&found));
        assert_eq!(back.to_toml().unwrap(), text);
        let missing = back.table().unwrap_err().to_string();
        assert!(missing.contains("50 lx and interval 0.5"), "{missing}");
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "[a-z0-9_= \\[\\],.\n-]{0,80}") {
            if let Ok(file) = TableFile::from_toml(&format!("{PLAIN}{text}")) {
                let _ = file.table();
            }
        }
    }
}
