//! Sources that are neither pictures nor films by their names: what helps.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{files, film};

/// What helps where a source cannot be read by its name; none where it may be.
pub fn advice(source: &Path) -> Option<String> {
    let name = source.display();
    let pipe = |options| film::pipe(options, &name.to_string());
    if is_address(source) {
        return Some(format!(
            "{name} is an address, and files are read here: pipe what is there, by `{}`",
            pipe("")
        ));
    }
    let is_foreign = source.is_file() && !files::is_picture(source) && !film::is_one(source) && !begins_as_picture(source);
    is_foreign.then(|| {
        format!(
            "{name} is neither a picture (PNG, JPEG, PGM) nor, by its ending, a film: pipe what ffmpeg can read, by `{}`, and raw grey \
             bytes by `vocc receive - --raw WIDTHxHEIGHT < {name}`",
            pipe("")
        )
    })
}

/// Whether it is a scheme and what follows, and no file.
fn is_address(source: &Path) -> bool {
    let text = source.to_string_lossy();
    let scheme = text.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|scheme| !scheme.is_empty() && scheme.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte)))
        && !source.exists()
}

/// Whether a file's first bytes are those of a picture, of whatever kind.
fn begins_as_picture(source: &Path) -> bool {
    let mut first = Vec::new();
    let read = File::open(source).and_then(|file| file.take(64).read_to_end(&mut first));
    // Opening reports what cannot be read.
    read.is_err() || image::guess_format(&first).is_ok()
}
