//! The LED-to-ambient ratio of a panel of the scene.

pub mod file;
mod other_waveform;

use std::path::Path;

use link::l2a_table::{L2A_MAX, L2A_MIN, L2aTable, TableError};
use link::waveform::Waveform;

use self::file::{FileError, RatioFile};
pub use self::other_waveform::OtherWaveform;
use crate::scene::{L2a, Panel, Scene};

/// Why there is no ratio.
#[derive(Debug, thiserror::Error)]
pub enum L2aError {
    /// The file of `link.table` cannot be used.
    #[error("link.table: {0}")]
    Table(#[from] FileError),
    /// A ratio out of the transmitters' range.
    #[error("link.l2a = {ratio}: a transmitter keeps to {L2A_MIN} to {L2A_MAX}; other ratios can be rendered and evaluated, but not sent")]
    Ratio {
        /// The ratio.
        ratio: f64,
    },
    /// The ratio does not make a table.
    #[error(transparent)]
    Invalid(#[from] TableError),
}

/// The table of a file.
///
/// # Errors
/// If it cannot be read, or is invalid: see [`file::Fault`].
pub fn read_table(path: &Path) -> Result<L2aTable, FileError> {
    file::read_with(path, |text| RatioFile::from_toml(text)?.table())
}

/// The file of a table: [`read_table`] returns exactly the same table.
///
/// Each number is the shortest that rounds to the table's.
///
/// ```
/// use link::l2a_table::L2aTable;
/// let table = L2aTable::new(&[50.0, 5000.0], &[1.0], &[2.05, 1.8])?;
/// assert_eq!(
///     sim::l2a::table_file(&table),
///     "format = 1\nilluminance_lx = [50.0, 5000.0]\ninterval = [1.0]\nl2a = [\n  [2.05],\n  [1.8],\n]\n"
/// );
/// # Ok::<(), link::l2a_table::TableError>(())
/// ```
pub fn table_file(table: &L2aTable) -> String {
    let illuminances: Vec<String> = table.illuminances_lx().iter().map(decimal).collect();
    let intervals: Vec<String> = table.intervals().iter().map(decimal).collect();
    let values: Vec<String> = table.values().iter().map(decimal).collect();
    let rows: String = values
        .chunks(intervals.len())
        .map(|row| format!("  [{}],\n", row.join(", ")))
        .collect();
    format!(
        "format = 1\nilluminance_lx = [{}]\ninterval = [{}]\nl2a = [\n{rows}]\n",
        illuminances.join(", "),
        intervals.join(", ")
    )
}

/// A number of a table in TOML's notation of fractions: with a point.
fn decimal(number: &impl std::fmt::Display) -> String {
    let text = number.to_string();
    if text.contains('.') { text } else { text + ".0" }
}

/// The table of the scene's transmitter: that of `link.table`, the shipped one without it, or, if `link.l2a` is a number, a table of that
/// number alone.
///
/// # Errors
/// As [`read_table`].
pub fn table_of(scene: &Scene) -> Result<L2aTable, L2aError> {
    match (&scene.link.l2a, &scene.link.table) {
        (L2a::Ratio(ratio), _) if !(f64::from(L2A_MIN)..=f64::from(L2A_MAX)).contains(ratio) => Err(L2aError::Ratio { ratio: *ratio }),
        (L2a::Ratio(ratio), _) => Ok(L2aTable::new(&[1.0], &[1.0], &[*ratio as f32])?),
        (L2a::Table(_), Some(path)) => Ok(read_table(Path::new(path))?),
        (L2a::Table(_), None) => Ok(L2aTable::shipped()),
    }
}

/// The waveform that the shipped table is made for.
pub const SHIPPED_FOR: Waveform = Waveform::STILL;

/// The waveform that the table of the scene's transmitter is made for: still panels unless `link.table` notes another. `None` if `link.l2a`
/// is a number.
///
/// # Errors
/// As [`read_table`].
pub fn waveform_of_table(scene: &Scene) -> Result<Option<Waveform>, FileError> {
    Ok(match (&scene.link.l2a, &scene.link.table) {
        (L2a::Ratio(_), _) => None,
        (L2a::Table(_), Some(path)) => Some(RatioFile::read(Path::new(path))?.waveform),
        (L2a::Table(_), None) => Some(SHIPPED_FOR),
    })
}

/// The luminance of an On LED of `panel` at full duty: its full luminance, or, if that is unlimited, the luminance of a transmitter's
/// highest ratio in the scene's light.
pub(crate) fn full_luminance_cd_m2(scene: &Scene, panel: &Panel) -> f64 {
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
    let illuminance = link::l2a_table::Illuminance::saturating_from_num(scene.ambient.illuminance_lx);
    let interval = link::l2a_table::Interval::saturating_from_num(panel.interval);
    Ok(table.l2a(illuminance, interval).to_num())
}
