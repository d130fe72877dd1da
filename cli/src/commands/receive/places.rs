//! The place of each frame among all, by the number that the camera gave it.

/// The most runs that are kept, 16 bytes each.
const RUNS_MAX: usize = 1 << 16;

/// Numbers of frames, each greater than the one before, as runs without a gap: what is kept grows with the frames that were lost, not
/// with those that were seen, and no further than [`RUNS_MAX`]. The place of what is older is that of the first frame that is not.
#[derive(Debug, Default)]
pub struct Places {
    /// The first number of each run, and its place.
    runs: Vec<(u64, u64)>,
    next: u64,
    count: u64,
}

impl Places {
    /// Takes in the number of the next frame.
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

    /// How many frames there have been.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// How many of them have a smaller number.
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
        // Every set of frames that can be lost of the first ten.
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
