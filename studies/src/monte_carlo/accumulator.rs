//! Sums over chunks whose result does not depend on which thread computed a chunk, or when.
//!
//! A sum of floating-point numbers depends on its order. Here the chunks' numbers alone fix the order: two neighbours that fill an aligned
//! pair (2k, 2k + 1) are merged, left before right, then two such pairs, and so on, like carries of a binary counter, up to whole *blocks*.
//! So the shards of a run add up to the result of one run, bit for bit.
//!
//! A run may stop at the end of a block: the chunks from 2^k to 2^(k + 1) are divided into eight blocks, and the first sixteen chunks are
//! blocks of their own. So a run does at most an eighth more than a stopping rule needs, and keeps about 8·log₂ n sums for n chunks. The
//! rule applies at the ends of blocks only, in their order, on any number of threads.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::evaluation::{CHUNK, Evaluation};

/// Sums over spans of 2^level chunks, by the span's first chunk.
///
/// ```
/// use studies::monte_carlo::{Accumulator, Evaluation};
/// let mut accumulator = Accumulator::default();
/// for chunk in [2, 0, 3, 1] {
///     accumulator.add(chunk, Evaluation::default())?;
/// }
/// assert!(accumulator.contains(3) && !accumulator.contains(4));
/// assert!(accumulator.add(3, Evaluation::default()).is_err());
/// # Ok::<(), studies::monte_carlo::AccumulatorError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Node>", into = "Vec<Node>")]
pub struct Accumulator {
    nodes: BTreeMap<u64, (u32, Evaluation)>,
}

/// One sum in its file format.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Node {
    first_chunk: u64,
    level: u32,
    sums: Evaluation,
}

/// Why a chunk cannot be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccumulatorError {
    /// A chunk that is there already.
    #[error("chunks {first} to {last} are in the sum already, all or in part: give each shard once")]
    Doubled {
        /// The first chunk of the addition.
        first: u64,
        /// The last chunk of the addition.
        last: u64,
    },
    /// An invalid span.
    #[error(
        "a sum begins at chunk {first} and spans 2^{level} chunks: spans begin at multiples of their length and end with their block; \
         the file is damaged"
    )]
    Misaligned {
        /// Its first chunk.
        first: u64,
        /// The logarithm of its length.
        level: u32,
    },
    /// A span with more frames than it can have.
    #[error("a sum that begins at chunk {first} and spans 2^{level} chunks holds more than their {CHUNK} frames each; the file is damaged")]
    Overfull {
        /// Its first chunk.
        first: u64,
        /// The logarithm of its length.
        level: u32,
    },
}

/// The longest span is 2^40 chunks.
const MOST_LEVELS: u32 = 40;
/// The logarithm of the number of blocks per doubling.
const BLOCKS_A_DOUBLING: u32 = 3;

/// The logarithm of the length of the block that holds a chunk.
fn block_level(chunk: u64) -> u32 {
    (chunk | 1).ilog2().saturating_sub(BLOCKS_A_DOUBLING)
}

/// The end of the block that holds a chunk.
fn block_end(chunk: u64) -> u64 {
    let level = block_level(chunk);
    ((chunk >> level) + 1) << level
}

/// The progress of a range of chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChunkProgress {
    /// All work is done, up to this chunk, exclusive.
    Done(u64),
    /// This chunk is missing.
    Missing(u64),
}

impl Accumulator {
    /// Adds the result of one chunk.
    ///
    /// # Errors
    /// If it is there already.
    pub fn add(&mut self, chunk: u64, result: Evaluation) -> Result<(), AccumulatorError> {
        self.add_span(chunk, 0, result)
    }

    /// Adds all of `other`.
    ///
    /// # Errors
    /// If both hold the same chunk; nothing of the offending span is added.
    pub fn merge(&mut self, other: &Self) -> Result<(), AccumulatorError> {
        for (&first, &(level, sums)) in &other.nodes {
            self.add_span(first, level, sums)?;
        }
        Ok(())
    }

    /// Whether a chunk is in the sum.
    pub fn contains(&self, chunk: u64) -> bool {
        self.before(chunk).is_some_and(|end| end > chunk)
    }

    /// The sum over all chunks.
    pub fn total(&self) -> Evaluation {
        let mut total = Evaluation::default();
        for (_, sums) in self.nodes.values() {
            total.merge(sums);
        }
        total
    }

