//! The files of a recording: one, or as many as a maximum size makes.
//!
//! A file ends before the frame that would exceed the size, and has all its schemas and channels, so that it can be read without the
//! others. A frame's image, outlines, poses and messages are in one file.

use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use anyhow::{Context, bail};

use super::mcap::{Schema, Writer};
use crate::files::{self, Growing};

/// Minimum value of `--max-size`: definitions alone take some kilobytes.
const MAX_SIZE_MIN: u64 = 100_000;
/// Factors of the letters after a size.
const UNITS: [(char, u64); 3] = [('k', 1_000), ('M', 1_000_000), ('G', 1_000_000_000)];

/// Parses a size in bytes, kilobytes, megabytes or gigabytes.
pub fn max_size(text: &str) -> Result<u64, String> {
    let unit = UNITS
        .iter()
        .find_map(|(letter, factor)| Some((text.strip_suffix(*letter)?, *factor)));
    let (digits, factor) = unit.unwrap_or((text, 1));
    let bytes = digits.parse::<u64>().ok().and_then(|number| number.checked_mul(factor));
    bytes
        .filter(|&bytes| bytes >= MAX_SIZE_MIN)
        .ok_or_else(|| format!("give at least {MAX_SIZE_MIN} bytes, as 200000000, 200000k, 200M or 1G"))
}

/// A file that is being written.
type Open = Writer<BufWriter<Growing>>;

/// The files of a recording; the last one is being written.
pub struct Files {
    first: PathBuf,
    /// The current file.
    path: PathBuf,
    number: u32,
    writer: Open,
    is_live: bool,
    max_bytes: Option<u64>,
    /// Whether the current file has messages.
    is_used: bool,
    /// The messages of the current frame (channel, time and content), held if there is a maximum size.
    frame: Vec<(u16, u64, Vec<u8>)>,
    /// The previous file, on its way to the disk.
    ending: Ending,
}

impl Files {
    /// Creates the first file; a live one can be read while it grows.
    pub fn create(path: &Path, max_bytes: Option<u64>, is_live: bool) -> anyhow::Result<Self> {
        if max_bytes.is_some() {
            check_free(path)?;
        }
        Ok(Self {
            first: path.into(),
            path: path.into(),
            number: 0,
            writer: Writer::new(BufWriter::new(grown(path, is_live)?))?,
            is_live,
            max_bytes,
            is_used: false,
            frame: Vec::new(),
            ending: Ending::default(),
        })
    }

    /// The file that is being written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a channel to this file and all later ones, and returns its id.
    pub fn channel(&mut self, topic: &str, schema: Schema) -> u16 {
        self.writer.channel(topic, schema)
    }

    /// Adds a message of the current frame.
    pub fn message(&mut self, channel: u16, time_ns: u64, message: &[u8]) -> anyhow::Result<()> {
        if self.max_bytes.is_some() {
            self.frame.push((channel, time_ns, message.into()));
            return Ok(());
        }
        Ok(self.writer.message(channel, time_ns, message)?)
    }

    /// Ends the current frame, and writes it into the next file if it would make this one too large.
    pub fn end_frame(&mut self) -> anyhow::Result<()> {
        let Some(max_bytes) = self.max_bytes.filter(|_| !self.frame.is_empty()) else {
            return Ok(());
        };
        let frame_bytes = self.frame.iter().map(|(_, _, message)| message.len());
        if self.is_used && self.writer.finished_bytes(frame_bytes) > max_bytes {
            self.begin_next()?;
        }
        for (channel, time_ns, message) in self.frame.drain(..) {
            self.writer.message(channel, time_ns, &message)?;
        }
        self.is_used = true;
        Ok(())
    }

    /// Makes all messages readable.
    pub fn keep(&mut self) -> anyhow::Result<()> {
        self.end_frame()?;
        Ok(self.writer.keep()?)
    }

    /// Finishes the last file.
    pub fn finish(mut self) -> anyhow::Result<()> {
        self.end_frame()?;
        self.ending.join()?;
        let is_alone = self.max_bytes.is_none();
        let file = whole(self.writer)?;
        match is_alone {
            true => Ok(file.keep()?),
            false => files::keep_new(vec![(self.path, file)]),
        }
    }

    /// Begins the next file with the channels of this one.
    fn begin_next(&mut self) -> anyhow::Result<()> {
        self.ending.join()?;
        if self.is_live {
            // The other thread may be late.
            self.writer.keep()?;
        }
        let next = (self.number + 1..).find(|&number| {
            let path = numbered(&self.first, number);
            !is_there(&path)
        });
        let Some(number) = next else {
            bail!("all numbers are in use");
        };
        let path = numbered(&self.first, number);
        let writer = self.writer.next(BufWriter::new(grown(&path, self.is_live)?))?;
        let old = std::mem::replace(&mut self.writer, writer);
        let old_path = std::mem::replace(&mut self.path, path);
        (self.number, self.is_used) = (number, false);
        // A disk takes a while for a large file, and frames do not wait.
        let end = move || files::keep_new(vec![(old_path, whole(old)?)]);
        self.ending = Ending(Some(std::thread::Builder::new().spawn(end)?));
        Ok(())
    }
}

