//! Decides whether a followed place is a panel, and which areas the search skips.

use super::blinked::{Area, BlinkHistory, SkippedPlaces, Verdict, proof_frames};
use crate::corners::Corners;
use link::framing::Event;

/// The evidence about a followed place. Signs, lamps and edges blink too, and are found. A place fails if it does not behave like a panel
/// within 30 symbols, and is then skipped for 90.
pub struct Proof {
    place: Option<Place>,
    skipped: SkippedPlaces,
    /// Frames in which a place has to prove to be a panel.
    frames: u64,
}

/// A followed place.
struct Place {
    blinked: BlinkHistory,
    /// Its last corners.
    corners: Corners,
    verdict: Verdict,
}

impl Proof {
    /// A state without a followed or skipped place, at that many symbols a frame, above 0.
    pub fn new(symbols_per_frame: f32) -> Self {
        Self {
            place: None,
            skipped: SkippedPlaces::NONE,
            frames: proof_frames(symbols_per_frame),
        }
    }

    /// Starts to follow a place in frame `number`.
    pub(crate) fn found(&mut self, corners: Corners, number: u64) {
        self.place = Some(Place {
            blinked: BlinkHistory::new(number),
            corners,
            verdict: Verdict::Unsure,
        });
    }

    /// Adds a reading at these corners, with its bits if they are valid: noise forms two groups of LEDs as well.
    pub(crate) fn see(&mut self, corners: Corners, bits: Option<u64>) {
        let Some(place) = &mut self.place else { return };
        place.corners = corners;
        if let Some(bits) = bits {
            place.blinked.see(bits);
        }
    }

    /// Judges the place at frame `number` after the event of the symbol before.
    pub(crate) fn judge(&mut self, number: u64, event: &Event<'_>) {
        let Some(place) = &mut self.place else { return };
        place.blinked.add_event(event);
        place.verdict = place.blinked.verdict(number, self.frames);
    }

    /// Whether the place has proved to be a panel.
    pub(crate) fn is_panel(&self) -> bool {
        self.verdict() == Some(Verdict::Panel)
    }

    /// Whether the place is not a panel, or no longer one.
    pub(crate) fn has_failed(&self) -> bool {
        matches!(self.verdict(), Some(Verdict::Other | Verdict::Gone))
    }

    /// Stops following the place from frame `number` on.
    pub(crate) fn lost(&mut self, number: u64) {
        if let Some(place) = self.place.take() {
            self.skipped.add(&place.corners, place.verdict, number, self.frames);
        }
    }

    /// The areas that a search skips in frame `number`.
    pub(crate) fn others(&self, number: u64) -> impl Iterator<Item = Area> {
        self.skipped.areas(number)
    }

    fn verdict(&self) -> Option<Verdict> {
        self.place.as_ref().map(|place| place.verdict)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f32 = 0.68;

    /// A place whose readings are noise: they differ from frame to frame like a panel's symbols, and would prove one.
    fn after_noise(means_something: bool) -> Proof {
        let corners = Corners::new([[20.0, 30.0], [41.0, 30.0], [41.0, 51.0], [20.0, 51.0]]);
        let (corners, mut noise) = (corners.unwrap(), 77u64);
        let mut proof = Proof::new(RATE);
        proof.found(corners, 7);
        for number in 7..=7 + proof_frames(RATE) {
            noise ^= noise << 13;
            noise ^= noise >> 7;
            noise ^= noise << 17;
            proof.see(corners, means_something.then_some(noise));
            proof.judge(number, &Event::Nothing);
        }
        proof
    }

    #[test]
    fn readings_that_mean_nothing_prove_nothing() {
        assert!(after_noise(true).is_panel());
        let mut proof = after_noise(false);
        assert!(proof.has_failed());
        proof.lost(100);
        assert!(!proof.has_failed());
        assert_eq!(proof.others(101).count(), 1);
    }
}
