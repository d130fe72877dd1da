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

/// The result of a reading.
#[derive(Debug)]
pub struct DecodedSymbol<'a> {
    /// The number of the symbol in the frame; of the one that begins, if it shows two.
    pub symbol: Option<u32>,
    /// The orientation of the readings, by the symbols before: from the first header on.
    pub orientation: Option<Orientation>,
    /// The event that the symbol before this frame's caused; its stamps are the numbers of frames.
    pub event: Event<'a>,
}

impl MessageDecoder {
    /// A decoder for `symbols_per_frame` symbols in a camera's frame period.
    ///
    /// # Errors
    /// [`SymbolRateError`] if that is not above 0 and at most 1.
    pub fn new(symbols_per_frame: f32) -> Result<Self, SymbolRateError> {
        Ok(Self::of(SymbolClock::new(symbols_per_frame)?))
    }

    /// Restarts in place: a decoder takes about 37 kB, which must not pass through a small stack.
    pub(crate) fn restart(&mut self, clock: SymbolClock) {
        self.clock = clock;
        self.deframer = Deframer::new();
    }

    /// A decoder without symbols, for a clock without frames.
    #[inline]
    pub(crate) const fn of(clock: SymbolClock) -> Self {
        Self {
            clock,
            deframer: Deframer::new(),
        }
    }

    /// Sets the delay of all later frames relative to their numbers, in frame periods: see [`SymbolClock::set_late`].
    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        self.clock.set_late(frames);
    }

    /// The time of a frame, in frame periods.
    pub(crate) fn time_of(&self, frame: u64) -> f64 {
        self.clock.time_of(frame)
    }

    /// Adds the reading of a frame, and both its symbols if the exposure caught two.
    pub fn push(&mut self, frame: u64, reading: &SoftPanel, mixture: Option<&Mixture>) -> DecodedSymbol<'_> {
        let ended = match mixture {
            Some(mixture) => self.clock.push_mixed(frame, reading, mixture),
            None => self.clock.push(frame, reading),
        };
        DecodedSymbol {
            symbol: self.clock.current(),
            orientation: self.deframer.orientation(),
            event: deframe(&mut self.deframer, ended),
        }
    }

    /// Ends the symbol of the last frames, which [`MessageDecoder::push`] still holds.
    pub fn finish(&mut self) -> Event<'_> {
        deframe(&mut self.deframer, self.clock.flush())
    }

    /// The number of the symbol in the last frame: see [`SymbolClock::current`].
    pub fn symbol(&self) -> Option<u32> {
        self.clock.current()
    }

    /// The orientation of the readings, from the first header on.
    pub fn orientation(&self) -> Option<Orientation> {
        self.deframer.orientation()
    }

    /// The soft values of the symbol whose end a frame may show: see [`SymbolClock::before`].
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
