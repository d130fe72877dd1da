//! Converts a frame's number from the camera into its index among all received frames.

/// Maximum number of runs kept, 16 bytes each.
const RUNS_MAX: usize = 1 << 16;

/// Ascending frame numbers as runs without a gap, so that memory grows with lost frames, not with received ones, up to [`RUNS_MAX`] runs.
/// The index of a discarded number is that of the first one kept.
#[derive(Debug, Default)]
pub struct Places {
    /// The first number of each run, and its index.
    runs: Vec<(u64, u64)>,
    next: u64,
    count: u64,
}

impl Places {
    /// Adds the next frame's number.
    pub fn push(&mut self, number: u64) {
        if self.runs.is_empty() || number != self.next {
            if self.runs.len() == RUNS_MAX {
                self.runs.drain(..RUNS_MAX / 2);
            }
            self.runs.push((number, self.count));
        }
        self.next = number.saturating_add(1);
        self.count += 1;
    }

    /// The number of frames.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The number of frames with a smaller number.
    pub fn of(&self, number: u64) -> u64 {
        let begun = self.runs.partition_point(|&(first, _)| first <= number);
        let end = self.runs.get(begun).map_or(self.count, |&(_, place)| place);
        match self.runs[..begun].last() {
            Some(&(first, place)) => (place + (number - first)).min(end),
            None => self.runs.first().map_or(0, |&(_, place)| place),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_the_count_of_smaller_numbers() {
        // All subsets of the first ten frames as losses.
        for lost in 0u32..1 << 10 {
            let numbers: Vec<u64> = (0..12).filter(|number| lost >> number & 1 == 0).collect();
            let mut places = Places::default();
            numbers.iter().for_each(|&number| places.push(number));
            assert_eq!(places.count(), numbers.len() as u64);
            for number in 0..15 {
                let smaller = numbers.iter().filter(|&&other| other < number).count();
                assert_eq!(places.of(number), smaller as u64, "{number} of {numbers:?}");
            }
        }
    }

    #[test]
    fn gaps_without_end_take_no_more_memory() {
        let mut places = Places::default();
        (0..1_000_000).for_each(|number| places.push(2 * number));
        assert!(places.runs.len() <= RUNS_MAX);
        assert_eq!((places.count(), places.of(1_999_998)), (1_000_000, 999_999));
        assert_eq!(places.of(0), places.runs[0].1);
    }

    #[test]
    fn frames_without_a_gap_take_no_memory() {
        let mut places = Places::default();
        (7..100_000).for_each(|number| places.push(number));
        assert_eq!((places.runs.len(), places.of(50_000)), (1, 49_993));
    }
}
