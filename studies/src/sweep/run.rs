//! The engine: computes a shard's chunks on all threads.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::parallel::{map, map_with, threads, try_map};

use super::shard::ExpectedWork;
use super::{Partition, Results, Shard, Sweep, SweepError, Work};
use crate::monte_carlo::ChunkProgress;
use crate::monte_carlo::{CHUNK, Evaluation, Evaluator, Settings, Workspace};
use crate::splitting::{SplittingEvaluator, SplittingWorkspace};
use crate::stop::Stop;

/// Chunks per thread before results are merged and reported.
const CHUNKS_A_THREAD: usize = 16;
/// The time after which no more chunks are started, so that finished work is saved soon, however long a chunk takes.
const BATCH_TIME: Duration = Duration::from_secs(1);

/// A shard of a sweep in progress.
pub struct Run<'a> {
    sweep: &'a Sweep,
    work: Vec<Work>,
    stop: Stop,
}

/// The progress of a run.
pub struct SweepProgress<'a> {
    /// All finished results.
    pub results: &'a Results,
    /// Frames done, including those of earlier runs that it continues.
    pub frames: u64,
    /// The current estimate of the total number of frames.
    pub expected: u64,
    /// The cells finished since the last report.
    pub finished: &'a [usize],
}

impl Sweep {
    /// The expected frames of each cell: all of them, or as many as its first chunk predicts if a number of errors ends it.
    ///
    /// # Errors
    /// If a cell cannot be evaluated.
    pub fn expected_frames(&self) -> Result<Vec<u64>, SweepError> {
        let Some(enough) = self.stop_errors else {
            return Ok(vec![self.frames; self.cells()]);
        };
        try_map(0..self.cells(), |cell| {
            let first = || {
                let worker = self.worker(cell, None, Stop::NEVER)?;
                self.chunk(cell, &worker, 0, &mut worker.room())
            };
            let first = match first() {
                Err(fault) if fault.why_empty().is_some() => return Ok(0),
                first => first?,
            };
            let frames = CHUNK.min(self.frames) as f64;
            let expected = enough as f64 / first.bit_errors() as f64 * frames;
            Ok((expected.ceil() as u64).clamp(1, self.frames))
        })
    }

    /// The borders between shards, by the `expected` frames of cells, or without them by [`Sweep::expected_frames`].
    ///
    /// # Errors
    /// If the sweep is invalid: see [`Sweep::check`].
    pub fn partition(&self, expected: Option<&[u64]>) -> Result<Partition, SweepError> {
        let costs = self.check()?;
        let frames = match expected {
            Some(frames) if frames.len() == costs.len() => frames.to_vec(),
            _ => self.expected_frames()?,
        };
        let cells = frames.iter().zip(costs).map(|(frames, frame_ns)| ExpectedWork {
            chunks: frames.div_ceil(CHUNK),
            chunk_cost: frame_ns,
        });
        Ok(Partition::new(self.chunks(), cells.collect()))
    }

    /// The evaluator of a cell, with levels that were chosen before.
    fn worker(&self, cell: usize, levels: Option<&[f32]>, stop: Stop) -> Result<Worker, SweepError> {
        let scene = self.scene_of(cell)?;
        let settings = Settings {
            stop,
            ..self.settings_of(cell)
        };
        let worker = if self.rare_events {
            SplittingEvaluator::with_levels(&scene, settings, levels).map(|evaluator| Worker::Splitting(evaluator.into()))
        } else {
            Evaluator::new(&scene, settings).map(|evaluator| Worker::Counting(evaluator.into()))
        };
        worker.map_err(|fault| self.evaluate_error(cell, fault))
    }

    fn chunk(&self, cell: usize, worker: &Worker, chunk: u64, room: &mut ThreadMemory) -> Result<Evaluation, SweepError> {
        let result = match (worker, room) {
            (Worker::Splitting(evaluator), ThreadMemory::Splitting(room)) => evaluator.chunk(chunk, room),
            (Worker::Counting(evaluator), ThreadMemory::Counting(room)) => evaluator.chunk(chunk, room),
            (_, room) => {
                *room = worker.room();
                return self.chunk(cell, worker, chunk, room);
            }
        };
        result.map_err(|fault| self.evaluate_error(cell, fault))
    }
}

