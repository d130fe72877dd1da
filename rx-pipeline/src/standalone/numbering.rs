//! Numbers frames by their end times, and counts the missing ones that were dropped.

/// Numbers the frames of a camera.
pub struct Numbering {
    period_us: u64,
    last: Option<Last>,
    /// The last count of frames cut short.
    cut_short: u32,
    /// Times for the last two frames, µs: while one is processed, memory holds the next one, and further ones are dropped.
    busy_us: [u64; 2],
}

/// The frame before.
#[derive(Clone, Copy)]
struct Last {
    number: u64,
    ended_us: u64,
}

impl Numbering {
    /// For frames with that period in µs.
    pub fn new(period_us: u32) -> Self {
        Self {
            period_us: u64::from(period_us).max(1),
            last: None,
            cut_short: 0,
            busy_us: [0; 2],
        }
    }

    /// The number of a frame that ended at `ended_us`, and the frames dropped before it, given that `cut_short` were cut short since the
    /// start. Frames cut short do not count as dropped, nor do gaps in which the camera stood still: the processing time limits the count.
    pub fn next(&mut self, ended_us: u64, cut_short: u32) -> (u64, u32) {
        let cut = self.cut_since(cut_short);
        let (number, missing) = self.last.map_or((0, 0), |last| {
            let elapsed_us = ended_us.saturating_sub(last.ended_us);
            let periods = self.periods(elapsed_us).max(1);
            (last.number.saturating_add(periods), periods - 1)
        });
        let worked_for = self.periods(self.busy_us[0].saturating_add(self.busy_us[1]));
        let passed_by = missing.saturating_sub(cut.into()).min(worked_for);
        self.last = Some(Last { number, ended_us });
        (number, passed_by.min(u32::MAX.into()) as u32)
    }

    /// Notes the time that a frame took.
    pub fn was_busy(&mut self, took_us: u64) {
        self.busy_us = [self.busy_us[1], took_us];
    }

    /// Notes that the camera is reset: frames missing until its next one were not dropped.
    pub fn interrupt(&mut self) {
        self.busy_us = [0; 2];
    }

    /// Frames cut short since the last call of this or of [`next`](Self::next).
    pub fn cut_since(&mut self, cut_short: u32) -> u32 {
        let since = cut_short.wrapping_sub(self.cut_short);
        self.cut_short = cut_short;
        since
    }

    /// The time in frame periods, rounded.
    fn periods(&self, us: u64) -> u64 {
        us.saturating_add(self.period_us / 2) / self.period_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_US: u32 = 75_576;

    fn at(periods: u64) -> u64 {
        periods * u64::from(PERIOD_US) + 1234
    }

    #[test]
    fn frames_that_pass_by_while_one_is_worked_on_are_counted() {
        let mut numbering = Numbering::new(PERIOD_US);
        assert_eq!(numbering.next(at(0), 0), (0, 0));
        numbering.was_busy(370_000);
        assert_eq!(numbering.next(at(1), 0), (1, 0));
        numbering.was_busy(6_000);
        assert_eq!(numbering.next(at(6), 0), (6, 4));
        numbering.was_busy(6_000);
        assert_eq!(numbering.next(at(7), 0), (7, 0));
    }

    #[test]
    fn frames_that_were_cut_short_did_not_pass_by() {
        let mut numbering = Numbering::new(PERIOD_US);
        numbering.next(at(0), 3);
        numbering.was_busy(200_000);
        assert_eq!(numbering.next(at(4), 5), (4, 1));
        assert_eq!(numbering.cut_since(6), 1);
        assert_eq!(numbering.cut_since(6), 0);
    }

    #[test]
    fn nothing_passes_by_where_the_camera_stands_still() {
        let mut numbering = Numbering::new(PERIOD_US);
        numbering.next(at(0), 0);
        numbering.was_busy(6_000);
        assert_eq!(numbering.next(at(9), 0), (9, 0));
        numbering.was_busy(700_000);
        numbering.interrupt();
        assert_eq!(numbering.next(at(40), 0), (40, 0));
    }

    #[test]
    fn any_times_are_survived() {
        let mut numbering = Numbering::new(0);
        assert_eq!(numbering.next(u64::MAX, 0).0, 0);
        numbering.was_busy(u64::MAX);
        assert_eq!(numbering.next(0, u32::MAX), (1, 0));
        numbering.was_busy(u64::MAX);
        assert_eq!(numbering.next(u64::MAX, u32::MAX), (u64::MAX, u32::MAX));
    }
}
