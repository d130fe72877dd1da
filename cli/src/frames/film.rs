//! Films and live sources: ffmpeg decodes them, and what it writes is read as a y4m stream, whose header has the size and the frames a
//! second. Films of y4m need no ffmpeg.

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
use crate::output::{self, tell};
use crate::stop;

/// How the names of films end that ffmpeg decodes.
const FILMS: [&str; 42] = [
    "mp4", "m4v", "mov", "qt", "mkv", "webm", "avi", "mts", "m2ts", "m2t", "ts", "tp", "trp", "mpg", "mpeg", "mpe", "m1v", "m2v", "vob",
    "mod", "tod", "3gp", "3g2", "wmv", "asf", "flv", "f4v", "mxf", "gxf", "ogv", "ogg", "nut", "gif", "dv", "dif", "insv", "lrv", "dav",
    "av1", "obu", "ivf", "divx",
];
/// How those end that are bare pictures, one after another, and tell neither their rate nor their times.
const BARE: [&str; 9] = ["mjpeg", "mjpg", "h264", "264", "avc", "h265", "265", "hevc", "h26l"];
/// How those end that need no decoding.
const PLAIN: [&str; 1] = ["y4m"];
/// What y4m frames may be made of; ffmpeg changes to the nearest of these where a film is of something else.
const PIXELS: &str = "format=yuv420p|yuv422p|yuv444p|gray";
/// Gives each frame its number as its time, so that ffmpeg neither fills gaps with copies nor leaves frames out.
const ONE_BY_ONE: &str = "setpts=N/(FRAME_RATE*TB)";
/// Lets ffmpeg tell when each frame was taken, under a name of its own.
const TELL_TIMES: &str = "showinfo@times=checksum=0";
/// What it then begins its lines with.
const TIMES: &str = "[showinfo@times";
/// As much is kept of what ffmpeg says.
const LINES_MAX: usize = 3;
/// ffmpeg tells a frame's time before it writes the frame. It is waited for no longer than this.
const PATIENCE: Duration = Duration::from_secs(10);
/// Between two looks at whether the program is to stop.
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Whether a file's name is that of a film.
pub fn is_one(path: &Path) -> bool {
    has_ending(path, &FILMS) || is_bare(path) || is_plain(path)
}

/// Whether it is that of one which does not tell its rate.
pub fn is_bare(path: &Path) -> bool {
    has_ending(path, &BARE)
}

/// Whether it is that of one that needs no decoding.
pub fn is_plain(path: &Path) -> bool {
    has_ending(path, &PLAIN)
}

/// When a frame was taken, as a film tells it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameTime {
    pub time_s: f64,
    /// The film tells times in multiples of this.
    pub tick_s: f64,
    /// The film's frames a second, where it has some.
    pub rate_hz: Option<f64>,
}

/// The times of a film's frames, in their order.
pub struct FrameTimes(Receiver<Option<FrameTime>>);

impl FrameTimes {
    /// The time of the next frame, which has been read; none where the film has none for it.
    ///
    /// # Errors
    /// If ffmpeg reports no further frame in time, or no frames any more.
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

/// The command by which ffmpeg reads an input, which may need options before it, and `vocc receive` what it writes.
pub fn pipe(options: &str, input: &str) -> String {
    let input = input.replace('\'', r"'\''");
    format!("ffmpeg {options}-i '{input}' -pix_fmt yuv420p -f yuv4mpegpipe - | vocc receive -")
}

/// A film or a live source while it is read.
pub struct Film {
    name: String,
    /// What ffmpeg calls it, where that is more than its name: an address with a password.
    address: Option<String>,
    /// What ffmpeg says, if it is at work.
    said: Option<JoinHandle<Vec<String>>>,
    times: Option<FrameTimes>,
}

impl Film {
    /// Opens a film: what can be read is a y4m stream. `shows` tells the command by which ffmpeg is run.
    pub fn open(path: &Path, shows: bool) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let name = path.display().to_string();
        if is_plain(path) {
            return Ok((Self::of(name, None), Box::new(file)));
        }
        Self::of(name, None).decoded(decoder(&local(path)), shows, |name| {
            format!(
                "{name} is a film, and ffmpeg, which decodes films, is not on the PATH: install it, or make the film plain on a computer \
                 that has it, by `ffmpeg -i {name} -pix_fmt yuv420p -f yuv4mpegpipe film.y4m`, which `vocc receive film.y4m` reads, as \
                 `vocc receive -` does from a pipe"
            )
        })
    }

