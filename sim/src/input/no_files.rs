//! Where there are no files, as in a page of a browser.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

fn no_files<T>() -> Result<T, Error> {
    let why = "there are no files here: leave it out, or run it on the command line";
    Err(Error::new(ErrorKind::Unsupported, why))
}

/// Nothing is.
pub fn is_there(_path: &Path) -> bool {
    false
}

/// Nothing can be listed.
///
/// # Errors
/// Always.
pub fn list(_folder: &Path) -> Result<Vec<PathBuf>, Error> {
    no_files()
}

/// Nothing can be read.
///
/// # Errors
/// Always.
pub fn read(_path: &Path, _most: u64) -> Result<Vec<u8>, Error> {
    no_files()
}