    /// The progress of the chunks of `range` if a run stops at the end of the block in which `errors` bit errors are reached.
    ///
    /// Only chunks in the range count: a part of a run that does not start at 0 stops once the part alone has enough, and then the whole
    /// run certainly has.
    pub fn standing(&self, range: Range<u64>, errors: Option<u64>) -> ChunkProgress {
        let (mut next, mut counted) = (range.start, 0);
        let enough = |counted: u64| errors.is_some_and(|errors| counted >= errors);
        // A longer span may hold the first chunk.
        let first_span = self.nodes.range(..=range.start).next_back();
        let from = first_span.map_or(range.start, |(&first, _)| first);
        for (&first, (level, sums)) in self.nodes.range(from..range.end) {
            if first + (1 << level) <= range.start {
                continue;
            }
            if first > next {
                return ChunkProgress::Missing(next);
            }
            next = first + (1 << level);
            counted += sums.bit_errors();
            if next == block_end(first) && enough(counted) {
                return ChunkProgress::Done(next.min(range.end));
            }
        }
        if next < range.end {
            ChunkProgress::Missing(next)
        } else {
            ChunkProgress::Done(range.end)
        }
    }

    /// Drops all chunks from `end` on, which must be the end of a block or of all chunks.
    pub fn truncate(&mut self, end: u64) {
        self.nodes.split_off(&end);
    }

    /// Whether there is nothing in the sum.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The number of bit errors.
    pub fn errors(&self) -> u64 {
        self.nodes.values().map(|(_, sums)| sums.bit_errors()).sum()
    }

    /// The sums, and their chunks.
    pub(crate) fn spans(&self) -> impl Iterator<Item = (Range<u64>, &Evaluation)> {
        let nodes = self.nodes.iter();
        nodes.map(|(&first, (level, sums))| (first..first + (1 << level), sums))
    }

    /// The number of chunks in the sum.
    pub fn chunks(&self) -> u64 {
        self.nodes.values().map(|(level, _)| 1 << level).sum()
    }

    /// The end of the last chunk in the sum.
    pub fn end(&self) -> u64 {
        self.before(u64::MAX).unwrap_or(0)
    }

    fn add_span(&mut self, first: u64, level: u32, sums: Evaluation) -> Result<(), AccumulatorError> {
        if level > MOST_LEVELS.min(block_level(first)) || !first.is_multiple_of(1 << level) || first.checked_add(1 << level).is_none() {
            return Err(AccumulatorError::Misaligned { first, level });
        }
        if !sums.is_within(CHUNK << level) {
            return Err(AccumulatorError::Overfull { first, level });
        }
        let last = first + (1 << level) - 1;
        let overlaps_next = self.nodes.range(first..).next().is_some_and(|(&next, _)| next <= last);
        if overlaps_next || self.contains(first) {
            return Err(AccumulatorError::Doubled { first, last });
        }
        let (mut first, mut level, mut sums) = (first, level, sums);
        while level < block_level(first) {
            let sibling = first ^ (1 << level);
            match self.nodes.get(&sibling) {
                Some(&(its_level, other)) if its_level == level => {
                    self.nodes.remove(&sibling);
                    let (mut left, right) = if sibling < first { (other, sums) } else { (sums, other) };
                    left.merge(&right);
                    (first, level, sums) = (first.min(sibling), level + 1, left);
                }
                _ => break,
            }
        }
        self.nodes.insert(first, (level, sums));
        Ok(())
    }

    /// The end of the last span that starts at or before `chunk`.
    fn before(&self, chunk: u64) -> Option<u64> {
        let (&first, &(level, _)) = self.nodes.range(..=chunk).next_back()?;
        Some(first + (1 << level))
    }
}

impl From<Accumulator> for Vec<Node> {
    fn from(accumulator: Accumulator) -> Self {
        accumulator
            .nodes
            .into_iter()
            .map(|(first_chunk, (level, sums))| Node { first_chunk, level, sums })
            .collect()
    }
}

impl TryFrom<Vec<Node>> for Accumulator {
    type Error = AccumulatorError;

