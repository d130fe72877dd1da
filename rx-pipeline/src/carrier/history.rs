//! Sightings of the carrier in the last frames.

/// Number of frames in the history.
pub(super) const FRAMES: usize = 128;

/// A frame's evidence about the carrier.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    /// The time of the frame, in frame periods.
    pub time: f64,
    /// The share of the light there that the LEDs' bits modulate, at least 0.
    pub modulation: f32,
    /// An earlier sighting of the same symbol: its age in sightings, and whether one shows the complement of the other.
    pub pair: Option<(u8, bool)>,
}

/// The sightings of the last frames, the earliest first.
#[derive(Clone, Debug)]
pub(super) struct History {
    sightings: [Sighting; FRAMES],
    len: usize,
    /// Number of the earliest sightings that are hidden for now.
    hidden: usize,
}

impl History {
    pub const EMPTY: Self = Self {
        sightings: [Sighting {
            time: 0.0,
            modulation: 0.0,
            pair: None,
        }; FRAMES],
        len: 0,
        hidden: 0,
    };

    pub fn push(&mut self, sighting: Sighting) {
        self.keep_last(FRAMES - 1);
        self.sightings[self.len] = sighting;
        self.len += 1;
    }

    /// Forgets all but the last `count`.
    fn keep_last(&mut self, count: usize) {
        let dropped = self.len.saturating_sub(count);
        if dropped > 0 {
            self.sightings.copy_within(dropped..self.len, 0);
            self.len -= dropped;
        }
    }

    /// Forgets sightings before that time.
    pub fn forget_before(&mut self, time: f64) {
        self.keep_last(self.sightings().iter().filter(|sighting| sighting.time >= time).count());
    }

    pub fn sightings(&self) -> &[Sighting] {
        &self.sightings[self.hidden..self.len]
    }

    /// Hides the earliest sightings until [`show_all`](Self::show_all) or [`forget_hidden`](Self::forget_hidden).
    pub fn hide(&mut self, earliest: usize) {
        self.hidden = earliest.min(self.len);
    }

    pub fn show_all(&mut self) {
        self.hidden = 0;
    }

    pub fn forget_hidden(&mut self) {
        let hidden = core::mem::take(&mut self.hidden);
        self.keep_last(self.len - hidden);
    }

    /// The last sightings, at most `count`.
    pub fn last(&self, count: usize) -> &[Sighting] {
        let sightings = self.sightings();
        &sightings[sightings.len().saturating_sub(count)..]
    }

    /// Number of sightings that show the complement of an earlier one.
    pub fn reversals(&self) -> usize {
        let is_reversed = |sighting: &&Sighting| matches!(sighting.pair, Some((_, true)));
        self.sightings().iter().filter(is_reversed).count()
    }

    /// Whether the frames were taken [steadily](is_steady).
    pub fn is_steady(&self) -> bool {
        is_steady(self.sightings().iter().map(|sighting| sighting.time))
    }
}

/// Whether all frames are a whole number of frame periods apart, so that frequencies above half a cycle a period look like lower ones.
pub(super) fn is_steady(mut times: impl Iterator<Item = f64>) -> bool {
    let Some(first) = times.next() else { return true };
    times.all(|time| {
        let periods = time - first;
        (periods - libm::round(periods)).abs() < STEADY
    })
}

/// Maximum deviation of a steady frame's time (frame periods).
const STEADY: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sightings_before_a_time_are_forgotten() {
        let mut history = History::EMPTY;
        (0..200).for_each(|number| {
            history.push(Sighting {
                time: f64::from(number),
                modulation: 1.0,
                pair: None,
            });
        });
        history.forget_before(150.0);
        let times = history.sightings().iter().map(|sighting| sighting.time);
        assert!(times.eq((150..200).map(f64::from)));
    }
}
