//! Follows and reads panels in integer arithmetic, for processors without floating point.
//!
//! A panel is found by its blinking (`integer/blinking.rs`) and has to prove that it is one (`proof.rs`). From then on, each frame needs
//! 401 samples of it: five on each LED, and one on each corner of its cell (`integer/samples.rs`). They give the bits
//! (`integer/decision.rs`) and the motion of each corner of the panel (`integer/following.rs`).

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

/// Maximum number of successive frames without the panel before it is given up.
const PATIENCE_FRAMES: u32 = TrackingSettings::DEFAULT.patience_frames as u32;

/// The reading of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegerReading {
    /// The panel's corners.
    pub corners: Corners,
    /// Bit 8·row + column: 1 for On.
    pub bits: u64,
    /// The soft value of each LED.
    pub soft: SoftPanel,
    /// The mean probability of a right bit according to the soft values: 0.5 to 1.
    pub confidence: f32,
    /// Whether the exposure seems to show two symbols.
    pub is_mixed: bool,
}

/// The result of one frame.
#[derive(Debug)]
pub struct IntegerOutcome<'a> {
    /// Whether a panel is followed, in this frame or through a gap. It has proved to be one since it was found.
    pub is_following: bool,
    /// The reading of the panel, or of a candidate, if there is one.
    pub reading: Option<IntegerReading>,
    /// Whether the frame could be searched for a panel, if none is followed; otherwise the reason.
    pub search: Result<(), BlinkSearchError>,
    /// The panel's orientation in the picture according to earlier symbols, known from the first message header on.
    pub orientation: Option<Orientation>,
    /// The event of the symbol before this frame's.
    pub event: Event<'a>,
}

/// Decodes frames of one panel into messages in integer arithmetic. Frames must be linear in light, as those of small sensors are, and the
/// panel must move by less than a quarter of its pitch from one frame to the next.
pub struct IntegerReceiver<B> {
    search: BlinkSearch<B>,
    decoder: MessageDecoder,
    track: Option<Track>,
    proof: Proof,
}

/// A followed panel.
struct Track {
    outline: Outline,
    /// The usual distance of the two groups of LEDs, see [`Decision::distance`].
    usual: u32,
    missed: u32,
}

impl Track {
    /// Reads the panel in a frame and follows its motion.
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
        // A frame of two symbols may still show a panel, but a long run of them does not. Nor does an outline that has collapsed.
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
    /// A receiver that has not seen a frame, with the memory for its search: [`BlinkSearch::bytes`].
    ///
    /// # Errors
    /// [`ReceiverError`] if the rate, in symbols a frame period, is not above 0 and at most 1.
    pub fn new(symbols_per_frame: f32, room: B) -> Result<Self, ReceiverError> {
        Ok(Self {
            search: BlinkSearch::new(room),
            decoder: MessageDecoder::of(SymbolClock::new(symbols_per_frame)?),
            track: None,
            proof: Proof::new(symbols_per_frame),
        })
    }

    /// Announces that the exposure of the next frames differs.
    pub fn expect_another_exposure(&mut self) {
        self.search.expect_another_exposure();
    }

    /// Forgets everything and continues with another symbol rate.
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

    /// Processes frame `number`. Numbers rise; omitted numbers are lost frames.
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
