//! The last readings, which are decoded again once the carrier is known.

use super::fit::Fit;
use super::history::FRAMES;
use super::lines::{Lines, Wave};
use link::framing::{Event, SegmentOutcome};
use link::panel::SoftPanel;

/// Score of an event that proves a carrier (nats). It is finite because a carrier that is wrong elsewhere may have the right signs during a
/// segment.
const PROOF_NATS: f32 = 10.0;

/// A reading with the sign as seen, not the carrier's.
#[derive(Clone, Copy, Debug)]
struct SignedReading {
    number: u64,
    /// The time of the frame (frame periods).
    time: f64,
    soft: SoftPanel,
}

/// The last readings, a ring whose oldest is at `next`.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    seen: [SignedReading; FRAMES],
    len: usize,
    next: usize,
}

impl Readings {
    pub const NONE: Self = Self {
        seen: [SignedReading {
            number: 0,
            time: 0.0,
            soft: SoftPanel::ERASED,
        }; FRAMES],
        len: 0,
        next: 0,
    };

    pub fn push(&mut self, number: u64, time: f64, soft: &SoftPanel) {
        self.seen[self.next] = SignedReading { number, time, soft: *soft };
        self.next = (self.next + 1) % FRAMES;
        self.len = (self.len + 1).min(FRAMES);
    }

    /// Forgets readings before that time (frame periods).
    pub fn forget_before(&mut self, time: f64) {
        let is_earlier = |index: usize| self.seen[(self.next + FRAMES - self.len + index) % FRAMES].time < time;
        self.len -= (0..self.len).take_while(|&index| is_earlier(index)).count();
    }

    /// A frame's reading with the sign of a carrier; the earliest has index 0.
    fn reading(&self, index: usize, fit: &Fit) -> (u64, f64, SoftPanel) {
        let seen = &self.seen[(self.next + FRAMES - self.len + index) % FRAMES];
        (seen.number, seen.time, fit.signed(seen.time, &seen.soft))
    }
}

/// Readings from before the carrier was known, with the signs that the carrier gives them. If several carriers explain them equally well,
/// each gives one set of signs.
#[derive(Clone, Copy, Debug)]
pub struct Reread<'a>(pub(super) Source<'a>);

/// The source of the readings.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    /// Frames with one sign each.
    Frames {
        readings: &'a Readings,
        fits: &'a [Fit],
        is_known: bool,
        /// A bit for each carrier with the signs of the one that is followed.
        followed: u8,
    },
    /// Frames in which each line has its own sign.
    Lines {
        lines: &'a Lines,
        /// Whether the wave was known before.
        is_followed: bool,
    },
}

/// A carrier that explains the frames, for [`Receiver::confirm_carrier`](crate::receiver::Receiver::confirm_carrier).
#[derive(Clone, Copy, Debug)]
pub struct CarrierCandidate {
    pub(super) carrier: Candidate,
    /// Whether the receiver follows it, or one with the same signs.
    pub(super) is_followed: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Candidate {
    Frames(Fit),
    Lines(Wave),
}

impl CarrierCandidate {
    /// Whether the receiver follows this carrier, so that the readings so far had its signs.
    pub fn is_followed(&self) -> bool {
        self.is_followed
    }

    /// The logarithm of its likelihood (nats), up to a constant, with that number of proofs.
    fn score(&self, proofs: usize) -> f32 {
        let by_frames = match self.carrier {
            Candidate::Frames(fit) => fit.score,
            Candidate::Lines(_) => 0.0,
        };
        by_frames + PROOF_NATS * proofs as f32
    }
}

impl Source<'_> {
    /// The numbers of carriers and of frames.
    fn counts(&self) -> [usize; 2] {
        match self {
            Self::Frames { readings, fits, .. } => [fits.len(), readings.len],
            Self::Lines { lines, .. } => [lines.waves().len(), lines.len()],
        }
    }

    fn carrier(&self, index: usize) -> CarrierCandidate {
        let (carrier, is_followed) = match self {
            Self::Frames { fits, followed, .. } => (Candidate::Frames(fits[index]), followed >> index & 1 == 1),
            Self::Lines { lines, is_followed } => (Candidate::Lines(lines.waves()[index]), *is_followed),
        };
        CarrierCandidate { carrier, is_followed }
    }

    /// A frame's reading with a carrier's signs: its number, its time (frame periods) and the soft values.
    fn reading(&self, carrier: usize, frame: usize) -> (u64, f64, SoftPanel) {
        match self {
            Self::Frames { readings, fits, .. } => readings.reading(frame, &fits[carrier]),
            Self::Lines { lines, .. } => lines.reading(frame, &lines.waves()[carrier]),
        }
    }
}

impl Reread<'_> {
    /// Whether an event that is decoded from a carrier's readings shows that their signs are right: a beacon, 50 bits of which are fixed,
    /// or a segment that satisfies its code.
    pub fn is_proof(event: &Event<'_>) -> bool {
        let is_decoded = |outcome: &SegmentOutcome| matches!(outcome, SegmentOutcome::Decoded { .. });
        match event {
            Event::Beacon { .. } | Event::Delivered(_) => true,
            Event::Segment { outcome, .. } => is_decoded(outcome),
            _ => false,
        }
    }

    /// Decodes the readings of each carrier, and returns the result for the right one: the known carrier, or else the likeliest if it has a
    /// [proof](Self::is_proof). Such a carrier is returned, too: [confirm](crate::receiver::Receiver::confirm_carrier) it.
    ///
    /// `decode` gets each frame's number, its delay after the time that the number implies (frame periods), and the soft values, from the
    /// earliest frame on. It returns the number of proofs and its result.
    pub fn decode<T>(
        &self,
        mut decode: impl FnMut(&mut dyn Iterator<Item = (u64, f64, SoftPanel)>) -> Option<(usize, T)>,
    ) -> Option<(T, Option<CarrierCandidate>)> {
        let [carriers, frames] = self.0.counts();
        let (mut best, mut most) = (None, f32::NEG_INFINITY);
        for index in 0..carriers {
            let carrier = self.0.carrier(index);
            let mut readings = (0..frames).map(|frame| {
                let (number, time, soft) = self.0.reading(index, frame);
                (number, time - number as f64, soft)
            });
            let Some((proofs, decoded)) = decode(&mut readings) else {
                continue;
            };
            if self.is_known() {
                return Some((decoded, None));
            }
            let score = carrier.score(proofs);
            if score > most {
                (best, most) = ((proofs > 0).then_some((decoded, Some(carrier))), score);
            }
        }
        best
    }

    fn is_known(&self) -> bool {
        match self.0 {
            Source::Frames { is_known, .. } => is_known,
            Source::Lines { lines, is_followed } => lines.is_known() && !is_followed,
        }
    }
}