    fn try_from(nodes: Vec<Node>) -> Result<Self, AccumulatorError> {
        let mut accumulator = Self::default();
        for node in nodes {
            accumulator.add_span(node.first_chunk, node.level, node.sums)?;
        }
        Ok(accumulator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    /// A result whose sum depends on the order.
    fn result(chunk: u64) -> Evaluation {
        let mut result = Evaluation::default();
        for k in 0..5 {
            let x = ((chunk * 5 + k) as f64 * 0.7351 + 1.0).sin() * 1e3;
            result.on.push([x, 1.0 / x]);
            result.off.push([x * x, -x]);
            result.errors.push((chunk % 3) as u32);
        }
        result
    }

    fn sum(chunks: impl IntoIterator<Item = u64>) -> Accumulator {
        let mut accumulator = Accumulator::default();
        for chunk in chunks {
            accumulator.add(chunk, result(chunk)).expect("each chunk once");
        }
        accumulator
    }

    /// One frame a chunk, with these errors.
    fn sum_with(chunks: impl IntoIterator<Item = u64>, errors: impl Fn(u64) -> u32) -> Accumulator {
        let mut accumulator = Accumulator::default();
        for chunk in chunks {
            let mut result = Evaluation::default();
            result.errors.push(errors(chunk));
            accumulator.add(chunk, result).expect("each chunk once");
        }
        accumulator
    }

    #[test]
    fn a_plain_sum_depends_on_its_order() {
        let plain = |chunks: Vec<u64>| {
            let mut total = Evaluation::default();
            chunks.into_iter().for_each(|chunk| total.merge(&result(chunk)));
            total
        };
        assert_ne!(
            plain((0..40).collect()),
            plain((0..40).rev().collect()),
            "or the tests below show nothing"
        );
    }

    properties! {
        #[test]
        fn any_order_and_any_shards_give_the_same_bits(order in Just((0..40u64).collect::<Vec<_>>()).prop_shuffle(), cut in 0usize..40) {
            let whole = sum(0..40);
            prop_assert_eq!(&sum(order.clone()), &whole);
            let mut merged = sum(order[..cut].iter().copied());
            merged.merge(&sum(order[cut..].iter().copied())).expect("no chunk twice");
            prop_assert_eq!(merged.total(), whole.total());
            prop_assert_eq!(merged, whole);
        }

        #[test]
        fn what_was_written_is_read_back(chunks in prop::collection::btree_set(0..1000u64, 0..30)) {
            let accumulator = sum(chunks);
            let nodes: Vec<Node> = accumulator.clone().into();
            prop_assert_eq!(Accumulator::try_from(nodes), Ok(accumulator));
        }
    }

    #[test]
    fn few_sums_are_kept() {
        // Sixteen, and eight for each of six doublings.
        assert_eq!(sum(0..1024).nodes.len(), 16 + 6 * 8);
        assert_eq!([0, 15, 16, 17, 31, 32, 1000].map(block_end), [1, 16, 18, 18, 32, 36, 1024]);
    }

    #[test]
    fn a_run_stops_at_the_end_of_the_block_that_brings_enough() {
        // One error a chunk.
        let accumulator = sum_with(0..100, |_| 1);
        assert_eq!(accumulator.standing(0..100, None), ChunkProgress::Done(100));
        assert_eq!(accumulator.standing(0..120, None), ChunkProgress::Missing(100));
        assert_eq!(accumulator.standing(0..100, Some(13)), ChunkProgress::Done(13));
        assert_eq!(accumulator.standing(0..100, Some(33)), ChunkProgress::Done(36));
        assert_eq!(accumulator.standing(0..120, Some(101)), ChunkProgress::Missing(100));
        // The last block is cut where the run ends.
        assert_eq!(accumulator.standing(0..100, Some(97)), ChunkProgress::Done(100));
        // A part that starts in a block counts its own errors only.
        let part = sum_with(33..90, |_| 1);
        assert_eq!(part.standing(33..90, Some(3)), ChunkProgress::Done(36));
        assert_eq!(part.standing(33..90, Some(4)), ChunkProgress::Done(40));
        assert_eq!(part.standing(0..90, None), ChunkProgress::Missing(0));
        let mut cut = accumulator.clone();
        cut.truncate(36);
        assert_eq!((&cut, cut.chunks()), (&sum_with(0..36, |_| 1), 36));
    }

    #[test]
    fn doubled_and_damaged_spans_are_refused() {
        let mut accumulator = sum(0..8);
        assert_eq!(accumulator.merge(&sum(7..9)), Err(AccumulatorError::Doubled { first: 7, last: 7 }));
        let damaged = |first_chunk, level| {
            Accumulator::try_from(vec![Node {
                first_chunk,
                level,
                sums: Evaluation::default(),
            }])
        };
        assert_eq!(damaged(3, 1), Err(AccumulatorError::Misaligned { first: 3, level: 1 }));
        assert!(damaged(0, 64).is_err() && damaged(u64::MAX, 0).is_err());
        assert!(damaged(16, 2).is_err(), "longer than its block");
        let filled = |frames: u64| {
            let mut sums = Evaluation::default();
            (0..frames).for_each(|_| sums.errors.push(0));
            let node = |first_chunk, level| Node { first_chunk, level, sums };
            Accumulator::try_from(vec![node(0, 0), node(16, 1)])
        };
        assert!(filled(CHUNK).is_ok());
        assert_eq!(filled(CHUNK + 1), Err(AccumulatorError::Overfull { first: 0, level: 0 }));
    }
}
