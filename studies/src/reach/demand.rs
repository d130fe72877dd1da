//! What is asked of the link, and how many bits may be wrong for it.

use crate::parallel::prelude::*;
use link::fec::Code;
use link::framing::{Deframer, Event, Framer, FramingError, MESSAGE_MAX};
use link::panel::{Llr, PanelFrame, SoftPanel};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};
use sim::random::{Purpose, stream, uniform};

/// Messages that the tolerable error rate is found with.
const TRIALS: u64 = 200;
/// Messages tried before it is asked whether too many are lost already.
const GROUP: u64 = 32;
/// No code brings a message through at this rate.
const RATE_MAX: f64 = 0.25;
/// Halvings of the range of error rates: to 0.001, as well as the messages tried can tell.
const HALVINGS: u32 = 8;
/// Every reading is as sure as this, right or wrong.
const SURE: Llr = 8;

/// Messages of a length, to arrive within a time with a probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Demand {
    /// Bytes of the message, 1 to 1024.
    pub message_bytes: usize,
    /// The time for it, s, from any moment of its repeats on.
    pub within_s: f64,
    /// The share of messages that arrive by then, 0.5 to 0.99.
    pub probability: f64,
}

impl Default for Demand {
    /// 48 bytes within 1 s, 95 of 100 times.
    fn default() -> Self {
        Self {
            message_bytes: 48,
            within_s: 1.0,
            probability: 0.95,
        }
    }
}

/// Why nothing can meet a demand.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DemandError {
    /// There is no such message.
    #[error(transparent)]
    Message(#[from] FramingError),
    /// The time is none.
    #[error("a message is to arrive within {within_s} s: give more than 0, and at most 60")]
    Time {
        /// The time, s.
        within_s: f64,
    },
    /// The probability is none that can be measured.
    #[error("a message is to arrive with a probability of {probability}: give 0.5 to 0.99")]
    Probability {
        /// The probability.
        probability: f64,
    },
    /// Without one wrong bit there is not time enough.
    #[error(
        "{message_bytes} bytes take up to {needed} symbols, and there are {symbols} within {within_s} s at {symbol_rate_hz} symbols a \
         second: give a shorter message or more time"
    )]
    TooShort {
        /// Bytes of the message.
        message_bytes: usize,
        /// Symbols in which they arrive from any moment on.
        needed: u32,
        /// Symbols that there are.
        symbols: u32,
        /// The time, s.
        within_s: f64,
        /// Symbols a second.
        symbol_rate_hz: f64,
    },
}

impl Demand {
    /// The greatest share of bits that may be read wrongly: raw, independent of each other and all equally sure, so that the code has no
    /// help from soft values. Found with the real framing and its codes.
    ///
    /// ```
    /// use studies::reach::Demand;
    /// let demand = Demand { message_bytes: 8, within_s: 0.2, ..Demand::default() };
    /// let rate = demand.raw_error_rate(90.0, 1)?;
    /// assert!(0.02 < rate && rate < 0.2);
    /// # Ok::<(), studies::reach::DemandError>(())
    /// ```
    ///
    /// # Errors
    /// When the demand makes no sense, or cannot be met without a wrong bit either.
    pub fn raw_error_rate(&self, symbol_rate_hz: f64, seed: u64) -> Result<f64, DemandError> {
        let symbols = self.symbols(symbol_rate_hz)?;
        let most_lost = ((1.0 - self.probability) * TRIALS as f64) as usize;
        let enough = |rate| {
            let mut lost = 0;
            for first in (0..TRIALS).step_by(GROUP as usize) {
                let group = (first..TRIALS.min(first + GROUP)).into_par_iter();
                let arrives = |&trial: &u64| arrives(self.message_bytes, symbols, rate, seed, trial).unwrap_or(false);
                lost += group.filter(|trial| !arrives(trial)).count();
                // What cannot be decoded takes longest, and more of it changes nothing.
                if lost > most_lost {
                    return false;
                }
            }
            true
        };
        let (mut low, mut high) = (0.0, RATE_MAX);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match enough(middle) {
                true => low = middle,
                false => high = middle,
            }
        }
        Ok(low)
    }

    /// Whole symbols within the time; as many as a clean message needs, at least.
    fn symbols(&self, symbol_rate_hz: f64) -> Result<u32, DemandError> {
        let Self {
            message_bytes,
            within_s,
            probability,
        } = *self;
        if !(within_s > 0.0 && within_s <= 60.0) {
            return Err(DemandError::Time { within_s });
        }
        if !(0.5..=0.99).contains(&probability) {
            return Err(DemandError::Probability { probability });
        }
        // No message but an over-long one is refused, and that is not made first.
        let code = Code::for_length(message_bytes);
        let message = vec![0; message_bytes.min(MESSAGE_MAX + 1)];
        let needed = 2 * Framer::new(&message, code, false)?.panels_per_repeat();
        let symbols = (within_s * symbol_rate_hz) as u32;
        if symbols < needed {
            return Err(DemandError::TooShort {
                message_bytes,
                needed,
                symbols,
                within_s,
                symbol_rate_hz,
            });
        }
        Ok(symbols)
    }
}

/// Whether a random message arrives within a number of symbols, from a random one of its repeat on.
fn arrives(bytes: usize, symbols: u32, rate: f64, seed: u64, trial: u64) -> Result<bool, FramingError> {
    let mut random = stream(seed, trial, Purpose::Bits);
    let message: Vec<u8> = (0..bytes).map(|_| random.next_u32() as u8).collect();
    let mut framer = Framer::new(&message, Code::for_length(bytes), false)?;
    for _ in 0..random.random_range(0..framer.panels_per_repeat()) {
        framer.next_panel();
    }
    let mut deframer = Box::new(Deframer::new());
    for index in 0..symbols {
        let panel = framer.next_panel();
        let read = misread(panel, rate, &mut random);
        if let Event::Delivered(_) = deframer.push(index, 0, &read) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A panel of which each bit is wrong at that rate. The numbers drawn do not depend on it: what is wrong at one rate is so at all higher
/// ones.
fn misread(panel: PanelFrame, rate: f64, random: &mut impl Rng) -> SoftPanel {
    let wrong = (0..64).map(|led| u64::from(uniform(random) < rate) << led);
    let read = PanelFrame::from_bits(panel.bits() ^ wrong.sum::<u64>());
    SoftPanel::certain(read, SURE)
}