/// The evaluator of a cell.
enum Worker {
    Counting(Box<Evaluator>),
    Splitting(Box<SplittingEvaluator>),
}

/// The memory of a thread for it.
enum ThreadMemory {
    Counting(Box<Workspace>),
    Splitting(Box<SplittingWorkspace>),
}

impl Worker {
    /// Stores the levels it has chosen.
    fn store_levels(&self, cell: usize, results: &mut Results) {
        if let Self::Splitting(evaluator) = self {
            results.keep_levels(cell, evaluator.levels());
        }
    }

    fn room(&self) -> ThreadMemory {
        match self {
            Self::Counting(evaluator) => ThreadMemory::Counting(evaluator.workspace().into()),
            Self::Splitting(evaluator) => ThreadMemory::Splitting(evaluator.workspace().into()),
        }
    }
}

impl<'a> Run<'a> {
    /// One shard of a sweep, cut as by [`Sweep::partition`].
    ///
    /// # Errors
    /// If the sweep is invalid: see [`Sweep::check`].
    pub fn new(sweep: &'a Sweep, shard: Shard, expected: Option<&[u64]>) -> Result<Self, SweepError> {
        let work = if shard == Shard::WHOLE {
            sweep.check()?;
            let chunks = 0..sweep.chunks();
            let all = |cell| Work {
                cell,
                chunks: chunks.clone(),
            };
            (0..sweep.cells()).map(all).collect()
        } else {
            sweep.partition(expected)?.work(shard)
        };
        Ok(Self {
            sweep,
            work,
            stop: Stop::NEVER,
        })
    }

    /// The same run, ended early by `stop`: at once, with the finished work.
    pub fn until(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }

    /// The work to do.
    pub fn work(&self) -> &[Work] {
        &self.work
    }

    /// Does all work that `results` do not hold yet, and adds it; `progress` is called from time to time and may end the run by returning
    /// false. Returns whether all is done.
    ///
    /// # Errors
    /// If a cell cannot be evaluated; finished work is in `results`.
    pub fn advance(&self, results: &mut Results, mut progress: impl FnMut(&SweepProgress) -> bool) -> Result<bool, SweepError> {
        let mut left: Vec<&Work> = self.work.iter().collect();
        let mut open: BTreeMap<usize, Worker> = BTreeMap::new();
        loop {
            let finished = self.put_away_finished(&mut left, results);
            let going_on = progress(&SweepProgress {
                results,
                frames: self.frames_done(results),
                expected: self.frames_expected(results),
                finished: &finished,
            });
            if left.is_empty() || !going_on || self.stop.is_asked() {
                return Ok(left.is_empty());
            }
            let batch = self.batch(&left, results);
            open.retain(|cell, _| batch.iter().any(|(wanted, _)| wanted == cell));
            let mut new: Vec<usize> = batch.iter().map(|&(cell, _)| cell).collect();
            new.dedup();
            new.retain(|cell| !open.contains_key(cell));
            if self.sweep.rare_events {
                // Choosing levels takes all threads for a while: those of one cell are saved before the next.
                new.truncate(1);
            }
            let made = map(&new, |&cell| {
                let levels = results.levels_of(cell);
                (cell, self.sweep.worker(cell, levels.as_deref(), self.stop))
            });
            let (mut was_stopped, mut is_empty) = (false, false);
            for (cell, worker) in made {
                match worker {
                    Ok(worker) => {
                        worker.store_levels(cell, results);
                        open.insert(cell, worker);
                    }
                    Err(fault) if fault.is_stop() => was_stopped = true,
                    Err(fault) => {
                        self.leave_empty(cell, fault, results)?;
                        is_empty = true;
                    }
                }
            }
            // The next progress report ends the work, or the next batch leaves out the cells that stay empty.
            if was_stopped || is_empty || !new.is_empty() && self.sweep.rare_events {
                continue;
            }
            let parts = self.evaluate(&batch, &open);
            for ((cell, chunk), part) in batch.into_iter().zip(parts) {
                match part {
                    Some(Ok(part)) => results.add(cell, chunk, part),
                    Some(Err(fault)) if !fault.is_stop() => self.leave_empty(cell, fault, results)?,
                    _ => {}
                }
            }
        }
    }

