//! The frames of a recording, by name.

use std::path::PathBuf;

use anyhow::{Context, ensure};

/// The frames of folders, in the order of their names, and single files.
pub fn of(sources: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut frames = Vec::new();
    for source in sources {
        ensure!(
            source.as_os_str() != "-",
            "standard input (-) cannot be mixed with files: give it alone"
        );
        if !source.is_dir() {
            frames.push(source.clone());
            continue;
        }
        let entries = std::fs::read_dir(source)
            .with_context(|| format!("cannot read the folder {}", source.display()))?;
        let mut inside = entries
            .map(|entry| Ok(entry?.path()))
            .collect::<std::io::Result<Vec<_>>>()
            .with_context(|| format!("cannot read the folder {}", source.display()))?;
        inside.retain(|path| {
            path.extension().is_some_and(|kind| {
                ["png", "jpg", "jpeg", "pgm"]
                    .iter()
                    .any(|known| kind.eq_ignore_ascii_case(known))
            })
        });
        ensure!(
            !inside.is_empty(),
            "the folder {} has no PNG, JPEG or PGM files",
            source.display()
        );
        inside.sort();
        frames.extend(inside);
    }
    Ok(frames)
}
