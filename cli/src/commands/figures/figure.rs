//! What one figure is: a drawing, its numbers, and its caption.

use std::path::Path;

use crate::pictures::write_aside;
use crate::plot;

/// A finished figure.
pub struct Figure {
    /// The name of its files.
    pub name: &'static str,
    /// What it shows, in a line or two.
    pub caption: String,
    /// The drawing.
    pub svg: String,
    /// Its numbers.
    pub csv: String,
}

impl Figure {
    /// Writes it to `folder` as SVG, PNG and CSV.
    pub fn save(&self, folder: &Path) -> anyhow::Result<()> {
        let stem = folder.join(self.name);
        plot::save(&stem, &self.svg)?;
        write_aside(&stem.with_extension("csv"), |aside| {
            Ok(std::fs::write(aside, &self.csv)?)
        })
    }
}

/// A table as CSV. Cells hold numbers and plain words.
pub fn csv(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let lines = rows.map(|row| row.join(","));
    std::iter::once(head.join(","))
        .chain(lines)
        .map(|line| line + "\n")
        .collect()
}
