//! Advice for sources whose names are neither pictures nor films.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::address::{SCHEMES, is_read, scheme};
use super::live::Live;
use super::{files, film, secrets};

/// Advice if a source is unreadable by its name; `None` if it may be readable.
pub fn advice(source: &Path) -> Option<String> {
    if let Some(advice) = address(source) {
        return Some(advice);
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

/// Advice if the source is an address that is not read.
pub fn address(source: &Path) -> Option<String> {
    let scheme = scheme(source).filter(|scheme| !is_read(scheme))?;
    let name = secrets::masked(&source.to_string_lossy());
    Some(match &*scheme {
        "file" => format!("{name} is the address of a file: give its path, without file://"),
        _ => format!(
            "{name} begins with {scheme}://, and vocc reads {}: download the file, or, if ffmpeg can read it there, pipe it, \
             by `{}`",
            SCHEMES.join(", "),
            film::pipe("", &name)
        ),
    })
}

/// Advice if the source has more frames than one picture. A picture is one whatever its name.
pub fn many_frames(source: &Path) -> Option<String> {
    if source.is_file() {
        let is_film = film::is_one(source) && !begins_as_picture(source);
        return is_film.then(|| film::alone(source));
    }
    let what = match Live::of(source) {
        Some(Live::Camera(_)) => "a camera",
        Some(Live::Address(_)) => "an address",
        _ => return address(source),
    };
    let name = secrets::masked(&source.to_string_lossy());
    Some(format!(
        "{name} is {what}, and this command reads pictures: `vocc receive {name}` reads its messages"
    ))
}

/// Whether a file begins with the signature of any picture format.
fn begins_as_picture(source: &Path) -> bool {
    let mut first = Vec::new();
    let read = File::open(source).and_then(|file| file.take(64).read_to_end(&mut first));
    // Opening the file reports read errors.
    read.is_err() || image::guess_format(&first).is_ok()
}
