//! The file of a table of ratios: readable, versioned.
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
//! is a whole table. `carrier_cycles = 16` notes that it is made for symbols of 16 cycles of a carrier; without it, a table is made for
//! still panels. A transmitter's table has no such note. A table made by a search also records its origin (`search`, `scene`, `entries`,
//! `cells`, or `reach` or `regret` with their entries and points), which readers of the ratios ignore. A ratio that was not found yet is
//! `nan`, and the table cannot be used.

use std::path::Path;

use link::l2a_table::{L2A_MAX, L2A_MIN, L2aTable, TableError};
use link::waveform::{Waveform, WaveformError};
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::input;

/// The version of the format.
pub const FORMAT: u32 = 1;

/// Why a file does not hold a usable table.
#[derive(Debug, thiserror::Error)]
#[error("table {path:?}: {fault}")]
pub struct FileError {
    /// The file.
    pub path: String,
    /// Its fault.
    pub fault: Fault,
}

/// A fault of a table's file.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// It cannot be read.
    #[error("cannot read it: {0}")]
    Read(#[from] std::io::Error),
    /// It is not TOML, or a key is missing, unknown or of the wrong type.
    #[error(transparent)]
    Parse(#[from] Box<toml::de::Error>),
    /// It has another version.
    #[error("format = {found}: this program reads format {FORMAT}; make it again with `vocc optimize`, or use the program that wrote it")]
    Format {
        /// The version.
        found: u32,
    },
    /// The number of rows does not match the illuminances.
    #[error("l2a has {found} rows, and there are {wanted} illuminances: give one row for each")]
    Rows {
        /// Number of rows.
        found: usize,
        /// Required number of rows.
        wanted: usize,
    },
    /// A row is longer or shorter than its axis.
    #[error("row {row} of l2a, for {illuminance_lx} lx, has {found} ratios, and there are {wanted} intervals: give one for each")]
    Ragged {
        /// The row, from 0.
        row: usize,
        /// Its illuminance.
        illuminance_lx: f64,
        /// Its length.
        found: usize,
        /// Its required length.
        wanted: usize,
    },
    /// A ratio has not been found yet.
    #[error(
        "the ratio for {illuminance_lx} lx and interval {interval} is missing (nan): finish the table with `vocc optimize \
         --resume`, or fill it in"
    )]
    Missing {
        /// The illuminance of its row.
        illuminance_lx: f64,
        /// The interval of its column.
        interval: f64,
    },
    /// A ratio is out of range.
    #[error("the ratio for {illuminance_lx} lx and interval {interval} is {ratio}: it must be {L2A_MIN} to {L2A_MAX}")]
    Ratio {
        /// The illuminance of its row.
        illuminance_lx: f64,
        /// The interval of its column.
        interval: f64,
        /// The ratio.
        ratio: f64,
    },
    /// It was changed after a search wrote it.
    #[error(
        "it was changed after it was written: its checksum should be {wanted}. Put it back, or take out the last line to use it as a table \
         of your own"
    )]
    Changed {
        /// The checksum of its lines.
        wanted: String,
    },
    /// An axis is invalid.
    #[error(transparent)]
    Axes(#[from] TableError),
    /// No transmitter shows such a carrier.
    #[error("carrier_cycles: {0}")]
    Waveform(#[from] WaveformError),
}

/// The ratios of a table file.
#[derive(Clone, Debug, PartialEq)]
pub struct RatioFile {
    /// The version of the format.
    pub format: u32,
    /// Ambient illuminances of the rows, lx, ascending.
    pub illuminance_lx: Vec<f64>,
    /// Intervals of the columns, ascending.
    pub interval: Vec<f64>,
    /// The ratios.
    pub l2a: Vec<Vec<f64>>,
    /// The waveform of the symbols that they are made for.
    pub waveform: Waveform,
}

/// All keys of a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default = "this_format")]
    format: u32,
    illuminance_lx: Vec<f64>,
    interval: Vec<f64>,
    l2a: Vec<Vec<f64>>,
    #[serde(default)]
    carrier_cycles: u32,
    #[serde(rename = "search")]
    _search: Option<IgnoredAny>,
    #[serde(rename = "scene")]
    _scene: Option<IgnoredAny>,
    #[serde(rename = "entries")]
    _entries: Option<IgnoredAny>,
    #[serde(rename = "cells")]
    _cells: Option<IgnoredAny>,
    #[serde(rename = "reach")]
    _reach: Option<IgnoredAny>,
    #[serde(rename = "reach_entries")]
    _reach_entries: Option<IgnoredAny>,
    #[serde(rename = "reach_points")]
    _reach_points: Option<IgnoredAny>,
    #[serde(rename = "regret")]
    _regret: Option<IgnoredAny>,
    #[serde(rename = "regret_entries")]
    _regret_entries: Option<IgnoredAny>,
    #[serde(rename = "regret_points")]
    _regret_points: Option<IgnoredAny>,
}

