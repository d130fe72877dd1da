//! Schedules searches for a panel that is followed at a doubtful place.

/// Maximum number of frames between two searches (frames). More: cheaper if doubts remain, but a panel that is followed beside its place
/// is found later.
const LONGEST_FRAMES: u32 = 8;

/// Each unsuccessful search lengthens the wait for the next one: 1, 2, 4, 8 frames.
#[derive(Clone, Copy)]
pub(super) struct Backoff {
    wait: u32,
    left: u32,
}

impl Backoff {
    /// No wait.
    pub const NONE: Self = Self { wait: 0, left: 0 };

    /// Whether a search is due in this frame; otherwise counts the frame.
    pub fn is_due(&mut self) -> bool {
        let is_due = self.left == 0;
        self.left = self.left.saturating_sub(1);
        is_due
    }

    /// Starts a wait after a search, longer than the last one.
    pub fn wait_longer(&mut self) {
        self.left = self.wait;
        self.wait = (2 * self.wait).clamp(1, LONGEST_FRAMES);
    }

    /// Shortens the wait after a frame without doubts.
    pub fn shorten(&mut self) {
        self.wait /= 2;
        self.left = self.left.min(self.wait);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_in_vain_become_rare_and_frequent_again() {
        let mut backoff = Backoff::NONE;
        let mut searched = std::vec::Vec::new();
        for frame in 0..40 {
            if frame == 30 {
                (0..4).for_each(|_| backoff.shorten());
            }
            if backoff.is_due() {
                searched.push(frame);
                backoff.wait_longer();
            }
        }
        assert_eq!(searched, [0, 1, 3, 6, 11, 20, 29, 30, 31, 33, 36]);
    }
}