/// A thread that finishes a file. Dropping waits for it, so that a recording that fails keeps all earlier files.
#[derive(Default)]
struct Ending(Option<JoinHandle<anyhow::Result<()>>>);

impl Ending {
    /// Waits for the file.
    fn join(&mut self) -> anyhow::Result<()> {
        let ended = self.0.take().map(JoinHandle::join);
        ended
            .unwrap_or(Ok(Ok(())))
            .unwrap_or_else(|_| bail!("the previous file was not finished"))
    }
}

impl Drop for Ending {
    fn drop(&mut self) {
        // An error of the recording is reported already.
        let _ = self.join();
    }
}

fn grown(path: &Path, is_live: bool) -> anyhow::Result<Growing> {
    match is_live {
        true => Growing::create_active(path),
        false => Growing::create(path),
    }
}

/// Writes what remains.
fn whole(writer: Open) -> anyhow::Result<Growing> {
    Ok(writer.finish()?.into_inner().map_err(std::io::IntoInnerError::into_error)?)
}

/// `drive-0001.mcap` of `drive.mcap`.
fn numbered(first: &Path, number: u32) -> PathBuf {
    let mut name = first.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:04}"));
    if let Some(extension) = first.extension() {
        name.push(".");
        name.push(extension);
    }
    first.with_file_name(name)
}

fn is_there(path: &Path) -> bool {
    path.exists() || files::active(path).exists()
}

/// Checks that no file of an older recording has the name of one of this.
fn check_free(first: &Path) -> anyhow::Result<()> {
    if !files::check(first)? {
        bail!(
            "{} is a device or a pipe, and --max-size is for files: omit --max-size",
            first.display()
        );
    }
    let folder = first.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let taken = entries
        .flatten()
        .map(|entry| folder.join(entry.file_name()))
        .filter(|path| is_part(first, path))
        .min();
    if let Some(taken) = taken {
        bail!("{} exists and is not overwritten: give another file", taken.display());
    }
    Ok(())
}

/// Whether a path has the name of one of the files of a recording, finished or not.
fn is_part(first: &Path, path: &Path) -> bool {
    let path = match path.extension() {
        Some(extension) if extension == "active" => path.with_extension(""),
        _ => path.to_owned(),
    };
    if path.file_name() == first.file_name() {
        return true;
    }
    let number = path.file_stem().and_then(|stem| stem.to_str()?.rsplit_once('-')?.1.parse().ok());
    number.is_some_and(|number| numbered(first, number).file_name() == path.file_name())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_bytes_with_or_without_a_unit() {
        for (text, bytes) in [("100000", 100_000), ("100k", 100_000), ("200M", 200_000_000), ("4G", 4_000_000_000)] {
            assert_eq!(max_size(text), Ok(bytes));
        }
        for text in ["99999", "99k", "0", "-1", "", "M", "1.5G", "200MB", "200MM", "200m", "99999999999G"] {
            assert!(max_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_recording_that_is_given_up_keeps_its_finished_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("drive.mcap");
        let mut files = Files::create(&path, Some(MAX_SIZE_MIN), false).expect("a file");
        let channel = files.channel("/image", Schema { name: "a", definition: "" });
        for time_ns in 1..=3 {
            files.message(channel, time_ns, &[0; 90_000]).expect("room");
            files.end_frame().expect("written");
        }
        drop(files);
        let kept = [path.clone(), numbered(&path, 1)].map(|path| path.exists());
        assert_eq!((kept, numbered(&path, 2).exists()), ([true; 2], false));
    }

    #[test]
    fn files_are_numbered_beside_the_first() {
        let numbered = |first, number| numbered(Path::new(first), number);
        assert_eq!(numbered("a/drive.mcap", 1), Path::new("a/drive-0001.mcap"));
        assert_eq!(numbered("drive", 12_345), Path::new("drive-12345"));
        let is_part = |path| is_part(Path::new("a/drive.mcap"), Path::new(path));
        for part in [
            "a/drive.mcap",
            "a/drive.mcap.active",
            "a/drive-0001.mcap",
            "a/drive-12345.mcap.active",
        ] {
            assert!(is_part(part), "{part}");
        }
        for other in [
            "a/drive-1.mcap",
            "a/drive-0001.txt",
            "a/drive-x.mcap",
            "a/drives.mcap",
            "a/drive",
            "a/x-0001.mcap",
        ] {
            assert!(!is_part(other), "{other}");
        }
    }
}
