//! Stub for platforms without files, such as a web page.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

fn no_files<T>() -> Result<T, Error> {
    let why = "files are not available here: omit it, or run the command line";
    Err(Error::new(ErrorKind::Unsupported, why))
}

/// Always false.
pub fn is_there(_path: &Path) -> bool {
    false
}

/// Always fails.
///
/// # Errors
/// Always.
pub fn list(_folder: &Path) -> Result<Vec<PathBuf>, Error> {
    no_files()
}

/// Always fails.
///
/// # Errors
/// Always.
pub fn read(_path: &Path, _most: u64) -> Result<Vec<u8>, Error> {
    no_files()
}
