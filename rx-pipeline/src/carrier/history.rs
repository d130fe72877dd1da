//! Sightings of the carrier in the last frames.

/// Frames that are remembered.
pub(super) const FRAMES: usize = 128;

/// What a frame shows of the carrier.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    /// When it was taken, in frame periods.
    pub time: f64,
    /// How much of the light there the LEDs' bits make; not negative.
    pub modulation: f32,
    /// That it shows the same symbol as an earlier one: how many sightings before, and whether as its complement.
    pub pair: Option<(u8, bool)>,
}

/// The last frames, the earliest first.
#[derive(Clone, Debug)]
pub(super) struct History {
    sightings: [Sighting; FRAMES],
    len: usize,
    /// How many of the earliest are hidden for the time being.
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

    /// Forgets all but the last of them.
    fn keep_last(&mut self, count: usize) {
        let dropped = self.len.saturating_sub(count);
        if dropped > 0 {
            self.sightings.copy_within(dropped..self.len, 0);
            self.len -= dropped;
        }
    }

    /// Forgets those before that time.
    pub fn forget_before(&mut self, time: f64) {
        self.keep_last(self.sightings().iter().filter(|sighting| sighting.time >= time).count());
    }

    pub fn sightings(&self) -> &[Sighting] {
        &self.sightings[self.hidden..self.len]
    }

    /// Hides the earliest until they are [shown](Self::show_all) again or [forgotten](Self::forget_hidden).
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

    /// The last of them, at most `count`.
    pub fn last(&self, count: usize) -> &[Sighting] {
        let sightings = self.sightings();
        &sightings[sightings.len().saturating_sub(count)..]
    }

    /// How many of them show the complement of what was seen before.
    pub fn reversals(&self) -> usize {
        let is_reversed = |sighting: &&Sighting| matches!(sighting.pair, Some((_, true)));
        self.sightings().iter().filter(is_reversed).count()
    }

    /// Whether they were taken [steadily](is_steady).
    pub fn is_steady(&self) -> bool {
        is_steady(self.sightings().iter().map(|sighting| sighting.time))
    }
}

/// Whether frames were all taken a whole number of frame periods after each other, so that frequencies more than half a cycle a period look
/// like lower ones.
pub(super) fn is_steady(mut times: impl Iterator<Item = f64>) -> bool {
    let Some(first) = times.next() else { return true };
    times.all(|time| {
        let periods = time - first;
        (periods - libm::round(periods)).abs() < STEADY
    })
}

/// Frames are steady that are late by less (frame periods).
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
