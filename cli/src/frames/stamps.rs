//! Times of frames from `timestamps.csv` in their folder, for cameras with an irregular rate or dropped or duplicate frames.
//!
//! Each line has a frame, as file name or the number at its end, and its time in seconds from any origin; a first line of titles is
//! skipped. Between semicolons, as many spreadsheets write them, or in quotes, seconds may have a decimal comma.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use csv::{ReaderBuilder, StringRecord, Trim};
use sim::input;

use super::names::number;

const NAME: &str = "timestamps.csv";
/// Maximum file size in bytes: a million frames.
const BYTES_MAX: u64 = 64 << 20;
/// Maximum time in seconds; beyond, an `f64` has no milliseconds left.
const SECONDS_MAX: f64 = 1e12;

/// Valid frame rates. Milliseconds read as seconds are slower.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1.0..=1e5;

/// A frame's file, its frame number, and its deviation from that number's time in frame periods.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    pub path: PathBuf,
    pub number: u64,
    pub late: f64,
}

/// Frames in order of time.
pub struct Frames {
    pub files: Vec<FrameFile>,
    /// Frames per second from the time stamps.
    pub rate: Option<f32>,
    /// Frames dropped as duplicates of the frame before, by their time stamps.
    pub doubled: usize,
}

/// The time stamps of a folder's frames.
pub struct Stamps {
    path: PathBuf,
    /// Times by key.
    seconds: HashMap<Key, f64>,
    /// Whether the seconds may have decimal commas, and so lack their fractions.
    may_have_commas: bool,
}

/// Identifies a frame: its file name, or the number at the end of the name.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Key {
    Name(String),
    Number(u64),
}

impl Key {
    fn of(frame: &str) -> Self {
        match frame.parse() {
            Ok(number) => Self::Number(number),
            Err(_) => Self::Name(frame.to_owned()),
        }
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Name(name) => write!(f, "{name}"),
            Self::Number(number) => write!(f, "frame {number}"),
        }
    }
}

