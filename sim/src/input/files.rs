//! Files of the computer.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Whether a file or folder of that name exists.
pub fn is_there(path: &Path) -> bool {
    path.exists()
}

/// The content of a folder, sorted by name.
///
/// # Errors
/// If it is not a folder, or cannot be read.
pub fn list(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = std::fs::read_dir(folder)?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, Error>>()?;
    paths.sort();
    Ok(paths)
}

/// The bytes of an ordinary file of at most `most` bytes.
///
/// # Errors
/// If it is a folder, a device or a pipe, is larger, or cannot be read.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    // Opening a pipe without a writer would block.
    if !std::fs::metadata(path)?.is_file() {
        let why = "it is not an ordinary file: give a file, not a folder, a device or a pipe";
        return Err(Error::new(ErrorKind::InvalidInput, why));
    }
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let why = format!("it has more than {most} bytes, which is the limit: check that it is the right file");
        return Err(Error::new(ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}
