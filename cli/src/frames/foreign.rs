//! Advice for sources whose names are neither pictures nor films.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{files, film, secrets};

/// Advice if a source is unreadable by its name; `None` if it may be readable.
pub fn advice(source: &Path) -> Option<String> {
    if is_address(source) {
        let name = secrets::masked(&source.to_string_lossy());
        return Some(format!(
            "{name} is an address, and files are read here: pipe what is there, by `{}`",
            film::pipe("", &name)
        ));
    }
    let name = source.display();
    let pipe = |options| film::pipe(options, &name.to_string());
    let is_foreign = source.is_file() && !files::is_picture(source) && !film::is_one(source) && !begins_as_picture(source);
    is_foreign.then(|| {
        format!(
            "{name} is neither a picture (PNG, JPEG, PGM) nor, by its ending, a film: pipe what ffmpeg can read, by `{}`, and raw grey \
             bytes by `vocc receive - --raw WIDTHxHEIGHT < {name}`",
            pipe("")
        )
    })
}

/// Whether it is a URL, and no file.
pub fn is_address(source: &Path) -> bool {
    let text = source.to_string_lossy();
    let scheme = text.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|scheme| !scheme.is_empty() && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte)))
        && !source.exists()
}

/// Whether a file begins with the signature of any picture format.
fn begins_as_picture(source: &Path) -> bool {
    let mut first = Vec::new();
    let read = File::open(source).and_then(|file| file.take(64).read_to_end(&mut first));
    // Opening the file reports read errors.
    read.is_err() || image::guess_format(&first).is_ok()
}
