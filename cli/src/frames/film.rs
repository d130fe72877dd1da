//! Films and live sources: ffmpeg decodes them into a y4m stream, whose header has the size and the frame rate. Films of y4m do not need
//! ffmpeg.

use std::ffi::OsString;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::process::{ChildStderr, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use studies::stop::Stop;

use super::live::Live;
use super::names::has_ending;
use super::secrets::{self, Secrets};
use crate::output::{self, tell};
use crate::stop;

/// File extensions of films that ffmpeg decodes.
const FILMS: [&str; 42] = [
    "mp4", "m4v", "mov", "qt", "mkv", "webm", "avi", "mts", "m2ts", "m2t", "ts", "tp", "trp", "mpg", "mpeg", "mpe", "m1v", "m2v", "vob",
    "mod", "tod", "3gp", "3g2", "wmv", "asf", "flv", "f4v", "mxf", "gxf", "ogv", "ogg", "nut", "gif", "dv", "dif", "insv", "lrv", "dav",
    "av1", "obu", "ivf", "divx",
];
/// Extensions of bare picture streams, which have neither frame rate nor times.
const BARE: [&str; 9] = ["mjpeg", "mjpg", "h264", "264", "avc", "h265", "265", "hevc", "h26l"];
/// Extensions of films that need no decoding.
const PLAIN: [&str; 1] = ["y4m"];
/// Supported pixel formats of y4m; ffmpeg converts others to the nearest one.
const PIXELS: &str = "format=yuv420p|yuv422p|yuv444p|gray";
/// Sets each frame's number as its time, so that ffmpeg neither duplicates nor drops frames.
const ONE_BY_ONE: &str = "setpts=N/(FRAME_RATE*TB)";
/// Makes ffmpeg log each frame's time, under a name of its own.
const TELL_TIMES: &str = "showinfo@times=checksum=0";
/// Prefix of these log lines.
const TIMES: &str = "[showinfo@times";
/// Number of ffmpeg's last log lines kept.
const LINES_MAX: usize = 3;
/// Maximum wait for a frame's time, which ffmpeg logs before it writes the frame.
const PATIENCE: Duration = Duration::from_secs(10);
/// Interval between two checks of the stop flag.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Whether a file's name is a film's.
pub fn is_one(path: &Path) -> bool {
    has_ending(path, &FILMS) || is_bare(path) || is_plain(path)
}

/// Whether the film's format has no frame rate.
pub fn is_bare(path: &Path) -> bool {
    has_ending(path, &BARE)
}

/// Whether the film needs no decoding.
pub fn is_plain(path: &Path) -> bool {
    has_ending(path, &PLAIN)
}

/// A frame's time in its film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTime {
    pub time_s: f64,
    /// Resolution of the film's times.
    pub tick_s: f64,
    /// The film's frame rate, if it has one.
    pub rate_hz: Option<f64>,
}

/// The times of a film's frames, in order.
pub struct FrameTimes(Receiver<Option<FrameTime>>);

impl FrameTimes {
    /// The time of the next frame, which has been read; `None` if the film has none for it.
    ///
    /// # Errors
    /// If ffmpeg logs no further frame in time, or has ended.
    pub fn next(&mut self, stop: Stop) -> Result<Option<FrameTime>, RecvTimeoutError> {
        let begun = Instant::now();
        loop {
            let told = self.0.recv_timeout(LOOK_EVERY);
            let is_over = stop.is_asked() || begun.elapsed() >= PATIENCE;
            if told != Err(RecvTimeoutError::Timeout) || is_over {
                return told;
            }
        }
    }
}

/// The command that pipes an input into `vocc receive`; `options` precede the input.
pub fn pipe(options: &str, input: &str) -> String {
    let input = input.replace('\'', r"'\''");
    format!("ffmpeg {options}-i '{input}' -pix_fmt yuv420p -f yuv4mpegpipe - | vocc receive -")
}

/// Advice for a film that was given in place of pictures.
pub fn alone(film: &Path) -> String {
    format!(
        "{0} is a film: `vocc receive {0}` reads its messages if it is the only source; `ffmpeg -i {0} frame-%06d.png` makes frames of it",
        film.display()
    )
}

/// A film or a live source being read.
pub struct Film {
    name: String,
    /// Hidden in ffmpeg's command and in what ffmpeg prints.
    secrets: Secrets,
    /// ffmpeg's log, if it runs.
    said: Option<JoinHandle<Vec<String>>>,
    times: Option<FrameTimes>,
}

