//! The results of a sweep so far, and their file format.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Sweep, SweepError, Work};
use crate::checksum;
use crate::monte_carlo::{Accumulator, AccumulatorError, CHUNK, ChunkProgress, Evaluation};

/// The version of the format.
const FORMAT: u32 = 3;
/// The version without a checksum, which is still readable.
const UNCHECKED: u32 = 2;

/// The sums of a sweep's cells, and the sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    sweep: Sweep,
    cells: BTreeMap<usize, Accumulator>,
    /// The levels of the score, without the last, of unfinished cells of rare events.
    levels: BTreeMap<usize, Vec<f32>>,
    /// Why a cell cannot be measured.
    empty: BTreeMap<usize, String>,
}

/// Why results cannot be read or merged.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// No results, or incomplete ones.
    #[error("these are not whole results of vocc evaluate or vocc sweep ({0}): make them again")]
    Damaged(serde_json::Error),
    /// An invalid sweep.
    #[error("the sweep in this file is invalid: {0}; the file is damaged, run the sweep again")]
    Sweep(Box<SweepError>),
    /// Another format.
    #[error(
        "these are results of format {found}, this program ({version}) knows format {FORMAT} and, without a checksum, {UNCHECKED}: read \
         them with the version that wrote them, or make them again",
        version = env!("CARGO_PKG_VERSION")
    )]
    Format {
        /// The format's version.
        found: u32,
    },
    /// Results of another program.
    #[error(
        "these are results of version {found}, this is {version}, whose frames may differ: use one version for all shards",
        version = env!("CARGO_PKG_VERSION")
    )]
    Version {
        /// The program's version.
        found: String,
    },
    /// Results of another sweep.
    #[error("these are results of another run: its {} differ; all shards must be of the same plan and seed", differences.join(", "))]
    OtherRun {
        /// The differences.
        differences: Vec<&'static str>,
    },
    /// A cell that the sweep does not have.
    #[error("there are results of cell {cell}, but the sweep has {cells} cells: the file is damaged")]
    NoCell {
        /// Its number.
        cell: usize,
        /// Cells of the sweep.
        cells: usize,
    },
    /// A chunk that the cells do not have.
    #[error("there are results up to chunk {end} of cell {cell}, but a cell has {chunks} chunks: the file is damaged")]
    NoChunk {
        /// The cell and its values.
        cell: String,
        /// The end of the chunks.
        end: u64,
        /// Chunks of a cell.
        chunks: u64,
    },
    /// A sum with other frames than those of its chunks.
    #[error(
        "the counts of cell {cell} do not add up: chunks {first} to {last} have {frames} frames, and something else was counted; the \
         file is damaged, make it again"
    )]
    Counts {
        /// The cell and its values.
        cell: String,
        /// The first chunk of the sum.
        first: u64,
        /// The last.
        last: u64,
        /// Their frames.
        frames: u64,
    },
    /// The file was changed after it was written.
    #[error("these results were changed after they were written: their checksum should be {wanted}; undo the change, or make them again")]
    Checksum {
        /// The right checksum of its content.
        wanted: String,
    },
    /// A sum that is there already, or is invalid.
    #[error("cell {cell}: {source}")]
    Accumulator {
        /// The cell and its values.
        cell: String,
        /// The cause.
        source: AccumulatorError,
    },
    /// Chunks are missing.
    #[error("chunk {chunk} of cell {cell} is missing: give all shards, and finish unfinished ones with --resume")]
    Missing {
        /// The cell and its values.
        cell: String,
        /// The first missing chunk.
        chunk: u64,
    },
}

