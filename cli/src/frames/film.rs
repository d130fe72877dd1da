//! Films: ffmpeg decodes them, and what it writes is read as a y4m stream, whose header has the size and the frames a second. Films of
//! y4m need no ffmpeg.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Stdio};
use std::thread::JoinHandle;

use anyhow::{Context, bail, ensure};

use super::names::has_ending;
use crate::output::tell;
use crate::stop;

/// How the names of films end that ffmpeg decodes.
const FILMS: [&str; 12] = ["mp4", "m4v", "mov", "mkv", "webm", "avi", "mts", "ts", "mpg", "mpeg", "3gp", "wmv"];
/// How those end that need no decoding.
const PLAIN: [&str; 1] = ["y4m"];
/// What y4m frames may be made of; ffmpeg changes to the nearest of these where a film is of something else.
const PIXELS: &str = "format=yuv420p|yuv422p|yuv444p|gray";
/// As much is kept of what ffmpeg says.
const LINES_MAX: usize = 3;

/// Whether a file's name is that of a film.
pub fn is_one(path: &Path) -> bool {
    has_ending(path, &FILMS) || has_ending(path, &PLAIN)
}

/// A film while it is read.
pub struct Film {
    path: PathBuf,
    /// What ffmpeg says, if it is at work.
    said: Option<JoinHandle<Vec<String>>>,
}

impl Film {
    /// Opens a film: what can be read is a y4m stream.
    ///
    /// # Errors
    /// When there is no such file, or no ffmpeg that could decode it.
    pub fn open(path: &Path) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        let cannot = || format!("cannot read {}", path.display());
        let file = File::open(path).with_context(cannot)?;
        let mut film = Self {
            path: path.into(),
            said: None,
        };
        if has_ending(path, &PLAIN) {
            return Ok((film, Box::new(file)));
        }
        let mut decoder = decoder(path).spawn().map_err(|error| {
            if error.kind() == ErrorKind::NotFound {
                anyhow::anyhow!(
                    "{0} is a film, and ffmpeg, which decodes films, is not on the PATH: install it, or make the film plain on a \
                     computer that has it, by `ffmpeg -i {0} -f yuv4mpegpipe film.y4m`, which `vocc receive film.y4m` reads, as \
                     `vocc receive -` does from a pipe",
                    path.display()
                )
            } else {
                anyhow::Error::from(error).context("cannot start ffmpeg")
            }
        })?;
        let (frames, said) = (decoder.stdout.take(), decoder.stderr.take());
        stop::end_with(decoder);
        let (Some(frames), Some(said)) = (frames, said) else {
            bail!("cannot read what ffmpeg writes");
        };
        film.said = Some(std::thread::Builder::new().spawn(|| last_lines(said))?);
        Ok((film, Box::new(frames)))
    }

    /// Waits for the end of the decoder, once all frames are read; at once where the program is to stop.
    ///
    /// # Errors
    /// When it could not decode the film, with what it says.
    pub fn end(mut self) -> anyhow::Result<()> {
        let Some(said) = self.said.take() else {
            return Ok(());
        };
        let Some(status) = stop::wait_for_other() else {
            return Ok(());
        };
        let said = said.join().unwrap_or_default().join("; ");
        ensure!(status.success(), "ffmpeg cannot decode {} ({status}): {said}", self.path.display());
        if !said.is_empty() {
            tell(format_args!("ffmpeg says of {}: {said}", self.path.display()));
        }
        Ok(())
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        stop::end_other();
    }
}

/// What decodes a film. It reads local files only, whatever the film names, and nothing from the terminal.
fn decoder(path: &Path) -> Command {
    // A name with a colon would be taken for a protocol's.
    let mut name = std::ffi::OsString::from("file:");
    name.push(path);
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-nostdin", "-hide_banner", "-loglevel", "error"]);
    ffmpeg.args(["-protocol_whitelist", "file", "-i"]).arg(name);
    ffmpeg.args(["-map", "0:v:0", "-vf", PIXELS, "-f", "yuv4mpegpipe", "-"]);
    ffmpeg.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ffmpeg
}

fn last_lines(said: ChildStderr) -> Vec<String> {
    let mut last = Vec::new();
    for line in BufReader::new(said).split(b'\n').map_while(Result::ok) {
        if last.len() == LINES_MAX {
            last.remove(0);
        }
        let line = String::from_utf8_lossy(&line);
        // Which part of ffmpeg speaks, and where that is in its memory, helps nobody.
        let words = line.strip_prefix('[').and_then(|line| line.split_once("] "));
        last.push(words.map_or(&*line, |(_, words)| words).trim().to_owned());
    }
    last
}
