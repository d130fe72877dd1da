//! Finished pieces of the current entry, in a file beside the table, so that an interrupted search resumes.
//!
//! The first line names the entry; each further line is a piece after a checksum of it and all before. The file only grows, so a piece
//! costs its own length. A truncated or damaged line ends the pieces.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sim::input;
use studies::checksum;

use crate::{files, output};

/// Suffix of the file's name after the table's.
const EXTENSION: &str = "rounds";
/// Interval between two syncs to disk.
const SYNC_EVERY: Duration = Duration::from_secs(10);

/// The pieces of one entry.
pub struct Rounds {
    /// `None` if nothing is kept.
    path: Option<PathBuf>,
    /// `None` if nothing is or can be kept.
    file: Option<File>,
    /// The checksum of the last line.
    sum: String,
    synced: Instant,
}

/// The entry that the pieces belong to.
#[derive(Serialize)]
pub struct About<'a> {
    /// The table without entries, with all settings.
    pub table: &'a str,
    /// Ambient illuminance, lx.
    pub illuminance_lx: f64,
    /// Normalised LED interval.
    pub interval: f64,
}

impl Rounds {
    /// Opens the file beside a table, if there is one, with the finished pieces of an earlier run.
    pub fn begin<Piece: DeserializeOwned>(table: Option<&Path>, about: &About) -> anyhow::Result<(Self, Vec<Piece>)> {
        let Some(table) = table else {
            return Ok((Self::of(None, None, String::new()), Vec::new()));
        };
        let path = table.with_added_extension(EXTENSION);
        let head = serde_json::to_string(about)?;
        let found = input::read_text(&path, input::RESULTS_MAX).unwrap_or_default();
        let (text, known, sum) = whole(&found, &head);
        files::write(&path, text)?;
        let file = File::options()
            .append(true)
            .open(&path)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok((Self::of(Some(path), Some(file), sum), known))
    }

    fn of(path: Option<PathBuf>, file: Option<File>, sum: String) -> Self {
        let synced = Instant::now();
        Self { path, file, sum, synced }
    }

    /// Adds a piece. On an error the run continues; a resumed run repeats the piece.
    pub fn add(&mut self, piece: &impl Serialize) {
        let (Some(path), Some(file)) = (&self.path, &mut self.file) else {
            return;
        };
        let kept = append(file, piece, &self.sum).and_then(|sum| {
            self.sum = sum;
            if self.synced.elapsed() > SYNC_EVERY {
                self.synced = Instant::now();
                file.sync_data()?;
            }
            Ok(())
        });
        if let Err(error) = kept {
            output::tell(format_args!("vocc: cannot write {}: {error}; continuing", path.display()));
            self.file = None;
        }
    }

    /// Removes the file once the pieces are in the table.
    pub fn finish(self) -> anyhow::Result<()> {
        let Some(path) = self.path else { return Ok(()) };
        std::fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))
    }
}

/// Appends a line after one with the checksum `last`; returns its own.
fn append(file: &mut File, piece: &impl Serialize, last: &str) -> std::io::Result<String> {
    let piece = serde_json::to_string(piece)?;
    let sum = sum(last, &piece);
    file.write_all(format!("{sum} {piece}\n").as_bytes())?;
    Ok(sum)
}

/// The checksum of a piece chained to `last`, which detects moved lines.
fn sum(last: &str, piece: &str) -> String {
    checksum::of(format!("{last}{piece}").as_bytes())
}

/// The intact part of a file that begins with `head`, its pieces, and the last checksum.
fn whole<Piece: DeserializeOwned>(text: &str, head: &str) -> (String, Vec<Piece>, String) {
    let mut kept = format!("{head}\n");
    let (mut known, mut sum) = (Vec::new(), String::new());
    let lines = text.strip_prefix(&kept).unwrap_or_default();
    for line in lines.split_inclusive('\n') {
        let Some((found, own)) = piece(line, &sum) else {
            break;
        };
        known.push(found);
        kept += line;
        sum = own;
    }
    (kept, known, sum)
}

/// The piece of a line after one with the checksum `last`, and its own checksum; `None` if damaged.
fn piece<Piece: DeserializeOwned>(line: &str, last: &str) -> Option<(Piece, String)> {
    let (found, piece) = line.strip_suffix('\n')?.split_once(' ')?;
    let whole = serde_json::from_str(piece).ok()?;
    (found == sum(last, piece)).then(|| (whole, found.into()))
}

#[cfg(test)]
mod tests {
    use studies::monte_carlo::Evaluation;

    use super::*;

    #[test]
    fn rounds_are_those_of_the_same_search_up_to_a_cut() {
        let folder = tempfile::tempdir().expect("a folder");
        let table = folder.path().join("table.toml");
        let about = |interval| About {
            table: "format = 1",
            illuminance_lx: 100.0,
            interval,
        };
        let round = vec![Evaluation::default(); 2];
        let (mut rounds, known) = Rounds::begin::<Vec<Evaluation>>(Some(&table), &about(1.0)).expect("room");
        assert!(known.is_empty());
        rounds.add(&round);
        rounds.add(&round);
        drop(rounds);
        let path = table.with_added_extension(EXTENSION);
        let text = std::fs::read_to_string(&path).expect("rounds");
        std::fs::write(&path, &text[..text.len() - 5]).expect("room");
        let (mut rounds, known) = Rounds::begin::<Vec<Evaluation>>(Some(&table), &about(1.0)).expect("room");
        assert_eq!(known, std::slice::from_ref(&round));
        rounds.add(&round);
        drop(rounds);
        assert_eq!(std::fs::read_to_string(&path).expect("rounds"), text);
        let damaged = text.replacen("\"on\"", "\"no\"", 1);
        std::fs::write(&path, damaged).expect("room");
        let (_, known) = Rounds::begin::<Vec<Evaluation>>(Some(&table), &about(1.0)).expect("room");
        assert!(known.is_empty(), "it is damaged");
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        for moved in [vec![0, 1, 1], vec![0, 2, 1], vec![0, 2]] {
            let moved: Vec<&str> = moved.into_iter().map(|line| lines[line]).collect();
            std::fs::write(&path, moved.concat()).expect("room");
            let (_, known) = Rounds::begin::<Vec<Evaluation>>(Some(&table), &about(1.0)).expect("room");
            assert_eq!(known.len(), usize::from(moved[1] == lines[1]));
        }
        let (rounds, known) = Rounds::begin::<Vec<Evaluation>>(Some(&table), &about(2.0)).expect("room");
        assert!(known.is_empty(), "they are of another interval");
        rounds.finish().expect("removed");
        assert!(!path.exists());
    }
}
