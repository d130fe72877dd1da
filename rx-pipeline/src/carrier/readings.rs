//! The last readings, to be read again once the carrier is known.

use super::fit::Fit;
use super::history::FRAMES;
use link::panel::SoftPanel;

/// A reading as it was seen, with the carrier's sign or not.
#[derive(Clone, Copy, Debug)]
struct Seen {
    number: u64,
    /// When it was taken (frame periods).
    time: f64,
    soft: SoftPanel,
}

/// The last readings, the oldest at `next`.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    seen: [Seen; FRAMES],
    len: usize,
    next: usize,
}

impl Readings {
    pub const NONE: Self = Self {
        seen: [Seen {
            number: 0,
            time: 0.0,
            soft: SoftPanel::ERASED,
        }; FRAMES],
        len: 0,
        next: 0,
    };

    pub fn push(&mut self, number: u64, time: f64, soft: &SoftPanel) {
        self.seen[self.next] = Seen { number, time, soft: *soft };
        self.next = (self.next + 1) % FRAMES;
        self.len = (self.len + 1).min(FRAMES);
    }

    fn oldest_first(&self) -> impl Iterator<Item = &Seen> {
        (0..self.len).map(|i| &self.seen[(self.next + FRAMES - self.len + i) % FRAMES])
    }
}

/// Readings of frames before the carrier was known, with the signs that it gives them: or with those of each carrier that may be, if more
/// than one explain them as well.
#[derive(Clone, Copy, Debug)]
pub struct Reread<'a> {
    pub(super) readings: &'a Readings,
    pub(super) fits: &'a [Fit],
    pub(super) is_known: bool,
}

impl Reread<'_> {
    /// Whether the carrier is known, so that later readings go on with these signs.
    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// By each carrier, the numbers of the frames, by how many frame periods they were taken later than these say, and their soft values, the
    /// earliest first.
    pub fn each(&self) -> impl Iterator<Item = impl Iterator<Item = (u64, f64, SoftPanel)>> {
        self.fits.iter().map(|fit| {
            self.readings.oldest_first().map(|seen| {
                let soft = fit.signed(seen.time, &seen.soft);
                (seen.number, seen.time - seen.number as f64, soft)
            })
        })
    }
}
