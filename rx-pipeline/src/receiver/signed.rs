//! A panel's readings to messages: each gets the sign that the carrier gives it, and then goes into the decoder.

use super::outcome::{Loss, Outcome, Reading};
use crate::carrier::Carrier;
use crate::detect::DetectError;
use crate::profile::{Profile, Stage};
use crate::symbols::{Decoded, MessageDecoder, SymbolClock};
use link::framing::Event;
use link::panel::SoftPanel;

/// The decoder of a panel's messages, and what is known of its carrier.
pub(super) struct SignedDecoder {
    decoder: MessageDecoder,
    carrier: Carrier,
}

impl SignedDecoder {
    /// One that has seen nothing, as the clock has not.
    pub fn of(clock: SymbolClock) -> Self {
        Self {
            decoder: MessageDecoder::of(clock),
            carrier: Carrier::NONE,
        }
    }

    /// Begins anew, where it lies.
    pub fn restart(&mut self, clock: SymbolClock) {
        self.decoder.restart(clock);
        self.carrier = Carrier::NONE;
    }

    /// Whether it seems to have a carrier.
    pub fn has_carrier(&self) -> bool {
        self.carrier.is_likely()
    }

    /// Whether each line has its own sign, so that it is no wonder where bits are unsure before they have it.
    pub fn reads_by_lines(&self) -> bool {
        self.carrier.reads_by_lines()
    }

    /// Whether an outer line of LEDs shows nothing of the carrier that the others show: then the panel is followed a line off.
    pub fn misses_a_line(&self) -> bool {
        self.carrier.misses_a_line()
    }

    /// Says that the panel is elsewhere than the last frames have shown it.
    pub fn move_panel(&mut self) {
        self.carrier.move_panel();
    }

    /// What frame `number` shows of a symbol that it may show the end of, as far as that is known.
    pub fn before(&self, number: u64) -> SoftPanel {
        let before = self.decoder.before(number);
        self.carrier.as_seen(self.decoder.time_of(number), before)
    }

    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        self.decoder.set_late(frames);
    }

    /// Takes the symbol that the last frames showed.
    pub fn finish(&mut self) -> Event<'_> {
        self.decoder.finish()
    }

    /// What a frame brought of the panel: its reading goes into the decoder.
    pub fn outcome<'a>(&'a mut self, number: u64, reading: Result<Reading, Loss>, profile: &mut impl Profile) -> Outcome<'a> {
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
                let Decoded {
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
