//! The division of a sweep into pieces of equal expected time.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// The most parts of a sweep.
pub const MOST_SHARDS: u64 = 1_000_000;

/// One part of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

/// An invalid part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is not i/n with i from 0 and below n, and n at most {MOST_SHARDS}, such as 0/8")]
pub struct ShardError {
    text: String,
}

/// Chunks of one cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Work {
    /// The cell's number.
    pub cell: usize,
    /// Its chunks.
    pub chunks: Range<u64>,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Part `index` of `count`, counted from 0.
    ///
    /// # Errors
    /// If there is no such part, or there are too many parts.
    pub fn new(index: u64, count: u64) -> Result<Self, ShardError> {
        if index < count && count <= MOST_SHARDS {
            Ok(Self { index, count })
        } else {
            Err(ShardError {
                text: format!("{index}/{count}"),
            })
        }
    }

    /// Its number, from 0.
    pub fn index(self) -> u64 {
        self.index
    }

    /// The number of parts.
    pub fn count(self) -> u64 {
        self.count
    }
}

/// The expected work of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ExpectedWork {
    /// Chunks until it has enough.
    pub chunks: u64,
    /// The time of a chunk.
    pub chunk_cost: f64,
}

/// A sweep with borders between its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    /// Chunks of a cell, at most.
    chunks: u64,
    cells: Vec<ExpectedWork>,
}

impl Partition {
    pub(super) fn new(chunks: u64, cells: Vec<ExpectedWork>) -> Self {
        Self { chunks, cells }
    }

    /// The work of one part.
    ///
    /// Chunks of a cell beyond the expected number cost nothing; they belong to the part with the cell's end. Sums are formed in the order
    /// of the cells, so that every part computes the same borders.
    pub fn work(&self, shard: Shard) -> Vec<Work> {
        let cost = |cell: &ExpectedWork| cell.chunks.min(self.chunks) as f64 * cell.chunk_cost;
        let total: f64 = self.cells.iter().map(cost).sum();
        let border = |part: u64| total * part as f64 / shard.count as f64;
        let (from, to) = (border(shard.index), border(shard.index + 1));
        let (is_first, is_last) = (shard.index == 0, shard.index + 1 == shard.count);
        let (mut before, mut work) = (0.0, Vec::new());
        for (number, cell) in self.cells.iter().enumerate() {
            let after = before + cost(cell);
            // The chunk at which the cell is cut; a border at the cell's end is the next cell's start.
            let cut = |border: f64| {
                if border >= after {
                    return self.chunks;
                }
                let chunk = ((border - before) / cell.chunk_cost).max(0.0).round() as u64;
                chunk.min(self.chunks)
            };
            let start = if is_first { 0 } else { cut(from) };
            let end = if is_last { self.chunks } else { cut(to) };
            if start < end {
                work.push(Work {
                    cell: number,
                    chunks: start..end,
                });
            }
            before = after;
        }
        work
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        parsed
            .and_then(|(index, count)| Self::new(index, count).ok())
            .ok_or_else(|| ShardError { text: text.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn cells() -> impl Strategy<Value = Vec<ExpectedWork>> {
        let cell = (0u64..2000, 0.01..100.0f64);
        let expected = |(chunks, chunk_cost)| ExpectedWork { chunks, chunk_cost };
        prop::collection::vec(cell.prop_map(expected), 1..12)
    }

    properties! {
        #[test]
        fn each_chunk_is_worked_on_once(cells in cells(), chunks in 1u64..2000, count in 1u64..40) {
            let mut next = vec![0; cells.len()];
            for index in 0..count {
                let partition = Partition::new(chunks, cells.clone());
                for work in partition.work(Shard::new(index, count).unwrap()) {
                    prop_assert_eq!(next[work.cell], work.chunks.start);
                    next[work.cell] = work.chunks.end;
                }
            }
            prop_assert_eq!(next, vec![chunks; cells.len()]);
        }

        #[test]
        fn parts_cost_the_same(cells in cells(), count in 1u64..40) {
            let chunks = 2000;
            let total: f64 = cells.iter().map(|c| c.chunks as f64 * c.chunk_cost).sum();
            let dearest = cells.iter().map(|c| c.chunk_cost).fold(0.0, f64::max);
            for index in 0..count {
                let partition = Partition::new(chunks, cells.clone());
                let work = partition.work(Shard::new(index, count).unwrap());
                let of = |w: &Work| {
                    let end = w.chunks.end.min(cells[w.cell].chunks);
                    end.saturating_sub(w.chunks.start) as f64 * cells[w.cell].chunk_cost
                };
                let cost: f64 = work.iter().map(of).sum();
                // Both ends are at whole chunks.
                prop_assert!((cost - total / count as f64).abs() <= dearest + 1e-6 * total);
            }
        }
    }

    #[test]
    fn parts_are_written_as_fractions() {
        assert_eq!("3/8".parse(), Shard::new(3, 8));
        assert_eq!(Shard::new(3, 8).unwrap().to_string(), "3/8");
        for text in ["8/8", "0/0", "-1/2", "1", "0/1000001", "a/b", "1/2/3", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
