//! The demand on the link, and the tolerable bit error rate.

use crate::parallel::map;
use link::fec::Code;
use link::framing::{Deframer, Event, Framer, FramingError, MESSAGE_MAX};
use link::panel::{Llr, PanelFrame, SoftPanel};
use rand::{Rng, RngExt};
use rx_pipeline::BLIND_CONTRAST;
use serde::{Deserialize, Serialize};
use sim::random::{Purpose, stream, uniform};

/// Messages for the tolerable error rate.
const TRIALS: u64 = 200;
/// Messages between tests for too many losses.
const GROUP: u64 = 32;
/// An error rate at which no code delivers a message.
const RATE_MAX: f64 = 0.25;
/// Halvings of the range of error rates: to 0.001, as fine as [`TRIALS`] messages resolve.
const HALVINGS: u32 = 8;
/// The certainty of every reading, right or wrong.
const SURE: Llr = 8;

/// Messages of a length that must arrive within a time with a probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Demand {
    /// Bytes of the message, 1 to 1024.
    pub message_bytes: usize,
    /// The time limit, s, from any moment of the message's repeats.
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

/// Why a demand cannot be met.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DemandError {
    /// The message is invalid.
    #[error(transparent)]
    Message(#[from] FramingError),
    /// The time is invalid.
    #[error("a message is to arrive within {within_s} s: give more than 0, and at most 60")]
    Time {
        /// The time, s.
        within_s: f64,
    },
    /// The probability is out of the measurable range.
    #[error("a message is to arrive with a probability of {probability}: give 0.5 to 0.99")]
    Probability {
        /// The probability.
        probability: f64,
    },
    /// The time is too short even without wrong bits.
    #[error(
        "{message_bytes} bytes take up to {needed} symbols, and there are {symbols} within {within_s} s at {symbol_rate_hz} symbols a \
         second: give a shorter message or more time"
    )]
    TooShort {
        /// Bytes of the message.
        message_bytes: usize,
        /// Symbols until arrival, from any start.
        needed: u32,
        /// Available symbols.
        symbols: u32,
        /// The time, s.
        within_s: f64,
        /// Symbols a second.
        symbol_rate_hz: f64,
    },
    /// Too many symbols are erased.
    #[error(
        "with a carrier, {:.0} % of the symbols are erased, and too few of {symbols} symbols within {within_s} s are left: give a shorter \
         message or more time",
        1e2 * .erased
    )]
    Erased {
        /// The share of erased symbols.
        erased: f64,
        /// Available symbols.
        symbols: u32,
        /// The time, s.
        within_s: f64,
    },
}

impl Demand {
    /// The greatest tolerable share of wrong bits: raw, independent and equally sure, so that soft values do not help the code. Found with
    /// the real framing and its codes.
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
    /// If the demand is invalid, or cannot be met without wrong bits either.
    pub fn raw_error_rate(&self, symbol_rate_hz: f64, seed: u64) -> Result<f64, DemandError> {
        self.raw_error_rate_of(symbol_rate_hz, 0.0, seed)
    }

    /// As [`raw_error_rate`](Self::raw_error_rate), for a panel with a carrier: a share of [`BLIND_CONTRAST`] of its symbols is erased. The
    /// result is the share of wrong bits among all; erased bits are not wrong.
    ///
    /// # Errors
    /// As [`raw_error_rate`](Self::raw_error_rate).
    pub fn raw_error_rate_with_carrier(&self, symbol_rate_hz: f64, seed: u64) -> Result<f64, DemandError> {
        self.raw_error_rate_of(symbol_rate_hz, f64::from(BLIND_CONTRAST), seed)
    }

    fn raw_error_rate_of(&self, symbol_rate_hz: f64, erased: f64, seed: u64) -> Result<f64, DemandError> {
        let symbols = self.symbols(symbol_rate_hz)?;
        let most_lost = ((1.0 - self.probability) * TRIALS as f64) as usize;
        let enough = |rate| {
            let mut lost = 0;
            for first in (0..TRIALS).step_by(GROUP as usize) {
                let arrives = |trial| arrives(self.message_bytes, symbols, [rate, erased], seed, trial).unwrap_or(false);
                let group = map(first..TRIALS.min(first + GROUP), arrives);
                lost += group.iter().filter(|&&arrived| !arrived).count();
                // Undecodable messages take longest, and more of them change nothing.
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
        if low == 0.0 && erased > 0.0 {
            let within_s = self.within_s;
            return Err(DemandError::Erased { erased, symbols, within_s });
        }
        Ok(low * (1.0 - erased))
    }

    /// Whole symbols within the time; at least as many as a clean message needs.
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
        // Only an over-long message is refused, before it is made.
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

/// Whether a random message arrives within a number of symbols, from a random symbol of its repeat on, with a share of the bits wrong and a
/// share of the symbols erased.
fn arrives(bytes: usize, symbols: u32, [rate, erased]: [f64; 2], seed: u64, trial: u64) -> Result<bool, FramingError> {
    let mut random = stream(seed, trial, Purpose::Bits);
    let message: Vec<u8> = (0..bytes).map(|_| random.next_u32() as u8).collect();
    let mut framer = Framer::new(&message, Code::for_length(bytes), false)?;
    for _ in 0..random.random_range(0..framer.panels_per_repeat()) {
        framer.next_panel();
    }
    let mut deframer = Box::new(Deframer::new());
    for index in 0..symbols {
        let panel = framer.next_panel();
        let mut read = misread(panel, rate, &mut random);
        if erased > 0.0 && uniform(&mut random) < erased {
            read = SoftPanel::ERASED;
        }
        if let Event::Delivered(_) = deframer.push(index, 0, &read) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A panel with each bit wrong at that rate. The random numbers do not depend on it: bits wrong at one rate are wrong at all higher ones.
fn misread(panel: PanelFrame, rate: f64, random: &mut impl Rng) -> SoftPanel {
    let wrong = (0..64).map(|led| u64::from(uniform(random) < rate) << led);
    let read = PanelFrame::from_bits(panel.bits() ^ wrong.sum::<u64>());
    SoftPanel::certain(read, SURE)
}
