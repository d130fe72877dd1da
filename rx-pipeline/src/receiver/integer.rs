//! Panels followed and read in whole numbers, for processors that have no floating point.
//!
//! A panel is found by its blinking (`integer/blinking.rs`), and has to prove that it is one (`proof.rs`). From then on a frame
//! costs 401 samples of it: five on each LED, one on each corner of its cell (`integer/samples.rs`). From these come the bits
//! (`integer/decision.rs`), and by how much each corner of the panel has moved (`integer/following.rs`).

mod blinking;
mod decision;
mod following;
mod outline;
mod samples;
#[cfg(test)]
mod tests;

use core::borrow::BorrowMut;

use super::proof::Proof;
use super::settings::ReceiverError;
use crate::corners::Corners;
use crate::detect::Mixture;
use crate::frame::Frame;
use crate::profile::{Profile, Stage};
use crate::settings::TrackingSettings;
use crate::symbols::{MessageDecoder, SymbolClock};
use decision::Decision;
use link::framing::Event;
use link::orientation::Orientation;
use link::panel::SoftPanel;
use outline::Outline;
use samples::Samples;

pub use blinking::{BlinkSearch, BlinkSearchError};

/// Frames in a row that may miss the panel before it is given up.
const PATIENCE_FRAMES: u32 = TrackingSettings::DEFAULT.patience_frames as u32;

/// One frame's panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegerReading {
    /// Where it is.
    pub corners: Corners,
    /// Bit 8·row + column: 1 for On.
    pub bits: u64,
    /// How sure that is of each LED.
    pub soft: SoftPanel,
    /// The share of bits that are right if the soft values are: 0.5 to 1.
    pub confidence: f32,
    /// Whether the exposure seems to have caught two symbols.
    pub is_mixed: bool,
}

/// What a frame brought.
#[derive(Debug)]
pub struct IntegerOutcome<'a> {
    /// Whether a panel is followed, in this frame or through a gap: what was found, and has proved to be one since.
    pub is_following: bool,
    /// The panel, or what may be one, where it was read.
    pub reading: Option<IntegerReading>,
    /// Whether a panel was looked for in the frame where none is followed, or why it could not be.
    pub search: Result<(), BlinkSearchError>,
    /// Which way up the picture has the panel, by the symbols before: known from the first header of a message on.
    pub orientation: Option<Orientation>,
    /// What the symbol before this frame's meant for the message.
    pub event: Event<'a>,
}

/// Frames to messages, of one panel, read in whole numbers: its frames are linear in light, as those of small sensors are, and the
/// panel moves by less than a quarter of its pitch from one frame to the next.
pub struct IntegerReceiver<B> {
    search: BlinkSearch<B>,
    decoder: MessageDecoder,
    track: Option<Track>,
    proof: Proof,
}

/// A panel that is followed.
struct Track {
    outline: Outline,
    /// How far apart the two groups of LEDs usually are, see [`Decision::distance`].
    usual: u32,
    missed: u32,
}

impl Track {
    /// Reads the panel in a frame, and moves along with it.
    fn read(&mut self, frame: &Frame<'_>, profile: &mut impl Profile) -> Option<(IntegerReading, Decision)> {
        let samples = profile.timed(Stage::Features, || Samples::take(frame, &self.outline));
        let decision = profile.timed(Stage::Detect, || samples.as_ref().and_then(Decision::of));
        let (Some(samples), Some(decision)) = (samples, decision) else {
            self.missed += 1;
            return None;
        };
        let is_mixed = decision.distance.saturating_mul(3) < self.usual;
        if !is_mixed {
            profile.timed(Stage::Follow, || self.follow(&samples, &decision));
        }
        let corners = self.outline.corners();
        // Two symbols at once are a panel still; for long they are none. No more is an outline that has collapsed.
        self.missed = if is_mixed || corners.is_none() { self.missed + 1 } else { 0 };
        let reading = IntegerReading {
            corners: corners?,
            bits: decision.bits,
            soft: decision.soft,
            confidence: decision.confidence(),
            is_mixed,
        };
        Some((reading, decision))
    }

    fn follow(&mut self, samples: &Samples, decision: &Decision) {
        let usual = 7 * u64::from(self.usual) + u64::from(decision.distance);
        self.usual = usual.div_ceil(8) as u32;
        self.outline.correct(samples, decision.bits);
    }
}

impl<B: BorrowMut<[u8]>> IntegerReceiver<B> {
    /// A receiver that has seen nothing, and the room that its search needs: [`BlinkSearch::bytes`].
    ///
    /// # Errors
    /// [`ReceiverError`] if the rate, symbols in a frame's period, is not above 0 and at most 1.
    pub fn new(symbols_per_frame: f32, room: B) -> Result<Self, ReceiverError> {
        Ok(Self {
            search: BlinkSearch::new(room),
            decoder: MessageDecoder::of(SymbolClock::new(symbols_per_frame)?),
            track: None,
            proof: Proof::new(symbols_per_frame),
        })
    }

    /// The next frames are exposed otherwise.
    pub fn expect_another_exposure(&mut self) {
        self.search.expect_another_exposure();
    }

    /// Forgets everything and goes by another symbol rate.
    ///
    /// # Errors
    /// [`ReceiverError`] if it is out of its range; then nothing changes.
    #[inline(never)]
    pub fn begin(&mut self, symbols_per_frame: f32) -> Result<(), ReceiverError> {
        self.decoder.restart(SymbolClock::new(symbols_per_frame)?);
        self.track = None;
        self.proof = Proof::new(symbols_per_frame);
        self.search.forget();
        Ok(())
    }

    /// Takes in frame `number`. Numbers rise; those that are left out are lost frames.
    pub fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> IntegerOutcome<'_> {
        let mut search = Ok(());
        if self.track.is_none() {
            match self.find(number, frame, profile) {
                Ok(found) => self.track = found,
                Err(error) => search = Err(error),
            }
        }
        let read = self.track.as_mut().and_then(|track| track.read(frame, profile));
        if let Some((reading, decision)) = &read {
            let is_sure = !reading.is_mixed && decision.is_parted();
            self.proof.see(reading.corners, is_sure.then_some(decision.bits));
        }
        let orientation = self.decoder.orientation();
        let event = profile.timed(Stage::Decode, || match &read {
            Some((reading, decision)) => {
                let mixture = reading.is_mixed.then_some(&Mixture::INSEPARABLE);
                self.decoder.push(number, &decision.soft, mixture).event
            }
            None => Event::Nothing,
        });
        self.proof.judge(number, &event);
        let is_following = self.proof.is_panel();
        let is_missed = |track: &Track| track.missed >= PATIENCE_FRAMES;
        let is_over = self.proof.has_failed() || self.track.as_ref().is_some_and(is_missed);
        if is_over {
            self.proof.lost(number);
            self.track = None;
        }
        IntegerOutcome {
            is_following: is_following && !is_over,
            reading: read.map(|(reading, _)| reading),
            search,
            orientation,
            event,
        }
    }

    fn find(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> Result<Option<Track>, BlinkSearchError> {
        let others = self.proof.others(number);
        let found = profile.timed(Stage::Search, || self.search.find_beside(frame, others))?;
        let Some(found) = found else {
            return Ok(None);
        };
        self.search.forget();
        self.proof.found(found, number);
        Ok(Some(Track {
            outline: Outline::of(&found),
            usual: 0,
            missed: 0,
        }))
    }
}
