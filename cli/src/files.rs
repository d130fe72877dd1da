//! Files that are written whole or not at all.

use std::fs::File;
use std::path::Path;

use anyhow::Context;

/// Writes a file.
///
/// # Errors
/// As [`write_aside`].
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    write_aside(path, |aside| Ok(std::fs::write(aside, bytes)?))
}

/// Writes a file beside its place and then moves it there, so that nobody finds half a file, not even after a power cut.
///
/// # Errors
/// Those of `write`, and when the file cannot be moved; what was there before is untouched.
pub fn write_aside(
    path: &Path,
    write: impl FnOnce(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let unwritten = || format!("cannot write {}", path.display());
    // A device or a pipe is written to, not replaced.
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return write(path).with_context(unwritten);
    }
    let mut name = path
        .file_name()
        .with_context(|| format!("{} names no file", path.display()))?
        .to_os_string();
    // Two programs may write the same file.
    name.push(format!(".{}.part", std::process::id()));
    let aside = path.with_file_name(name);
    let written = write(&aside).and_then(|()| {
        File::open(&aside)?.sync_all()?;
        Ok(std::fs::rename(&aside, path)?)
    });
    written.map_err(|error| {
        // What is left of it is of no use; that it cannot be removed changes nothing.
        let _ = std::fs::remove_file(&aside);
        error.context(unwritten())
    })
}