impl Film {
    /// Opens a film as a y4m stream. `shows` prints ffmpeg's command.
    pub fn open(path: &Path, shows: bool) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let name = path.display().to_string();
        if is_plain(path) {
            return Ok((Self::of(name, Secrets::default()), Box::new(file)));
        }
        Self::of(name, Secrets::default()).decoded(decoder(&local(path)), shows, |name| {
            format!(
                "{name} is a film, and ffmpeg, which decodes films, is not on the PATH: install it, or make the film plain on a computer \
                 that has it, by `ffmpeg -i {name} -pix_fmt yuv420p -f yuv4mpegpipe film.y4m`, which `vocc receive film.y4m` reads, as \
                 `vocc receive -` does from a pipe"
            )
        })
    }

    /// Opens a live source in the same way, with more `options` for ffmpeg.
    pub fn open_live(source: &Live, options: &str, shows: bool) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        let film = Self::of(source.name(), Secrets::of(source.address(), options));
        film.decoded(decoder(&source.input(options)), shows, |name| {
            format!(
                "ffmpeg, which reads {name}, is not on the PATH: install it, or pipe y4m into `vocc receive -` from a computer that has it"
            )
        })
    }

    fn of(name: String, secrets: Secrets) -> Self {
        Self {
            name,
            secrets,
            said: None,
            times: None,
        }
    }

    /// Starts ffmpeg.
    fn decoded(
        mut self,
        mut ffmpeg: Command,
        shows: bool,
        without: impl FnOnce(&str) -> String,
    ) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        if shows {
            tell(shown(&ffmpeg, &self.secrets));
        }
        let mut decoder = ffmpeg.spawn().map_err(|error| match error.kind() {
            ErrorKind::NotFound => anyhow::anyhow!(without(&self.name)),
            _ => anyhow::Error::from(error).context("cannot start ffmpeg"),
        })?;
        let (frames, said) = (decoder.stdout.take(), decoder.stderr.take());
        stop::end_with(decoder);
        let (Some(frames), Some(said)) = (frames, said) else {
            bail!("cannot read what ffmpeg writes");
        };
        let (sender, times) = channel();
        self.said = Some(std::thread::Builder::new().spawn(move || listen(said, &sender))?);
        self.times = Some(FrameTimes(times));
        Ok((self, Box::new(frames)))
    }

    /// The times of its frames, if available.
    pub fn take_times(&mut self) -> Option<FrameTimes> {
        self.times.take()
    }

    /// Waits for the decoder to exit after the last frame, or kills it if the program stops.
    pub fn end(mut self) -> anyhow::Result<()> {
        let Some(said) = self.said.take() else {
            return Ok(());
        };
        let Some(status) = stop::wait_for_other() else {
            return Ok(());
        };
        let said = said.join().unwrap_or_default().join("; ");
        let name = &self.name;
        ensure!(
            !said.contains("matches no streams"),
            "{name} has no video: it has only sound, or a cover picture"
        );
        let said = self.secrets.hide(&said);
        ensure!(status.success(), "ffmpeg cannot decode {name} ({status}): {said}");
        if !said.is_empty() {
            tell(format_args!("ffmpeg says of {name}: {said}"));
        }
        Ok(())
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        stop::end_other();
    }
}

/// ffmpeg's options for a local file, which restrict it to local files whatever the film refers to.
pub fn local(path: &Path) -> Vec<OsString> {
    // ffmpeg parses a name with a colon as a protocol.
    let mut name = OsString::from("file:");
    name.push(path);
    vec!["-protocol_whitelist".into(), "file".into(), "-i".into(), name]
}

/// The decoder command for an input, with no access to the terminal.
fn decoder(input: &[OsString]) -> Command {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "repeat+level+info"]);
    ffmpeg.args(input);
    // The first video stream that is not a cover picture.
    ffmpeg.args(["-map", "0:V:0", "-vf", &[TELL_TIMES, ONE_BY_ONE, PIXELS].join(",")]);
    ffmpeg.args(["-flush_packets", "1", "-f", "yuv4mpegpipe", "-"]);
    ffmpeg.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ffmpeg
}

