//! The interface that finds a panel in frames, follows it and reads it.

use core::borrow::BorrowMut;

use crate::corners::Corners;
use crate::frame::Frame;
use crate::profile::{Profile, Stage};
use crate::receiver::{BlinkSearch, IntegerReceiver, Loss, Proof, Receiver, ReceiverMemory, ReceiverSettings};
use link::framing::Event;
use link::orientation::Orientation;
use link::panel::{PanelFrame, SoftPanel};

/// Minimum confidence of a reading that is evidence: that of two groups of LEDs four of their deviations apart. Noise splits into two
/// groups 2.7 deviations apart.
const LEAST_CONFIDENCE: f32 = 0.977;

/// A panel in a frame: in the panel's own rows and columns once its orientation is known. Before that, and in a mirrored picture, in those
/// of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// The panel's position.
    pub corners: Corners,
    /// The On LEDs.
    pub bits: PanelFrame,
    /// The soft value of each LED.
    pub soft: SoftPanel,
    /// Whether the exposure seems to have caught two symbols.
    pub is_mixed: bool,
    /// The expected share of right bits by the soft values.
    pub confidence: f32,
}

impl Sighting {
    /// Converts to the panel's own rows and columns, once its orientation is known; those of a mirrored picture stay mirrored.
    fn upright(self, orientation: Option<Orientation>) -> Self {
        let orientation = orientation.unwrap_or_default().turn();
        Self {
            corners: self.corners.upright(orientation.quarter_turns()),
            bits: self.bits.upright(orientation),
            soft: self.soft.upright(orientation),
            ..self
        }
    }
}

/// The result of a frame.
#[derive(Debug)]
pub struct FrameOutcome<'a> {
    /// Whether a panel is followed, in this frame or through a gap.
    pub is_following: bool,
    /// The panel, if it was read.
    pub sighting: Option<Sighting>,
    /// The event that the symbol before this frame's caused.
    pub event: Event<'a>,
}

/// Finds a panel in whole frames, follows it and reads it.
pub trait Follow {
    /// Processes frame `number`. Numbers rise; skipped ones are lost frames.
    fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> FrameOutcome<'_>;

    /// Resets all state for this number of symbols per frame, above 0 and at most 1; `None` if it cannot.
    fn begin(&mut self, symbols_per_frame: f32) -> Option<()>;

    /// Announces that the next frames have another exposure.
    fn expect_another_exposure(&mut self);
}

/// A [`Receiver`] with a [`BlinkSearch`], which takes little memory. The receiver takes about 40 kB, which must not pass through a small
/// stack.
pub struct PanelReceiver<const PIXELS: usize, M, B> {
    /// The receiver.
    pub receiver: Receiver<PIXELS, M>,
    /// Its settings.
    pub settings: ReceiverSettings,
    /// The search for the panel.
    pub search: BlinkSearch<B>,
    /// The test that the found object is a panel and not another blinking one; nothing is followed at first.
    pub proof: Proof,
}

impl<const PIXELS: usize, M, B> Follow for &mut PanelReceiver<PIXELS, M, B>
where
    M: BorrowMut<ReceiverMemory<PIXELS>>,
    B: BorrowMut<[u8]>,
{
    fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> FrameOutcome<'_> {
        let PanelReceiver {
            receiver, search, proof, ..
        } = &mut **self;
        if proof.has_failed() {
            receiver.give_up();
        }
        if receiver.corners().is_none() {
            proof.lost(number);
            let others = proof.others(number);
            // The camera's frames have a size that can be searched.
            let found = profile.timed(Stage::Search, || search.find_beside(frame, others));
            // A panel that does not fit into the memory is not readable.
            let size = (frame.width(), frame.height());
            let fits = |corners: &Corners| receiver.place(*corners, [0, 0], size).is_ok();
            if let Some(corners) = found.ok().flatten().filter(fits) {
                search.forget();
                proof.found(corners, number);
            }
        }
        let outcome = receiver.frame_timed(number, frame, profile);
        if let Ok(reading) = &outcome.reading {
            let is_sure = reading.detection.confidence >= LEAST_CONFIDENCE;
            let bits = is_sure.then(|| reading.detection.bits.bits());
            proof.see(reading.corners, bits);
        }
        proof.judge(number, &outcome.event);
        let is_seen = matches!(outcome.reading, Ok(_) | Err(Loss::Coasting { .. }));
        let reading = outcome.reading.ok().filter(|_| !proof.has_failed());
        FrameOutcome {
            is_following: is_seen && !proof.has_failed(),
            sighting: reading.map(|reading| {
                let sighting = Sighting {
                    corners: reading.corners,
                    bits: reading.detection.bits,
                    soft: reading.detection.soft,
                    is_mixed: reading.detection.mixed.is_some(),
                    confidence: reading.detection.confidence,
                };
                sighting.upright(outcome.orientation)
            }),
            event: outcome.event,
        }
    }

    fn begin(&mut self, symbols_per_frame: f32) -> Option<()> {
        let settings = ReceiverSettings {
            symbols_per_frame,
            ..self.settings
        };
        self.receiver.begin(&settings).ok()?;
        self.settings = settings;
        self.search.forget();
        self.proof = Proof::new(symbols_per_frame);
        Some(())
    }

    fn expect_another_exposure(&mut self) {
        self.search.expect_another_exposure();
    }
}

/// A receiver in integer arithmetic, in any memory.
impl<B: BorrowMut<[u8]>> Follow for &mut IntegerReceiver<B> {
    fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> FrameOutcome<'_> {
        let outcome = IntegerReceiver::frame(self, number, frame, profile);
        FrameOutcome {
            is_following: outcome.is_following,
            sighting: outcome.reading.map(|reading| {
                let sighting = Sighting {
                    corners: reading.corners,
                    bits: PanelFrame::from_bits(reading.bits),
                    soft: reading.soft,
                    is_mixed: reading.is_mixed,
                    confidence: reading.confidence,
                };
                sighting.upright(outcome.orientation)
            }),
            event: outcome.event,
        }
    }

    fn begin(&mut self, symbols_per_frame: f32) -> Option<()> {
        IntegerReceiver::begin(self, symbols_per_frame).ok()
    }

    fn expect_another_exposure(&mut self) {
        IntegerReceiver::expect_another_exposure(self);
    }
}