    /// Records why a cell cannot be measured, if others continue.
    fn leave_empty(&self, cell: usize, fault: SweepError, results: &mut Results) -> Result<(), SweepError> {
        let others = (0..self.sweep.cells()).any(|other| other != cell && results.why_empty(other).is_none());
        match fault.why_empty().filter(|_| others) {
            Some(why) => {
                results.leave_empty(cell, why);
                Ok(())
            }
            None => Err(fault),
        }
    }

    /// Removes finished work from the list, drops the chunks beyond its end, and returns its cells.
    fn put_away_finished(&self, left: &mut Vec<&Work>, results: &mut Results) -> Vec<usize> {
        let mut finished = Vec::new();
        left.retain(|work| match results.standing_of(work) {
            ChunkProgress::Done(end) => {
                results.truncate(work.cell, end);
                results.forget_levels(work.cell);
                finished.push(work.cell);
                false
            }
            ChunkProgress::Missing(_) => true,
        });
        finished
    }

    /// The next chunks. A cell that may have enough soon gets at most as many as are done already, so that few are wasted.
    fn batch(&self, left: &[&Work], results: &Results) -> Vec<(usize, u64)> {
        let size = CHUNKS_A_THREAD * threads();
        let mut batch = Vec::with_capacity(size);
        for work in left {
            let room = size - batch.len();
            let at_once = match self.sweep.stop_errors {
                Some(_) => room.min(results.chunks_of(work.cell).max(1) as usize),
                None => room,
            };
            let from = match results.standing_of(work) {
                ChunkProgress::Missing(chunk) => chunk,
                ChunkProgress::Done(_) => continue,
            };
            let missing = (from..work.chunks.end).filter(|&c| !results.contains(work.cell, c));
            batch.extend(missing.take(at_once).map(|chunk| (work.cell, chunk)));
            if batch.len() >= size {
                break;
            }
        }
        batch
    }

    /// The result of each chunk of a batch; `None` for those that were not started.
    fn evaluate(&self, batch: &[(usize, u64)], open: &BTreeMap<usize, Worker>) -> Vec<Option<Result<Evaluation, SweepError>>> {
        let begun = Instant::now();
        let part = |room: &mut Option<(usize, ThreadMemory)>, &(cell, chunk): &(usize, u64)| {
            if begun.elapsed() > BATCH_TIME {
                return None;
            }
            let worker = &open[&cell];
            let (_, room) = match room {
                Some(room) if room.0 == cell => room,
                other => other.insert((cell, worker.room())),
            };
            Some(self.sweep.chunk(cell, worker, chunk, room))
        };
        map_with(batch, || None, part)
    }

    /// Frames of this run in `results`.
    pub fn frames_done(&self, results: &Results) -> u64 {
        let frames = |work: &Work| self.frames_of(results.chunks_of(work.cell));
        self.work.iter().map(frames).sum()
    }

    fn frames_expected(&self, results: &Results) -> u64 {
        let of_work = |work: &Work| {
            let most = work.chunks.end - work.chunks.start;
            let (done, errors) = (results.chunks_of(work.cell), results.errors_of(work.cell));
            let expected = match (results.standing_of(work), self.sweep.stop_errors) {
                (ChunkProgress::Done(_), _) => done,
                (_, Some(enough)) if errors > 0 => {
                    let chunks = enough as f64 / errors as f64 * done as f64;
                    (chunks as u64).clamp(done.min(most), most)
                }
                _ => most,
            };
            self.frames_of(expected)
        };
        self.work.iter().map(of_work).sum()
    }

    /// Frames of a number of chunks of a cell.
    fn frames_of(&self, chunks: u64) -> u64 {
        (chunks * CHUNK).min(self.sweep.frames)
    }
}