/// Formats a command for a shell.
fn shown(command: &Command, secrets: &Secrets) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:/=+@".contains(c);
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words = words.map(|word| {
        // Hidden first: quotes and escapes may change a password.
        let word = match word.to_str() {
            Some(text) => output::name(Path::new(&secrets.hide(text))),
            None => output::name(Path::new(word)),
        };
        match word.replace(secrets::HIDDEN, "").chars().all(plain) {
            true => word,
            false => format!("'{}'", word.replace('\'', r"'\''")),
        }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Forwards the frames' times, and keeps the last error lines.
fn listen(said: ChildStderr, times: &Sender<Option<FrameTime>>) -> Vec<String> {
    let mut last = Vec::new();
    let mut clock = Clock::default();
    for line in BufReader::new(said).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line);
        if line.starts_with(TIMES) {
            if let Some(time) = clock.time(&line) {
                // The reader has ended.
                let _ = times.send(time);
            }
        } else if let Some(words) = fault(&line) {
            if last.len() == LINES_MAX {
                last.remove(0);
            }
            last.push(words.to_owned());
        }
    }
    last
}

/// The text of an error line, or of a line that is not ffmpeg's, without ffmpeg's component and address. An indented line continues a
/// film's description.
fn fault(line: &str) -> Option<&str> {
    if line.starts_with(char::is_whitespace) {
        return None;
    }
    let mut words = line;
    while let Some((bracketed, rest)) = words.strip_prefix('[').and_then(|words| words.split_once("] ")) {
        if matches!(bracketed, "info" | "warning" | "verbose" | "debug" | "trace") {
            return None;
        }
        words = rest;
    }
    Some(words.trim()).filter(|words| !words.is_empty())
}

/// The time base of ffmpeg's log.
#[derive(Default)]
struct Clock {
    tick_s: Option<f64>,
    rate_hz: Option<f64>,
}

impl Clock {
    /// A frame's time if the line is about a frame: `Some(None)` if the film has none for it.
    fn time(&mut self, line: &str) -> Option<Option<FrameTime>> {
        if line.contains("config in ") {
            self.tick_s = after(line, "time_base:").and_then(ratio);
            self.rate_hz = after(line, "frame_rate:").and_then(ratio);
            return None;
        }
        let count = after(line, " pts:")?.parse::<f64>().ok();
        Some(count.zip(self.tick_s).map(|(count, tick_s)| FrameTime {
            time_s: count * tick_s,
            tick_s,
            rate_hz: self.rate_hz,
        }))
    }
}

/// The word after a key.
fn after<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = line.split_once(key)?;
    rest.split([' ', ',']).find(|word| !word.is_empty())
}

/// Parses "1/15360" as a positive number.
fn ratio(text: &str) -> Option<f64> {
    let (above, below) = text.split_once('/')?;
    let ratio = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ffmpeg_says_is_times_and_faults() {
        let mut clock = Clock::default();
        let lines = [
            "[showinfo@times @ 0x55] [info] n:   0 pts:      7 pts_time:0.7",
            "[showinfo@times @ 0x55] [info] config in time_base: 1/1000, frame_rate: 30000/1001",
            "[showinfo@times @ 0x55] [info] config out time_base: 0/0, frame_rate: 0/0",
            "[showinfo@times @ 0x55] [info] n:  20 pts:   2100 pts_time:2.1     pos:     7493 fmt:yuv444p sar:1/1 s:320x240 i:P",
            "[showinfo@times @ 0x55] [info] n:  21 pts:NOPTS   pts_time:NOPTS   pos:     7493 fmt:yuv444p sar:1/1 s:320x240 i:P",
            "[showinfo@times @ 0x55] [info] color_range:unknown color_space:unknown",
        ];
        let told: Vec<Option<FrameTime>> = lines.iter().filter_map(|line| clock.time(line)).collect();
        // A frame before the time base is known, one with a time, and one without.
        let [None, Some(told), None] = told[..] else {
            panic!("{told:?}");
        };
        assert!((told.time_s - 2.1).abs() < 1e-12 && told.tick_s == 1e-3);
        assert!(told.rate_hz.is_some_and(|rate_hz| (rate_hz - 29.97).abs() < 1e-3));
        for (line, words) in [
            ("[mov,mp4 @ 0x55] [error] moov atom not found", Some("moov atom not found")),
            ("[error] file:x.mp4: Invalid data", Some("file:x.mp4: Invalid data")),
            ("moov atom not found", Some("moov atom not found")),
            ("[info] Input #0, mov", None),
            ("                    : the second line of a comment", None),
            ("[swscaler @ 0x55] [warning] deprecated pixel format", None),
            ("", None),
        ] {
            assert_eq!(fault(line), words);
        }
    }
}
