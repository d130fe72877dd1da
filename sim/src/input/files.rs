//! Files of the computer.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Whether there is something of that name.
pub fn is_there(path: &Path) -> bool {
    path.exists()
}

/// What a folder holds, in the order of the names.
///
/// # Errors
/// When it is none, or cannot be read.
pub fn list(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let entries = std::fs::read_dir(folder)?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, Error>>()?;
    paths.sort();
    Ok(paths)
}

/// The bytes of an ordinary file that has at most `most`.
///
/// # Errors
/// When it is a folder, a device or a pipe, has more, or cannot be read.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    // A pipe that nobody writes to would be waited for already when it is opened.
    if !std::fs::metadata(path)?.is_file() {
        let why = "it is no ordinary file: give a file, not a folder, a device or a pipe";
        return Err(Error::new(ErrorKind::InvalidInput, why));
    }
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let why = format!("it has more than {most} bytes, the most that are read here: is it the file you meant?");
        return Err(Error::new(ErrorKind::FileTooLarge, why));
    }
    Ok(bytes)
}
