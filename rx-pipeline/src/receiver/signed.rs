//! Decodes a panel's readings into messages: each reading gets its sign from the carrier and then enters the decoder.

use super::outcome::{FrameReading, Loss, Outcome};
use crate::carrier::Carrier;
#[cfg(feature = "carrier")]
use crate::carrier::CarrierCandidate;
use crate::detect::DetectError;
use crate::profile::{Profile, Stage};
use crate::symbols::{DecodedSymbol, MessageDecoder, SymbolClock};
use link::framing::Event;
use link::panel::SoftPanel;

/// The decoder of a panel's messages, and the state of its carrier.
pub(super) struct SignedDecoder {
    decoder: MessageDecoder,
    carrier: Carrier,
}

impl SignedDecoder {
    /// A decoder that, like the clock, has not seen a frame.
    pub fn of(clock: SymbolClock) -> Self {
        Self {
            decoder: MessageDecoder::of(clock),
            carrier: Carrier::NONE,
        }
    }

    /// Restarts in place.
    pub fn restart(&mut self, clock: SymbolClock) {
        self.decoder.restart(clock);
        self.carrier = Carrier::NONE;
    }

    /// Whether the panel seems to have a carrier.
    pub fn has_carrier(&self) -> bool {
        self.carrier.is_likely()
    }

    /// Whether each line has its own sign, so that unsure bits before the signs are applied are no reason for doubt.
    pub fn reads_by_lines(&self) -> bool {
        self.carrier.reads_by_lines()
    }

    /// Whether an outer line of LEDs lacks the carrier that the others show: then the panel is followed one line off.
    pub fn misses_a_line(&self) -> bool {
        self.carrier.misses_a_line()
    }

    /// Continues with a carrier that its readings have proven.
    #[cfg(feature = "carrier")]
    pub fn confirm_carrier(&mut self, carrier: &CarrierCandidate) {
        self.carrier.confirm(carrier);
    }

    /// Announces that the panel is followed at another place than in the last frames.
    pub fn move_panel(&mut self) {
        self.carrier.move_panel();
    }

    /// The expected look, in frame `number`, of a symbol whose end it may show, as far as it is known.
    pub fn before(&self, number: u64) -> SoftPanel {
        let before = self.decoder.before(number);
        self.carrier.as_seen(self.decoder.time_of(number), before)
    }

    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        self.decoder.set_late(frames);
    }

    /// Decodes the symbol of the last frames.
    pub fn finish(&mut self) -> Event<'_> {
        self.decoder.finish()
    }

    /// The outcome of a frame: its reading enters the decoder.
    pub fn outcome<'a>(&'a mut self, number: u64, reading: Result<FrameReading, Loss>, profile: &mut impl Profile) -> Outcome<'a> {
        // No symbol of a message leaves all LEDs Off.
        let reading = reading.and_then(|reading| match reading.detection.bits.count_on() {
            0 => Err(DetectError::Covered { percent: 0 }.into()),
            _ => Ok(reading),
        });
        let Self { decoder, carrier } = self;
        profile.timed(Stage::Decode, || match reading {
            Ok(mut reading) => {
                let reread = carrier.resolve(number, decoder.time_of(number), &reading.corners, &mut reading.detection);
                let detection = &reading.detection;
                let DecodedSymbol {
                    symbol,
                    orientation,
                    event,
                } = decoder.push(number, &detection.soft, detection.mixed.as_ref());
                Outcome {
                    reading: Ok(reading),
                    symbol,
                    orientation,
                    event,
                    reread,
                }
            }
            Err(loss) => Outcome {
                reading: Err(loss),
                orientation: decoder.orientation(),
                ..Outcome::NOTHING
            },
        })
    }
}