fn this_format() -> u32 {
    FORMAT
}

impl RatioFile {
    /// A table without ratios yet, for still panels.
    pub fn empty(illuminance_lx: Vec<f64>, interval: Vec<f64>) -> Self {
        Self {
            format: FORMAT,
            l2a: vec![vec![f64::NAN; interval.len()]; illuminance_lx.len()],
            illuminance_lx,
            interval,
            waveform: Waveform::STILL,
        }
    }

    /// The ratios of a file.
    ///
    /// # Errors
    /// [`FileError`] gives the fault, its place, and the remedy.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        read_with(path, Self::from_toml)
    }

    /// The ratios of a file's text.
    ///
    /// # Errors
    /// If it is not TOML with the keys of a table, or has another version.
    pub fn from_toml(text: &str) -> Result<Self, Fault> {
        // For a later version, only the version is known.
        #[derive(Deserialize)]
        struct Versioned {
            #[serde(default = "this_format")]
            format: u32,
        }
        let Versioned { format } = toml::from_str(text).map_err(Box::new)?;
        if format != FORMAT {
            return Err(Fault::Format { found: format });
        }
        let keys: Keys = toml::from_str(text).map_err(Box::new)?;
        Ok(Self {
            format: keys.format,
            illuminance_lx: keys.illuminance_lx,
            interval: keys.interval,
            l2a: keys.l2a,
            waveform: Waveform::new(keys.carrier_cycles)?,
        })
    }

    /// Its places, row by row: illuminance and interval.
    pub fn places(&self) -> impl Iterator<Item = [f64; 2]> + Clone {
        let rows = self.illuminance_lx.iter();
        rows.flat_map(|&illuminance_lx| self.interval.iter().map(move |&interval| [illuminance_lx, interval]))
    }

    /// The transmitter's table of these ratios.
    ///
    /// # Errors
    /// If its shape is wrong, an axis does not ascend, or a number is missing or out of range; gives the place.
    pub fn table(&self) -> Result<L2aTable, Fault> {
        if self.l2a.len() != self.illuminance_lx.len() {
            return Err(Fault::Rows {
                found: self.l2a.len(),
                wanted: self.illuminance_lx.len(),
            });
        }
        for (row, (ratios, &illuminance_lx)) in self.l2a.iter().zip(&self.illuminance_lx).enumerate() {
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

    /// The text of a file with nothing but the ratios, the same for the same content.
    pub fn to_toml(&self) -> String {
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
        if !self.waveform.is_still() {
            text += &format!("carrier_cycles = {}\n", self.waveform.cycles());
        }
        text
    }
}

/// The result of `of_text` on a file's text, or the fault of the file.
///
/// # Errors
/// If the file cannot be read, or its text is invalid.
pub fn read_with<T>(path: &Path, of_text: impl Fn(&str) -> Result<T, Fault>) -> Result<T, FileError> {
    input::read_text(path, input::TABLE_MAX)
        .map_err(Fault::Read)
        .and_then(|text| of_text(&text))
        .map_err(|fault| FileError {
            path: path.display().to_string(),
            fault,
        })
}

fn check_ratio(illuminance_lx: f64, interval: f64, ratio: f64) -> Result<(), Fault> {
    if ratio.is_nan() {
        return Err(Fault::Missing { illuminance_lx, interval });
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

/// A number in TOML's notation.
fn number(value: f64) -> String {
    if value.is_nan() { "nan".into() } else { format!("{value:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    const PLAIN: &str = "illuminance_lx = [50, 5000]\ninterval = [1, 2]\nl2a = [[2, 3], [1.8, 2.9]]\n";

    fn complaint(from: &str, to: &str) -> String {
        assert!(PLAIN.contains(from), "{from:?} must be there to be replaced");
        let file = RatioFile::from_toml(&PLAIN.replacen(from, to, 1));
        file.and_then(|file| file.table()).unwrap_err().to_string()
    }

    #[test]
    fn a_table_of_three_keys_is_enough() {
        let table = RatioFile::from_toml(PLAIN).unwrap().table().unwrap();
        assert_eq!(table.values()[2].to_num::<f64>(), 1.8f64.mul_add(8192.0, 0.5).floor() / 8192.0);
        assert_eq!((table.illuminances_lx().len(), table.intervals().len()), (2, 2));
    }

    #[test]
    fn a_table_notes_its_carrier_and_one_without_a_note_is_for_still_panels() {
        let still = RatioFile::from_toml(PLAIN).unwrap();
        assert!(still.waveform.is_still() && !still.to_toml().contains("carrier_cycles"));
        let carried = RatioFile::from_toml(&format!("carrier_cycles = 16\n{PLAIN}")).unwrap();
        assert_eq!(carried.waveform.cycles(), 16);
        assert_eq!(RatioFile::from_toml(&carried.to_toml()).unwrap(), carried);
        assert_eq!(carried.table().unwrap(), still.table().unwrap());
    }

    #[test]
    fn faults_are_told_with_their_place() {
        for (from, to, words) in [
            ("1.8", "nan", &["5000 lx and interval 1", "missing"][..]),
            ("2.9", "4.5", &["5000 lx and interval 2", "4.5", "0.2 to 4"]),
            ("2.9", "inf", &["inf", "0.2 to 4"]),
            ("1.8, ", "", &["row 1", "5000 lx", "1 ratios", "2 intervals"]),
            (", [1.8, 2.9]", "", &["1 rows", "2 illuminances"]),
            ("50, 5000", "5000, 50", &["illuminance", "number 1", "50", "sort"]),
            ("1, 2", "1, 1", &["interval", "number 1", "sort"]),
            ("1, 2", "1, nan", &["interval", "NaN", "0.05 to 15"]),
            ("50, 5000", "0, 5000", &["illuminance", "number 0", "0.01 to 1000000"]),
            ("50, 5000", "", &["2 rows", "0 illuminances"]),
            ("interval", "intervals", &["intervals"]),
            ("illuminance_lx = [50, 5000]\n", "", &["illuminance_lx"]),
            ("50,", "\"dark\",", &["line 1", "dark"]),
            ("illuminance_lx", "format = 2\nilluminance_lx", &["format = 2", "reads format 1"]),
            ("illuminance_lx", "format = 2\nunknown_lx", &["format = 2", "reads format 1"]),
            ("illuminance_lx", "format = -1\nilluminance_lx", &["-1"]),
            (
                "illuminance_lx",
                "carrier_cycles = 1\nilluminance_lx",
                &["carrier_cycles", "1 cycles", "2 to 333"],
            ),
            ("illuminance_lx", "carrier_cycles = -1\nilluminance_lx", &["-1"]),
        ] {
            let complaint = complaint(from, to);
            for word in words {
                assert!(complaint.contains(word), "{from:?} as {to:?} should speak of {word:?}: {complaint}");
            }
        }
    }

    properties! {
        #[test]
        fn no_text_panics(text in "[a-z0-9_= \\[\\],.\n-]{0,80}") {
            if let Ok(file) = RatioFile::from_toml(&format!("{PLAIN}{text}")) {
                let _ = file.table();
            }
        }
    }
}
