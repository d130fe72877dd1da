//! Which LED-to-ambient ratio a panel of the scene is driven to.

use link::l2a_table::{L2A_MAX, L2A_MIN, L2aTable, TableError};
use serde::Deserialize;

use crate::scene::{L2a, Panel, Scene};

/// Why the table of `link.table` cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum L2aError {
    /// The file cannot be read.
    #[error("cannot read link.table {path:?}: {source}")]
    Read {
        /// The file.
        path: String,
        /// Why not.
        source: std::io::Error,
    },
    /// The file is no table.
    #[error("link.table {path:?}: {source}")]
    Parse {
        /// The file.
        path: String,
        /// Where and what.
        source: Box<toml::de::Error>,
    },
    /// A ratio that no transmitter carries.
    #[error(
        "link.l2a = {ratio}: a transmitter keeps to {L2A_MIN} to {L2A_MAX}; other ratios can be rendered and evaluated, but not sent"
    )]
    Ratio {
        /// The ratio.
        ratio: f64,
    },
    /// A row of the table that is longer or shorter than its axis.
    #[error("link.table: row {row} of l2a has {found} ratios, and there are {wanted} intervals")]
    Ragged {
        /// Which row, from 0.
        row: usize,
        /// Its length.
        found: usize,
        /// The length it should have.
        wanted: usize,
    },
    /// Its numbers are not allowed.
    #[error("link.table: {0}")]
    Invalid(#[from] TableError),
}

/// A table file: one row of ratios for each illuminance, one column for each interval.
#[derive(Clone, Debug, Deserialize)]
struct TableFile {
    illuminance_lx: Vec<f32>,
    interval: Vec<f32>,
    l2a: Vec<Vec<f32>>,
}

/// The table of the file `path`.
///
/// # Errors
/// When it cannot be read, is not TOML with `illuminance_lx`, `interval` and `l2a`, or holds what no table may hold.
pub fn read_table(path: &str) -> Result<L2aTable, L2aError> {
    let text = std::fs::read_to_string(path).map_err(|source| L2aError::Read {
        path: path.into(),
        source,
    })?;
    let file: TableFile = toml::from_str(&text).map_err(|source| L2aError::Parse {
        path: path.into(),
        source: Box::new(source),
    })?;
    let wanted = file.interval.len();
    let ragged = file
        .l2a
        .iter()
        .enumerate()
        .find(|(_, row)| row.len() != wanted);
    if let Some((row, ratios)) = ragged {
        return Err(L2aError::Ragged {
            row,
            found: ratios.len(),
            wanted,
        });
    }
    Ok(L2aTable::new(
        &file.illuminance_lx,
        &file.interval,
        &file.l2a.concat(),
    )?)
}

/// The table that the scene's transmitter carries: that of `link.table`, the shipped one without it, or, where
/// `link.l2a` is a number, a table of that number alone.
///
/// # Errors
/// As [`read_table`].
pub fn table_of(scene: &Scene) -> Result<L2aTable, L2aError> {
    match (&scene.link.l2a, &scene.link.table) {
        (L2a::Ratio(ratio), _) if !(f64::from(L2A_MIN)..=f64::from(L2A_MAX)).contains(ratio) => {
            Err(L2aError::Ratio { ratio: *ratio })
        }
        (L2a::Ratio(ratio), _) => Ok(L2aTable::new(&[1.0], &[1.0], &[*ratio as f32])?),
        (L2a::Table(_), Some(path)) => read_table(path),
        (L2a::Table(_), None) => Ok(L2aTable::placeholder()),
    }
}

/// The luminance of an On LED of `panel` at full duty: its top luminance, or, where that is unlimited, what the highest
/// ratio of a transmitter asks for in the scene's light.
pub fn full_luminance_cd_m2(scene: &Scene, panel: &Panel) -> f64 {
    let unlimited = f64::from(L2A_MAX) * scene.ambient.illuminance_lx * panel.reflectance;
    panel.luminance_max_cd_m2.unwrap_or(unlimited)
}

/// The ratio for `panel` in the scene's light.
///
/// # Errors
/// As [`read_table`].
pub fn of_panel(scene: &Scene, panel: &Panel) -> Result<f64, L2aError> {
    if let L2a::Ratio(ratio) = scene.link.l2a {
        return Ok(ratio);
    }
    let table = table_of(scene)?;
    let illuminance =
        link::l2a_table::Illuminance::saturating_from_num(scene.ambient.illuminance_lx);
    let interval = link::l2a_table::Interval::saturating_from_num(panel.interval);
    Ok(table.l2a(illuminance, interval).to_num())
}
