//! Readings to messages.

use super::{Symbol, SymbolClock, SymbolRateError};
use crate::detect::Mixture;
use link::framing::{Deframer, Event};
use link::orientation::Orientation;
use link::panel::SoftPanel;

/// Readings of one panel to messages: a symbol clock, and the deframer that takes its symbols.
///
/// ```
/// use link::framing::{Event, Framer};
/// use link::fec::Code;
/// use link::panel::SoftPanel;
/// use rx_pipeline::symbols::MessageDecoder;
/// let mut framer = Framer::new(b"ice", Code::for_length(3), false)?;
/// let mut decoder = MessageDecoder::new(1.0)?;
/// let mut messages = Vec::new();
/// for frame in 0..12 {
///     let reading = SoftPanel::certain(framer.next_panel(), 10);
///     if let Event::Delivered(delivery) = decoder.push(frame, &reading, None).event {
///         messages.push(delivery.message.to_vec());
///     }
/// }
/// assert_eq!(messages, [b"ice"]);
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct MessageDecoder {
    clock: SymbolClock,
    deframer: Deframer,
}

/// What a reading brought.
#[derive(Debug)]
pub struct Decoded<'a> {
    /// The number of the symbol that the frame shows; of the one that begins, where it shows two.
    pub symbol: Option<u32>,
    /// Which way up the readings have the panel, by the symbols before: from the first header on.
    pub orientation: Option<Orientation>,
    /// What the symbol before the frame's meant for the message, which carries the numbers of frames as stamps.
    pub event: Event<'a>,
}

impl MessageDecoder {
    /// A decoder of `symbols_per_frame` symbols in a camera's frame period.
    ///
    /// # Errors
    /// [`SymbolRateError`] if that is not above 0 and at most 1.
    pub fn new(symbols_per_frame: f32) -> Result<Self, SymbolRateError> {
        Ok(Self::of(SymbolClock::new(symbols_per_frame)?))
    }

    /// Begins anew, where it lies: a decoder takes some 37 kB, which are not to pass through a small stack.
    pub(crate) fn restart(&mut self, clock: SymbolClock) {
        self.clock = clock;
        self.deframer = Deframer::new();
    }

    /// A decoder that has seen nothing, as the clock has not.
    #[inline]
    pub(crate) const fn of(clock: SymbolClock) -> Self {
        Self {
            clock,
            deframer: Deframer::new(),
        }
    }

    /// Sets how many frame periods later than their numbers say the frames from now on were taken: see [`SymbolClock::set_late`].
    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        self.clock.set_late(frames);
    }

    /// When a frame was taken, in frame periods.
    pub(crate) fn time_of(&self, frame: u64) -> f64 {
        self.clock.time_of(frame)
    }

    /// Takes the reading of a frame, and of both its symbols where the exposure caught two.
    pub fn push(&mut self, frame: u64, reading: &SoftPanel, mixture: Option<&Mixture>) -> Decoded<'_> {
        let ended = match mixture {
            Some(mixture) => self.clock.push_mixed(frame, reading, mixture),
            None => self.clock.push(frame, reading),
        };
        Decoded {
            symbol: self.clock.current(),
            orientation: self.deframer.orientation(),
            event: deframe(&mut self.deframer, ended),
        }
    }

    /// Takes the symbol that the last frames showed, of which [`MessageDecoder::push`] waits for the end.
    pub fn finish(&mut self) -> Event<'_> {
        deframe(&mut self.deframer, self.clock.flush())
    }

    /// The number of the symbol that the last frame showed: see [`SymbolClock::current`].
    pub fn symbol(&self) -> Option<u32> {
        self.clock.current()
    }

    /// Which way up the readings have the panel, from the first header on.
    pub fn orientation(&self) -> Option<Orientation> {
        self.deframer.orientation()
    }

    /// What is known of the symbol that a frame may show the end of: see [`SymbolClock::before`].
    pub fn before(&self, frame: u64) -> SoftPanel {
        self.clock.before(frame)
    }
}

fn deframe(deframer: &mut Deframer, ended: Option<Symbol>) -> Event<'_> {
    match ended {
        Some(symbol) => deframer.push(symbol.index, symbol.first_frame, &symbol.panel),
        None => Event::Nothing,
    }
}