impl Stamps {
    /// Reads a folder's time stamps; `None` if it has no such file.
    pub fn in_folder(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join(NAME);
        // A broken link, a folder or a pipe of that name is an error.
        if path.symlink_metadata().is_err_and(|error| error.kind() == ErrorKind::NotFound) {
            return Ok(None);
        }
        let about = || format!("cannot read the time stamps {}", path.display());
        let text = input::read_text(&path, BYTES_MAX).with_context(about)?;
        let mut told = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
        let has_semicolons = told.all(|line| line.contains(';'));
        let mut lines = ReaderBuilder::new()
            .delimiter(if has_semicolons { b';' } else { b',' })
            .has_headers(false)
            .flexible(true)
            .trim(Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let mut seconds = HashMap::new();
        // True if each line has whole seconds followed by a whole number.
        let mut may_have_commas = true;
        for (index, line) in lines.records().enumerate() {
            let line = line.with_context(about)?;
            let at = line.position().map_or(0, csv::Position::line);
            match stamp(&line) {
                Some((frame, time_s)) => {
                    may_have_commas &= line.len() == 3 && line.iter().skip(1).all(is_whole);
                    let twice = seconds.insert(Key::of(frame), time_s).is_some();
                    ensure!(
                        !twice,
                        "{}, line {at}: {frame} has two time stamps: remove one of the lines",
                        path.display()
                    );
                }
                None if index == 0 => {}
                None => bail!(
                    "{}, line {at}: {:?} is not a frame and its time in seconds, such as 00012.png,0.4004",
                    path.display(),
                    line.iter().collect::<Vec<_>>().join(",")
                ),
            }
        }
        Ok(Some(Self {
            path,
            seconds,
            may_have_commas,
        }))
    }

    /// Orders the frames by time, and drops each one with the time of the frame before.
    pub fn order(mut self, files: Vec<PathBuf>) -> anyhow::Result<Frames> {
        let mut taken: Vec<(PathBuf, f64)> = Vec::new();
        let count = files.len();
        for path in files {
            let time_s = self.take(&path).with_context(|| {
                format!(
                    "{} has no time stamp in {}: add a line for it, or remove the frame",
                    path.display(),
                    self.path.display()
                )
            })?;
            match taken.last() {
                Some((before, last_s)) if time_s < *last_s => bail!(
                    "the time stamps in {} run backwards: {} was taken at {time_s} s, and {}, which comes before it, at {last_s} s; name \
                     the frames in the order in which they were taken, or correct the stamps",
                    self.path.display(),
                    path.display(),
                    before.display()
                ),
                Some((_, last_s)) if time_s == *last_s => {}
                _ => taken.push((path, time_s)),
            }
        }
        if let Some(frame) = self.seconds.keys().min_by_key(|frame| frame.to_string()) {
            bail!(
                "{} has a time for {frame}, and the folder has no such frame, or another line has one for it too: add the frame, or \
                 remove the line",
                self.path.display()
            );
        }
        let doubled = count - taken.len();
        ensure!(
            !(self.may_have_commas && 2 * doubled >= count),
            "{}: most frames have the time of the one before, so decimal commas seem to have split the seconds in two: write points, or \
             semicolons between frame and seconds",
            self.path.display()
        );
        ensure!(
            doubled == 0 || taken.len() > 1,
            "{}: all {count} frames have the same time, {} s: give each frame's own time, or remove the file",
            self.path.display(),
            taken[0].1
        );
        let times_s: Vec<f64> = taken.iter().map(|(_, time_s)| *time_s).collect();
        let period_s = period_s(&times_s);
        if let Some(rate_hz) = period_s.map(f64::recip) {
            ensure!(
                RATES_HZ.contains(&rate_hz),
                "{}: {rate_hz:.3e} frames a second are not {} to {}: give the times in seconds",
                self.path.display(),
                RATES_HZ.start(),
                RATES_HZ.end()
            );
        }
        let places = places(&times_s, period_s.unwrap_or(1.0));
        let files = taken.into_iter().zip(places);
        Ok(Frames {
            files: files.map(|((path, _), (number, late))| FrameFile { path, number, late }).collect(),
            rate: period_s.map(|period_s| (1.0 / period_s) as f32),
            doubled,
        })
    }

    /// Removes and returns a frame's time.
    fn take(&mut self, path: &Path) -> Option<f64> {
        let name = Key::of(path.file_name()?.to_str()?);
        let number = || number(path).map(Key::Number);
        let by_name = self.seconds.remove(&name);
        by_name.or_else(|| self.seconds.remove(&number()?))
    }
}

/// A frame's name and its time in seconds.
fn stamp(line: &StringRecord) -> Option<(&str, f64)> {
    let (frame, seconds) = (line.get(0)?, line.get(1)?);
    let seconds = seconds.replacen(',', ".", 1).parse().ok()?;
    (!frame.is_empty() && (-SECONDS_MAX..=SECONDS_MAX).contains(&seconds)).then_some((frame, seconds))
}

/// Whether a text is a whole number.
fn is_whole(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// The frame period: the median step, refined over the whole length; `None` for fewer than two frames.
fn period_s(times_s: &[f64]) -> Option<f64> {
    let mut steps_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps_s.sort_by(f64::total_cmp);
    let usual_s = *steps_s.get(steps_s.len() / 2)?;
    let periods: f64 = steps_s.iter().map(|step_s| (step_s / usual_s).round()).sum();
    let all_s: f64 = steps_s.iter().sum();
    Some(all_s / periods.max(1.0))
}

/// Each frame's number, strictly ascending, and its deviation in periods.
fn places(times_s: &[f64], period_s: f64) -> Vec<(u64, f64)> {
    let mut next = 0;
    let from_s = times_s.first().copied().unwrap_or_default();
    let place = |time_s: &f64| {
        let (number, late) = numbered((time_s - from_s) / period_s, next);
        next = number.saturating_add(1);
        (number, late)
    };
    times_s.iter().map(place).collect()
}

/// The number, at least `next`, of a frame taken `periods` frame periods after number 0, and its deviation in periods.
pub fn numbered(periods: f64, next: u64) -> (u64, f64) {
    // The cast turns negative values into 0.
    let number = (periods.round() as u64).max(next);
    (number, periods - number as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn ordered(csv: &str, names: &[&str]) -> anyhow::Result<Frames> {
        let folder = tempfile::tempdir()?;
        std::fs::write(folder.path().join(NAME), csv)?;
        let stamps = Stamps::in_folder(folder.path())?.context("there are some")?;
        stamps.order(names.iter().map(|name| folder.path().join(name)).collect())
    }

    fn numbers(csv: &str, names: &[&str]) -> Vec<u64> {
        let frames = ordered(csv, names).unwrap();
        frames.files.iter().map(|file| file.number).collect()
    }

    #[test]
    fn frames_are_named_or_numbered() {
        let names = ["f08.png", "f09.png", "f10.png", "f13.png"];
        let named = "frame,seconds\nf08.png,5.0\nf09.png,5.1\nf10.png, 5.2\n# two were lost\nf13.png,5.5\n";
        let numbered = "8,5.0\n9,5.1\n10,5.2\n13,5.5";
        for csv in [named, numbered] {
            assert_eq!(numbers(csv, &names), [0, 1, 2, 5]);
            let rate = ordered(csv, &names).unwrap().rate.unwrap();
            assert!((rate - 10.0).abs() < 1e-4, "{rate}");
        }
    }

    #[test]
    fn a_frame_of_the_same_time_is_there_twice() {
        let frames = ordered("1,0\n2,0.04\n3,0.04\n4,0.08", &["1.png", "2.png", "3.png", "4.png"]);
        let frames = frames.unwrap();
        assert_eq!((frames.files.len(), frames.doubled), (3, 1));
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for (csv, why) in [
            ("1,0\n2,0.1\n3,0.05", "run backwards: "),
            ("1,0\n2,0.1", "3.png has no time stamp"),
            ("1,0\n2,soon\n3,0.2", "line 2: \"2,soon\" is not a frame"),
            ("1,0\n2,nan\n3,0.2", "is not a frame and its time"),
            ("1,0\n1,0.1\n2,0.2", "1 has two time stamps"),
            (
                "1,0\n2,0.1\n3,0.2\n4,0.3",
                "has a time for frame 4, and the folder has no such frame",
            ),
            (
                "1,0\n2,33.3\n3,66.7",
                "frames a second are not 1 to 100000: give the times in seconds",
            ),
            ("1,0\n2,1e-300\n3,2e-300", "give the times in seconds"),
            ("1,7.5\n2,7.5\n3,7.5", "all 3 frames have the same time, 7.5 s"),
            ("frame,time\n1,7,500\n2,7,533\n3,7,566", "decimal commas seem to have split"),
            ("\u{0}\u{1}garbage\n\u{7}", "is not a frame and its time"),
        ] {
            let error = ordered(csv, &["1.png", "2.png", "3.png"]).err().expect(csv);
            assert!(format!("{error:#}").contains(why), "{error:#}");
        }
    }

    #[test]
    fn seconds_may_have_decimal_commas() {
        let names = ["f08.png", "f09.png", "f10.png", "f12.png"];
        for csv in [
            "frame;seconds\nf08.png;5,0\nf09.png;5,1\nf10.png;5,2\nf12.png;5,4",
            "8;5.0\n9;5.1\n10;5.2\n12;5.4",
            "8,\"5,0\"\n9,\"5,1\"\n10,\"5,2\"\n12,\"5,4\"",
            // If the whole seconds distinguish the frames, the numbers after them are another column.
            "8,50,1\n9,51,1\n10,52,1\n12,54,1",
        ] {
            assert_eq!(numbers(csv, &names), [0, 1, 2, 4], "{csv}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_cannot_be_read_is_not_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        std::os::unix::fs::symlink("nowhere", &path).unwrap();
        assert!(Stamps::in_folder(folder.path()).is_err());
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert!(Stamps::in_folder(folder.path()).is_err());
    }

    #[test]
    fn a_folder_without_them_has_none() {
        assert!(Stamps::in_folder(tempfile::tempdir().unwrap().path()).unwrap().is_none());
    }

    properties! {
        #[test]
        fn numbers_rise_and_lateness_is_what_is_left(
            steps in prop::collection::vec((1u64..4, -0.3f64..0.3), 2..100), period in 0.005f64..0.2, from in -1e6f64..1e6,
        ) {
            let mut number = 0;
            let times: Vec<f64> = steps.iter().map(|(step, late)| {
                number += step;
                from + period * (number as f64 + late)
            }).collect();
            let found = places(&times, period);
            prop_assert!(found.windows(2).all(|pair| pair[0].0 < pair[1].0));
            for ((number, late), time) in found.iter().zip(&times) {
                prop_assert!((*number as f64 + late - (time - times[0]) / period).abs() < 1e-6);
            }
        }
    }
}