    /// Opens a live source likewise, by further `options` of ffmpeg.
    pub fn open_live(source: &Live, options: &str, shows: bool) -> anyhow::Result<(Self, Box<dyn Read + Send>)> {
        let film = Self::of(source.name(), source.address().map(str::to_owned));
        film.decoded(decoder(&source.input(options)), shows, |name| {
            format!(
                "ffmpeg, which reads {name}, is not on the PATH: install it, or pipe y4m into `vocc receive -` from a computer that has it"
            )
        })
    }

    fn of(name: String, address: Option<String>) -> Self {
        Self {
            name,
            address,
            said: None,
            times: None,
        }
    }

    /// A text with its name in place of its address.
    fn named(&self, text: &str) -> String {
        match &self.address {
            Some(address) => text.replace(address, &self.name),
            None => text.into(),
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
            tell(self.named(&shown(&ffmpeg)));
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

    /// The times of its frames, if it tells them.
    pub fn take_times(&mut self) -> Option<FrameTimes> {
        self.times.take()
    }

    /// Waits for the end of the decoder, once all frames are read; at once where the program is to stop.
    pub fn end(mut self) -> anyhow::Result<()> {
        let Some(said) = self.said.take() else {
            return Ok(());
        };
        let Some(status) = stop::wait_for_other() else {
            return Ok(());
        };
        let said = self.named(&said.join().unwrap_or_default().join("; "));
        let name = &self.name;
        ensure!(
            !said.contains("matches no streams"),
            "{name} has no moving pictures: it is sound alone, or a cover with it"
        );
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

/// ffmpeg's options for a local file. It then reads local files only, whatever the film names.
pub fn local(path: &Path) -> Vec<OsString> {
    // ffmpeg would read a name with a colon as a protocol's.
    let mut name = OsString::from("file:");
    name.push(path);
    vec!["-protocol_whitelist".into(), "file".into(), "-i".into(), name]
}

/// What decodes an input, and takes nothing from the terminal.
fn decoder(input: &[OsString]) -> Command {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-nostdin", "-hide_banner", "-nostats", "-loglevel", "repeat+level+info"]);
    ffmpeg.args(input);
    // The first that is no cover.
    ffmpeg.args(["-map", "0:V:0", "-vf", &[TELL_TIMES, ONE_BY_ONE, PIXELS].join(",")]);
    ffmpeg.args(["-flush_packets", "1", "-f", "yuv4mpegpipe", "-"]);
    ffmpeg.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    ffmpeg
}

/// A command as a shell takes it.
fn shown(command: &Command) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:/=+@".contains(c);
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words = words.map(|word| {
        let word = output::name(Path::new(word));
        match word.chars().all(plain) {
            true => word,
            false => format!("'{}'", word.replace('\'', r"'\''")),
        }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Passes the times of frames on, and keeps the last lines that tell of faults.
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

/// The words of a line that reports a fault, or is not ffmpeg's, without the part of ffmpeg that speaks and its place in memory. Lines that
/// begin with a blank go on with a film's own description.
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

/// The unit of ffmpeg's times.
#[derive(Default)]
struct Clock {
    tick_s: Option<f64>,
    rate_hz: Option<f64>,
}

impl Clock {
    /// The time of a frame, if a line is about one: none where the film has none for it.
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

/// The word behind a key.
fn after<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = line.split_once(key)?;
    rest.split([' ', ',']).find(|word| !word.is_empty())
}

/// "1/15360" as a number above 0.
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
        // A frame before the clock is known, one with a time, and one for which the film has none.
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
