//! What finds a panel in frames, follows it and reads it.

use core::borrow::BorrowMut;

use crate::corners::Corners;
use crate::frame::Frame;
use crate::profile::Profile;
use crate::receiver::{Loss, Receiver, ReceiverMemory, ReceiverSettings, Search};
use link::framing::{Delivery, Event};

/// What a frame showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Where the panel is.
    pub corners: Corners,
    /// The share of its bits that are right if the soft values are.
    pub confidence: f32,
}

/// What a frame brought.
#[derive(Debug)]
pub struct Seen<'a> {
    /// Whether a panel is followed, in this frame or through a gap.
    pub is_following: bool,
    /// The panel, where it was read.
    pub sighting: Option<Sighting>,
    /// The message that the symbol before this frame's completed.
    pub message: Option<Delivery<'a>>,
}

/// Finds a panel in whole frames, follows it and reads it.
pub trait Follow {
    /// Takes in frame `number`. Numbers rise; those that are left out are lost frames.
    fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> Seen<'_>;

    /// Forgets everything and goes by that many symbols in a frame's period, above 0 and at most 1; `None` where it cannot.
    fn begin(&mut self, symbols_per_frame: f32) -> Option<()>;
}

/// A [`Receiver`] of one panel, and its settings.
impl<const PIXELS: usize, M, S> Follow for (Receiver<PIXELS, M, S>, ReceiverSettings)
where
    M: BorrowMut<ReceiverMemory<PIXELS>>,
    S: Search<PIXELS>,
{
    fn frame(&mut self, number: u64, frame: &Frame<'_>, profile: &mut impl Profile) -> Seen<'_> {
        let outcome = self.0.frame_timed(number, frame, profile);
        Seen {
            is_following: matches!(outcome.reading, Ok(_) | Err(Loss::Coasting { .. })),
            sighting: outcome.reading.ok().map(|reading| Sighting {
                corners: reading.corners,
                confidence: reading.detection.confidence,
            }),
            message: match outcome.event {
                Event::Delivered(delivery) => Some(delivery),
                _ => None,
            },
        }
    }

    fn begin(&mut self, symbols_per_frame: f32) -> Option<()> {
        let settings = ReceiverSettings {
            symbols_per_frame,
            ..self.1
        };
        self.0.begin(&settings).ok()?;
        self.1 = settings;
        Some(())
    }
}
