//! A figure: drawing, numbers and caption.

use std::path::Path;

use crate::files;
use crate::plot::{self, Drawing};

/// A finished figure.
pub struct Figure {
    /// The name of its files.
    pub name: &'static str,
    pub caption: String,
    pub drawing: Drawing,
    pub csv: String,
}

impl Figure {
    /// Writes the figure to `folder` as SVG, PNG and CSV.
    pub fn save(&self, folder: &Path) -> anyhow::Result<()> {
        let stem = folder.join(self.name);
        plot::save(&stem, &self.drawing)?;
        files::write(&stem.with_extension("csv"), &self.csv)
    }
}

/// Formats a table as comma-separated values, with quotes as needed.
pub fn csv(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> anyhow::Result<String> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(head)?;
    rows.into_iter().try_for_each(|row| table.write_record(row))?;
    Ok(String::from_utf8(table.into_inner()?)?)
}