/// The start of a file.
#[derive(Deserialize)]
struct Head {
    format: u32,
    #[serde(default)]
    version: String,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ResultsRecord {
    format: u32,
    version: String,
    sweep: Sweep,
    cells: Vec<WrittenCell>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    levels: BTreeMap<usize, Vec<f32>>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    empty: BTreeMap<usize, String>,
    /// Checksum of all the rest as written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checksum: Option<String>,
}

impl ResultsRecord {
    /// The checksum of the text without a checksum.
    fn checksum(&self) -> Result<String, serde_json::Error> {
        Ok(checksum::of(&serde_json::to_vec(self)?))
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCell {
    cell: usize,
    sums: Accumulator,
}

impl Results {
    /// Empty results.
    pub fn new(sweep: Sweep) -> Self {
        Self {
            sweep,
            cells: BTreeMap::new(),
            levels: BTreeMap::new(),
            empty: BTreeMap::new(),
        }
    }

    /// The sweep.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The file content. The same results give the same bytes.
    ///
    /// # Errors
    /// If a number cannot be written in JSON.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        let cells = self.cells.iter().filter(|(_, sums)| !sums.is_empty());
        let mut written = ResultsRecord {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            sweep: self.sweep.clone(),
            cells: cells.map(|(&cell, sums)| WrittenCell { cell, sums: sums.clone() }).collect(),
            levels: self.levels.clone(),
            empty: self.empty.clone(),
            checksum: None,
        };
        written.checksum = Some(written.checksum()?);
        serde_json::to_string(&written)
    }

    /// The results in a file. The format before this is read too: it has no checksum, but its counts must also add up.
    ///
    /// # Errors
    /// If it is not such a file, is incomplete, of another version, inconsistent, or was changed after it was written.
    pub fn from_json(text: &str) -> Result<Self, ResultsError> {
        let Head { format, version } = serde_json::from_str(text).map_err(ResultsError::Damaged)?;
        if ![UNCHECKED, FORMAT].contains(&format) {
            return Err(ResultsError::Format { found: format });
        }
        if version != env!("CARGO_PKG_VERSION") {
            return Err(ResultsError::Version { found: version });
        }
        let mut written: ResultsRecord = serde_json::from_str(text).map_err(ResultsError::Damaged)?;
        let found = written.checksum.take();
        let wanted = written.checksum().map_err(ResultsError::Damaged)?;
        written
            .sweep
            .check_description()
            .map_err(|fault| ResultsError::Sweep(Box::new(fault)))?;
        let cells = written.sweep.cells();
        let mut results = Self::new(written.sweep);
        results.levels = written.levels;
        if let Some((&cell, _)) = written.empty.range(cells..).next() {
            return Err(ResultsError::NoCell { cell, cells });
        }
        results.empty = written.empty;
        for WrittenCell { cell, sums } in written.cells {
            if cell >= cells {
                return Err(ResultsError::NoCell { cell, cells });
            }
            results.merge_cell(cell, &sums)?;
            results.check_counts(cell, &sums)?;
        }
        // Last, because the earlier errors are more specific.
        if format == FORMAT && found.as_ref() != Some(&wanted) {
            return Err(ResultsError::Checksum { wanted });
        }
        Ok(results)
    }

    /// Adds results of the same sweep.
    ///
    /// # Errors
    /// If they are of another one, or overlap.
    pub fn merge(&mut self, other: &Self) -> Result<(), ResultsError> {
        let differences = differences(&self.sweep, &other.sweep);
        if !differences.is_empty() {
            return Err(ResultsError::OtherRun { differences });
        }
        for (&cell, sums) in &other.cells {
            self.merge_cell(cell, sums)?;
        }
        for (&cell, why) in &other.empty {
            self.leave_empty(cell, why.clone());
        }
        Ok(())
    }

    /// Checks that each sum has the frames of its chunks.
    fn check_counts(&self, cell: usize, sums: &Accumulator) -> Result<(), ResultsError> {
        for (chunks, found) in sums.spans() {
            let [start, end] = [chunks.start, chunks.end].map(|chunk| self.sweep.frames.min(chunk * CHUNK));
            let frames = end - start;
            if !found.is_of(frames, self.sweep.rare_events) {
                return Err(ResultsError::Counts {
                    cell: self.sweep.name_of(cell),
                    first: chunks.start,
                    last: chunks.end - 1,
                    frames,
                });
            }
        }
        Ok(())
    }

    fn merge_cell(&mut self, cell: usize, sums: &Accumulator) -> Result<(), ResultsError> {
        let (end, chunks) = (sums.end(), self.sweep.chunks());
        if end > chunks {
            let cell = self.sweep.name_of(cell);
            return Err(ResultsError::NoChunk { cell, end, chunks });
        }
        let own = self.cells.entry(cell).or_default();
        own.merge(sums).map_err(|source| ResultsError::Accumulator {
            cell: self.sweep.name_of(cell),
            source,
        })
    }

    /// Drops the chunks beyond each cell's end; the rest equals the result of one run.
    ///
    /// # Errors
    /// If something is missing.
    pub fn finish(mut self) -> Result<Self, ResultsError> {
        self.levels.clear();
        for cell in 0..self.sweep.cells() {
            match self.standing(cell) {
                ChunkProgress::Done(end) => self.truncate(cell, end),
                ChunkProgress::Missing(chunk) => {
                    let cell = self.sweep.name_of(cell);
                    return Err(ResultsError::Missing { cell, chunk });
                }
            }
        }
        Ok(self)
    }

    /// The progress of a cell.
    pub fn standing(&self, cell: usize) -> ChunkProgress {
        self.standing_of(&Work {
            cell,
            chunks: 0..self.sweep.chunks(),
        })
    }

    /// The progress of a part of a cell.
    pub fn standing_of(&self, work: &Work) -> ChunkProgress {
        let chunks = work.chunks.clone();
        if self.empty.contains_key(&work.cell) {
            return ChunkProgress::Done(chunks.start);
        }
        match self.cells.get(&work.cell) {
            Some(sums) => sums.standing(chunks, self.sweep.stop_errors),
            None => ChunkProgress::Missing(chunks.start),
        }
    }

    /// The sum over all present chunks of a cell.
    pub fn total(&self, cell: usize) -> Evaluation {
        self.cells.get(&cell).map(Accumulator::total).unwrap_or_default()
    }

    /// The number of present chunks of a cell.
    pub fn chunks_of(&self, cell: usize) -> u64 {
        self.cells.get(&cell).map_or(0, Accumulator::chunks)
    }

    /// Bit errors of a cell so far.
    pub fn errors_of(&self, cell: usize) -> u64 {
        self.cells.get(&cell).map_or(0, Accumulator::errors)
    }

    /// Why a cell cannot be measured, if known.
    pub fn why_empty(&self, cell: usize) -> Option<&str> {
        self.empty.get(&cell).map(String::as_str)
    }

    /// Records that a cell cannot be measured, and why.
    pub(super) fn leave_empty(&mut self, cell: usize, why: String) {
        self.cells.remove(&cell);
        self.empty.insert(cell, why);
    }

    /// The chosen levels of a cell of rare events, infinity at the end; `None` if they are not chosen, or the cell is done.
    pub(super) fn levels_of(&self, cell: usize) -> Option<Vec<f32>> {
        let levels = self.levels.get(&cell)?.iter().copied();
        Some(levels.chain([f32::INFINITY]).collect())
    }

    /// Stores the levels of a cell; without the last, because JSON has no infinity.
    pub(super) fn keep_levels(&mut self, cell: usize, levels: &[f32]) {
        let finite = levels.iter().copied().filter(|level| level.is_finite());
        self.levels.insert(cell, finite.collect());
    }

    /// Drops the levels of a finished cell.
    pub(super) fn forget_levels(&mut self, cell: usize) {
        self.levels.remove(&cell);
    }

    pub(super) fn contains(&self, cell: usize, chunk: u64) -> bool {
        self.cells.get(&cell).is_some_and(|sums| sums.contains(chunk))
    }

    /// Adds a new chunk.
    pub(super) fn add(&mut self, cell: usize, chunk: u64, result: Evaluation) {
        let added = self.cells.entry(cell).or_default().add(chunk, result);
        debug_assert!(added.is_ok(), "only missing chunks are worked on");
    }

    pub(super) fn truncate(&mut self, cell: usize, end: u64) {
        if let Some(sums) = self.cells.get_mut(&cell) {
            sums.truncate(end);
        }
    }
}

/// The differences of two sweeps, in the terms of their plans.
fn differences(one: &Sweep, other: &Sweep) -> Vec<&'static str> {
    let parts = [
        ("scene", one.scene == other.scene),
        ("grid", one.grid == other.grid),
        ("detectors", one.detectors == other.detectors),
        ("frames", one.frames == other.frames),
        ("stopping rule", one.stop_errors == other.stop_errors),
        ("seed", one.seed == other.seed),
        ("random reflectance", one.random_reflectance == other.random_reflectance),
        ("level", one.level == other.level),
        ("rare events", one.rare_events == other.rare_events),
        ("camera told", one.camera == other.camera),
    ];
    let differing = parts.into_iter().filter(|(_, same)| !same);
    differing.map(|(name, _)| name).collect()
}
