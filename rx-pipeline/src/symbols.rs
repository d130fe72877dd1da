//! Readings to symbols: frames that show the same symbol are merged, and symbols that no frame showed are counted.
//!
//! A camera at least as fast as the panel sees each symbol once or more. A reading repeats the last one if their correlation over the 64
//! soft values, ρ = Σ a·b/√(Σ a²·Σ b²), is at least 0.6. Error rates at this threshold (`cargo test -p vocc-rx-pipeline symbols` computes
//! both):
//!
//! - Two different symbols of random bits agree in 32 ± 4 LEDs: ρ = 0 ± 1/8. ρ ≥ 0.6 requires 52: one pair in 5 million.
//! - Two readings of one symbol with the bit error rate ε have ρ = (1 − 2ε)² ± √(1 − (1 − 2ε)⁴)/8: 0.92 ± 0.05 at 2 %, and 0.81 ± 0.07 at
//!   5 %, where one pair in 150 counts as two symbols. This is for hard bits. Soft values do better, because doubtful bits weigh less.
//!
//! An exposure across a change of symbols adds its soft values to both symbols. The first ends with it, and the next frame shows the
//! second. It also dates the start of the second, which lies within the exposure.
//!
//! If LEDs saturate, an exposure of two symbols looks like one symbol with the On LEDs of both. The clock decides which exposures may
//! contain two symbols. Their On LEDs that are Off in the symbol before or after belong to the other one (`symbols/shared.rs`).
//!
//! The exposure time, in symbols, equals the share of frames with two symbols. The first estimate is short; longer exposures soon correct
//! it.
//!
//! The number of symbols in a gap follows from the symbol rate and from the phase of the exposures within the symbol: an interval that each
//! reading narrows.

mod decoder;
mod lateness;
mod shared;

pub use decoder::{DecodedSymbol, MessageDecoder};

use crate::detect::{Mixture, correlation};
use lateness::Lateness;
use link::panel::{Llr, SoftPanel};

/// The correlation from which on a reading repeats the last symbol (1 for the same, 0 for another). Higher: one symbol counts as two;
/// lower: two count as one. The tests compute both rates.
pub(crate) const REPEAT_CORRELATION: f32 = 0.6;
/// The correlation of two sure readings up to which they show two symbols, however close their frame numbers: frames were lost without a
/// count. Higher: noise makes symbols; lower: more than one in a hundred such losses goes unnoticed.
const OTHER_CORRELATION: f32 = 0.3;
/// The greatest difference between the two clocks (share): rates 500 ppm off are followed, with crystals of 100 ppm in addition. Higher:
/// gaps are counted less reliably; lower: symbols are counted twice if a film's rate is off by more.
const CLOCK_TOLERANCE: f64 = 6e-4;
/// The longest exposure of usual cameras (share of the frame period). Higher: gaps are counted less reliably, and chance looks like two
/// symbols more often; lower: it takes more frames with two symbols to detect longer exposures.
const EXPOSURE_USUAL: f64 = 0.1;
/// The longest supported exposure (share of the frame period): with a longer one, hardly a frame shows a single symbol.
const EXPOSURE_MAX: f64 = 0.8;
/// Frames in the estimate of the exposure: after this many (count) they are halved. Higher: surer; lower: follows a changing camera.
const FRAMES_KEPT: u32 = 128;
/// The soft value of an LED below which it is doubtful (quarters of a nat). Higher: more symbols are lost that other light makes look like
/// two; lower: exposures that two symbols shared evenly count as one.
const SURE_LLR: u8 = 64;
/// Doubtful LEDs in a reading of a single symbol, at most (count). Higher: as a lower [`SURE_LLR`].
const DOUBTFUL_MAX: usize = 8;

/// One symbol, from all frames that showed it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Its number: 0 for the first symbol; symbols that no frame showed count. It wraps around.
    pub index: u32,
    /// The sum of the readings' soft values, within ±127.
    pub panel: SoftPanel,
    /// The number of the first frame that showed it.
    pub first_frame: u64,
    /// The number of the last frame that showed it.
    pub last_frame: u64,
}

/// A symbol rate out of range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "{symbols_per_frame} symbols a frame cannot be followed: more than 0 and at most 1 can; raise the frame rate or lower \
     the symbol rate"
)]
pub struct SymbolRateError {
    /// The requested rate.
    pub symbols_per_frame: f32,
}

/// Numbers the symbols and merges repeated readings of one.
///
/// It returns a symbol once, when the next one is seen or at [`SymbolClock::flush`].
///
/// ```
/// use link::panel::{PanelFrame, SoftPanel};
/// use rx_pipeline::symbols::SymbolClock;
/// let [a, b] = [0x0123_4567_89ab_cdef, 0x5555_3333_0f0f_00ff]
///     .map(|bits| SoftPanel::certain(PanelFrame::from_bits(bits), 10));
/// let mut clock = SymbolClock::new(0.5)?;
/// assert_eq!(clock.push(7, &a), None);
/// assert_eq!(clock.push(8, &a), None);
/// let symbol = clock.push(9, &b).expect("the first symbol is over");
/// assert_eq!((symbol.index, symbol.first_frame, symbol.last_frame), (0, 7, 8));
/// assert_eq!(symbol.panel.0[0], 20);
/// assert_eq!(clock.flush().map(|symbol| symbol.index), Some(1));
/// # Ok::<(), rx_pipeline::symbols::SymbolRateError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SymbolClock {
    symbols_per_frame: f64,
    current: Option<Current>,
    next_index: u32,
    /// The delay of the current frame relative to its number, in frame periods.
    late: Lateness,
    /// Number of recent frames.
    frames: u32,
    /// Number of these that caught two symbols.
    mixed: u32,
    /// Whether that number shows exposures longer than usual.
    is_long: bool,
}

#[derive(Clone, Copy, Debug)]
struct Current {
    symbol: Symbol,
    reading: SoftPanel,
    /// The phase of the last frame's exposure start within its symbol, least and greatest: 0 the symbol's start, 1 its end.
    phase: (f64, f64),
    /// The delay of that frame relative to its number, in frame periods.
    late: Lateness,
    /// Whether the symbol has been seen only in an exposure that it shares with the symbol before.
    partial: bool,
}

impl SymbolClock {
    /// A clock for a panel that shows `symbols_per_frame` symbols in a camera's frame period.
    ///
    /// # Errors
    /// [`SymbolRateError`] if `symbols_per_frame` is not above 0 and at most 1.
    pub fn new(symbols_per_frame: f32) -> Result<Self, SymbolRateError> {
        if symbols_per_frame > 0.0 && symbols_per_frame <= 1.0 {
            Ok(Self {
                symbols_per_frame: symbols_per_frame.into(),
                current: None,
                next_index: 0,
                late: Lateness::default(),
                frames: 0,
                mixed: 0,
                is_long: false,
            })
        } else {
            Err(SymbolRateError { symbols_per_frame })
        }
    }

    /// Sets the delay of all later frames relative to their numbers, in frame periods, negative for early ones. Call it with each frame of
    /// a camera that does not keep its rate. NaN counts as 0; the value is clamped to ±10⁹.
    ///
    /// ```
    /// use link::panel::{PanelFrame, SoftPanel};
    /// use rx_pipeline::symbols::SymbolClock;
    /// let shown = |bits| SoftPanel::certain(PanelFrame::from_bits(bits), 10);
    /// let mut clock = SymbolClock::new(0.5)?;
    /// for (frame, late, bits) in [(0, 0.0, 7 << 20), (1, 0.3, 7 << 20), (2, -0.2, 0x0123_4567_89ab_cdef)] {
    ///     clock.set_late(late);
    ///     clock.push(frame, &shown(bits));
    /// }
    /// assert_eq!(clock.flush().map(|symbol| symbol.index), Some(1));
    /// # Ok::<(), rx_pipeline::symbols::SymbolRateError>(())
    /// ```
    #[cfg(feature = "time-stamps")]
    pub fn set_late(&mut self, frames: f64) {
        self.late = Lateness::new(frames);
    }

    /// The time of a frame with the current delay (frame periods).
    pub(crate) fn time_of(&self, frame: u64) -> f64 {
        self.late.time_of(frame)
    }

    /// Adds the reading of frame `frame`; returns the symbol before it if it shows a new one.
    ///
    /// Skip lost frames. A frame number that does not rise, and a reading of zeros, are ignored.
    pub fn push(&mut self, frame: u64, reading: &SoftPanel) -> Option<Symbol> {
        if reading.0.iter().all(|&llr| llr == 0) {
            return None;
        }
        self.count(false);
        let reach = self.exposure(self.is_long);
        let Some(current) = &mut self.current else {
            self.start(frame, reading, self.next_index, (-reach, 1.0));
            return None;
        };
        let (elapsed, phase) = current.phase_at(frame, self.late, self.symbols_per_frame)?;
        if phase.0 < 1.0
            && phase.1 + reach > 1.0
            && let Some(beginning) = shared::other(reading, &current.symbol.panel)
        {
            self.mixed += 1;
            let mixture = Mixture {
                beginning,
                ..Mixture::INSEPARABLE
            };
            return self.change(frame, &mixture);
        }
        if let Some((done, phase)) = current.ended_by(frame, self.late, reading, reach, self.symbols_per_frame) {
            self.mixed += 1;
            let index = done.index.wrapping_add(1);
            let next = self.start(done.last_frame, reading, index, within(phase, (-reach, 1.0)));
            next.symbol.last_frame = frame;
            return Some(done);
        }
        let may_repeat = phase.0 < 1.0 || elapsed == 1;
        let clearly_before_its_end = phase.1 + reach < 1.0;
        let likely_before_its_end = phase.0 + phase.1 < 2.0;
        let must_repeat = clearly_before_its_end || current.partial && likely_before_its_end;
        let alike = correlation(&current.reading, reading);
        // Too early for another symbol, unless frames were lost without a count.
        let is_another = alike < OTHER_CORRELATION && is_sure(&current.reading) && is_sure(reading);
        if may_repeat && (alike >= REPEAT_CORRELATION || must_repeat && !is_another) {
            current.merge(frame, self.late, reading);
            current.phase = within(phase, (-reach, 1.0));
            return None;
        }
        let done = current.symbol;
        let (advance, phase) = if clearly_before_its_end {
            (1.0, ANY_PHASE)
        } else {
            advanced(phase)
        };
        // Wraps around as the index does, and saturates after an extreme gap.
        let index = done.index.wrapping_add(advance as u32);
        self.start(frame, reading, index, within(phase, (-reach, 1.0)));
        Some(done)
    }

    /// Adds frame `frame`, which seems to have caught the end of one symbol and the beginning of the next; returns the symbol that ended
    /// there or before.
    ///
    /// If the two are inseparable, the frame's `reading` counts as that of one symbol in two cases: it is sure of nearly all LEDs (the
    /// symbol with most of the exposure, or the On LEDs of both), or the frame lies in the middle of a symbol, so that it is noisy. A sure
    /// repeat of the symbol before also counts as one if little is known of the next: a trace of another symbol may be other light, and the
    /// next frame shows it better.
    pub fn push_mixed(&mut self, frame: u64, reading: &SoftPanel, mixture: &Mixture) -> Option<Symbol> {
        let is_repeat = |current: &Current| correlation(&current.reading, reading) >= REPEAT_CORRELATION;
        let is_inseparable = *mixture == Mixture::INSEPARABLE;
        let is_of_one = is_inseparable || !is_sure(&mixture.beginning) && self.current.as_ref().is_some_and(is_repeat);
        if is_of_one && is_sure(reading) || is_inseparable && !self.may_catch_two(frame) {
            self.push(frame, reading)
        } else {
            self.count(true);
            self.change(frame, mixture)
        }
    }

    /// Whether the exposure of a frame may catch the end of a symbol and the beginning of the next, by its known phase.
    fn may_catch_two(&self, frame: u64) -> bool {
        let current = self.current.as_ref();
        let phase = current.and_then(|current| current.phase_at(frame, self.late, self.symbols_per_frame));
        phase.is_none_or(|(_, (earliest, latest))| libm::floor(earliest) != libm::floor(latest + self.exposure(self.is_long)))
    }

    /// Ends a symbol and begins the next.
    fn change(&mut self, frame: u64, mixture: &Mixture) -> Option<Symbol> {
        let reach = self.exposure(self.is_long);
        let current = self.current.as_mut()?;
        let (_, phase) = current.phase_at(frame, self.late, self.symbols_per_frame)?;
        let (advance, (earliest, latest)) = if phase.0 < 1.0 {
            current.merge(frame, self.late, &mixture.ending);
            (0.0, phase)
        } else {
            // No frame showed the symbol that ends here alone: it is unknown.
            advanced(phase)
        };
        let done = current.symbol;
        let index = done.index.wrapping_add(advance as u32).wrapping_add(1);
        let phase = within((earliest - 1.0, latest - 1.0), (-reach, 0.0));
        self.start(frame, &mixture.beginning, index, phase).partial = true;
        Some(done)
    }

    /// The soft values of the symbol whose end frame `frame` may show; erased if that symbol is over.
    pub fn before(&self, frame: u64) -> SoftPanel {
        let current = self.current.as_ref().filter(|current| {
            let phase = current.phase_at(frame, self.late, self.symbols_per_frame);
            phase.is_some_and(|(_, (earliest, _))| earliest < 1.0)
        });
        current.map_or(SoftPanel::ERASED, |current| current.symbol.panel)
    }

    /// Counts a frame. The share of frames with two symbols decides whether exposures are longer than usual.
    fn count(&mut self, is_mixed: bool) {
        if self.frames == FRAMES_KEPT {
            self.frames /= 2;
            self.mixed /= 2;
        }
        self.frames += 1;
        self.mixed += u32::from(is_mixed);
        let (frames, mixed) = (self.frames as f32, self.mixed as f32);
        let [usual, longest] = [false, true].map(|is_long| self.exposure(is_long));
        let (deviation, expected) = (libm::sqrtf(mixed), usual as f32 * frames);
        if !self.is_long && mixed - deviation > expected {
            // The phase was estimated for shorter exposures.
            if let Some(current) = &mut self.current {
                current.phase.0 -= longest - usual;
            }
            self.is_long = true;
        } else if mixed + 2.0 * deviation + 2.0 < expected {
            self.is_long = false;
        }
    }

    /// The longest assumed exposure, in symbols.
    fn exposure(&self, is_long: bool) -> f64 {
        let share = if is_long { EXPOSURE_MAX } else { EXPOSURE_USUAL };
        share * self.symbols_per_frame
    }

    /// The number of the symbol in the last frame; `None` before the first.
    pub fn current(&self) -> Option<u32> {
        self.current.as_ref().map(|current| current.symbol.index)
    }

    /// The current symbol, if any. The next reading starts another.
    pub fn flush(&mut self) -> Option<Symbol> {
        self.current.take().map(|current| current.symbol)
    }

    fn start(&mut self, frame: u64, reading: &SoftPanel, index: u32, phase: (f64, f64)) -> &mut Current {
        let symbol = Symbol {
            index,
            panel: *reading,
            first_frame: frame,
            last_frame: frame,
        };
        self.next_index = index.wrapping_add(1);
        self.current.insert(Current {
            symbol,
            reading: *reading,
            phase,
            late: self.late,
            partial: false,
        })
    }
}

impl Current {
    /// Frames since the last one, and the phase of the exposure's start, counted from the start of the last one's symbol; `None` for a
    /// frame that is no later.
    fn phase_at(&self, frame: u64, late: Lateness, symbols_per_frame: f64) -> Option<(u64, (f64, f64))> {
        let elapsed = frame.checked_sub(self.symbol.last_frame).filter(|&elapsed| elapsed > 0)?;
        let passed = late.since(self.late, elapsed) * symbols_per_frame;
        let (earliest, latest) = self.phase;
        let phase = (
            earliest + passed * (1.0 - CLOCK_TOLERANCE),
            latest + passed * (1.0 + CLOCK_TOLERANCE),
        );
        Some((elapsed, phase))
    }

    /// If the only frame of this symbol showed the next one too: the symbol without the next one's On LEDs, and the phase of this frame in
    /// the next one.
    fn ended_by(&self, frame: u64, late: Lateness, next: &SoftPanel, reach: f64, symbols_per_frame: f64) -> Option<(Symbol, (f64, f64))> {
        let is_of_one_frame = self.symbol.first_frame == self.symbol.last_frame && !self.partial;
        if !is_of_one_frame || self.phase.1 + reach <= 1.0 {
            return None;
        }
        let shared = Self {
            phase: within((1.0 - reach, 1.0), self.phase),
            ..*self
        };
        let (_, (earliest, latest)) = shared.phase_at(frame, late, symbols_per_frame)?;
        if earliest >= 2.0 {
            return None;
        }
        let panel = shared::other(&self.reading, next)?;
        let done = Symbol { panel, ..self.symbol };
        Some((done, (earliest - 1.0, latest - 1.0)))
    }

    fn merge(&mut self, frame: u64, late: Lateness, reading: &SoftPanel) {
        for (sum, &llr) in self.symbol.panel.0.iter_mut().zip(&reading.0) {
            *sum = sum.saturating_add(llr).max(-Llr::MAX);
        }
        self.symbol.last_frame = frame;
        self.late = late;
        self.reading = *reading;
        self.partial = false;
    }
}

/// An unknown phase.
const ANY_PHASE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// The number of symbols that have passed, at least one, and the phases in the symbol after them. If that number is uncertain, the phases
/// become unknown, so that one wrong guess causes no others.
fn advanced((earliest, latest): (f64, f64)) -> (f64, (f64, f64)) {
    let advance = libm::floor((earliest + latest) / 2.0).max(1.0);
    let certain = libm::floor(earliest).max(1.0) == (libm::ceil(latest) - 1.0).max(1.0);
    if certain {
        (advance, (earliest - advance, latest - advance))
    } else {
        (advance, ANY_PHASE)
    }
}

/// Whether hardly any LED is doubtful. If two symbols had about equal parts of an exposure, all LEDs are doubtful in which they differ.
pub(crate) fn is_sure(reading: &SoftPanel) -> bool {
    let doubtful = reading.0.iter().filter(|llr| llr.unsigned_abs() < SURE_LLR);
    doubtful.count() <= DOUBTFUL_MAX
}

/// The part of the phases that lies in a range; the range itself if none does.
fn within((earliest, latest): (f64, f64), (least, most): (f64, f64)) -> (f64, f64) {
    let (low, high) = (earliest.max(least), latest.min(most));
    if low < high { (low, high) } else { (least, most) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::panel::PanelFrame;
    use properties::prelude::*;
    use std::vec::Vec;

    fn panel(bits: u64) -> SoftPanel {
        SoftPanel::certain(PanelFrame::from_bits(bits), 10)
    }

    /// A different pseudorandom panel for each symbol.
    fn shown(symbol: u64) -> u64 {
        let mixed = (symbol + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// The probability that at least `least` of 64 events happen, each with probability `p`.
    fn at_least(least: u32, p: f64) -> f64 {
        let mut term = libm::pow(1.0 - p, 64.0);
        let mut sum = 0.0;
        for k in 0..=64 {
            if k >= least {
                sum += term;
            }
            term *= f64::from(64 - k) / f64::from(k + 1) * p / (1.0 - p);
        }
        sum
    }

    #[test]
    fn the_threshold_errs_as_stated() {
        // ρ = 2·agreeing/64 − 1 reaches 0.6 from 52 on.
        let mistaken = at_least(52, 0.5);
        assert!((1.0 / 6e6..1.0 / 4e6).contains(&mistaken), "{mistaken}");
        let error_rate = 0.05;
        let agree = (1.0 - error_rate) * (1.0 - error_rate) + error_rate * error_rate;
        let missed = 1.0 - at_least(52, agree);
        assert!((1.0 / 160.0..1.0 / 140.0).contains(&missed), "{missed}");
    }

    #[test]
    fn rates_beyond_one_symbol_a_frame_are_refused() {
        for rate in [0.0, -1.0, 1.01, f32::NAN, f32::INFINITY] {
            assert!(SymbolClock::new(rate).is_err());
        }
    }

    #[test]
    fn unknown_and_late_readings_are_ignored() {
        let mut clock = SymbolClock::new(1.0).unwrap();
        assert_eq!(clock.push(5, &SoftPanel::ERASED), None);
        assert_eq!(clock.flush(), None);
        clock.push(5, &panel(shown(0)));
        assert_eq!(clock.push(5, &panel(shown(1))), None);
        assert_eq!(clock.push(4, &panel(shown(1))), None);
        assert_eq!(clock.flush().map(|symbol| symbol.panel), Some(panel(shown(0))));
    }

    /// Symbols read in frames of the usual exposure.
    fn read(symbols_per_frame: f64, start: f64, frames: u64, mixed: impl Fn(u64) -> Mixture) -> Vec<(u32, u64)> {
        let [symbols, without] = [true, false].map(|is_read| exposed(EXPOSURE_USUAL, symbols_per_frame, start, frames, is_read, &mixed));
        assert_eq!(symbols, without);
        symbols
    }

    /// Symbols read in frames with their phases; `mixed` gives the mixture of a frame that catches two. As a single symbol such a frame
    /// shows the one with most of the exposure, or nothing.
    fn exposed(
        exposure: f64,
        symbols_per_frame: f64,
        start: f64,
        frames: u64,
        is_read: bool,
        mixed: &impl Fn(u64) -> Mixture,
    ) -> Vec<(u32, u64)> {
        let mut clock = SymbolClock::new(symbols_per_frame as f32).unwrap();
        let mut symbols = Vec::new();
        for frame in 0..frames {
            let begin = start + frame as f64 * symbols_per_frame;
            let symbol = begin as u64;
            symbols.extend(if (begin + exposure * symbols_per_frame) as u64 == symbol {
                clock.push(frame, &panel(shown(symbol)))
            } else {
                let longer = (begin + 0.5 * exposure * symbols_per_frame) as u64;
                let reading = if is_read { panel(shown(longer)) } else { SoftPanel::ERASED };
                clock.push_mixed(frame, &reading, &mixed(symbol))
            });
        }
        symbols.extend(clock.flush());
        symbols.iter().map(|symbol| (symbol.index, symbol.panel.hard().bits())).collect()
    }

    #[test]
    fn exposures_of_most_of_a_frame_spoil_no_symbol_once_that_is_known() {
        for (exposure, symbols_per_frame) in [(0.3, 0.77), (0.4, 0.7), (0.75, 0.55), (0.8, 0.5)] {
            for (start, is_read) in [0.05, 0.15, 0.25, 0.35, 0.45, 0.55]
                .into_iter()
                .flat_map(|start| [(start, true), (start, false)])
            {
                let symbols = exposed(exposure, symbols_per_frame, start, 200, is_read, &|_| Mixture::INSEPARABLE);
                let count = (start + 199.0 * symbols_per_frame) as usize;
                let shown = &expected(count as u32)[count / 3..];
                let first = symbols.iter().position(|symbol| symbol.1 == shown[0].1);
                let symbols = &symbols[first.expect("the first of them")..];
                for (symbol, expected) in symbols.iter().zip(shown) {
                    let numbers = [symbol.0 - symbols[0].0, expected.0 - shown[0].0];
                    assert_eq!(numbers[0], numbers[1], "{exposure} {symbols_per_frame} {start}");
                    assert_eq!(symbol.1, expected.1, "{exposure} {symbols_per_frame} {start}");
                }
            }
        }
    }

    fn expected(count: u32) -> Vec<(u32, u64)> {
        (0..count).map(|symbol| (symbol, shown(symbol.into()))).collect()
    }

    #[test]
    fn a_mixed_frame_ends_its_symbol_and_spoils_none() {
        for symbols_per_frame in [0.3, 0.5, 0.7, 0.9] {
            let symbols = read(symbols_per_frame, 0.35, 100, |_| Mixture::INSEPARABLE);
            let count = (0.35 + 99.0 * symbols_per_frame) as u32 + 1;
            // The last frame may be the only one of its symbol, and mixed.
            assert_eq!(symbols[..count as usize - 1], expected(count)[..count as usize - 1]);
        }
    }

    #[test]
    fn symbols_that_no_frame_shows_alone_are_read_from_those_that_share_them() {
        for (symbols_per_frame, start) in [(0.999, 0.02), (0.995, 0.1), (0.97, 0.3)] {
            let halves = |symbol: u64| Mixture {
                ending: panel(shown(symbol)),
                beginning: SoftPanel::certain(PanelFrame::from_bits(shown(symbol + 1)), 1),
                ..Mixture::INSEPARABLE
            };
            let symbols = read(symbols_per_frame, start, 100, halves);
            assert_eq!(symbols, expected(symbols.len() as u32));
            let begun_alone = (start + 99.0 * symbols_per_frame) as usize;
            assert!(symbols.len() > begun_alone);
        }
    }

    /// The symbols of frames with saturated LEDs, in which an LED that was On in any part of the exposure is On; `lost` selects lost
    /// frames.
    fn saturated(symbols_per_frame: f64, start: f64, frames: u64, lost: impl Fn(u64) -> bool) -> Vec<Symbol> {
        let mut clock = SymbolClock::new(symbols_per_frame as f32).unwrap();
        let exposure = EXPOSURE_USUAL * symbols_per_frame;
        let mut symbols = Vec::new();
        for frame in (0..frames).filter(|&frame| !lost(frame)) {
            let begin = start + frame as f64 * symbols_per_frame;
            let lit = shown(begin as u64) | shown((begin + exposure) as u64);
            symbols.extend(clock.push(frame, &panel(lit)));
        }
        symbols.extend(clock.flush());
        symbols
    }

    /// The number of wrong LEDs of a symbol.
    fn wrong(symbol: &Symbol, shown: u64) -> u32 {
        ((symbol.panel.hard().bits() ^ shown) & symbol.panel.seen()).count_ones()
    }

    #[test]
    fn a_sure_reading_is_of_one_symbol_whatever_else_the_frame_looks_like() {
        let mut clock = SymbolClock::new(0.5).unwrap();
        for frame in 0..20 {
            let sure = SoftPanel::certain(PanelFrame::from_bits(shown(frame / 2)), 127);
            clock.push_mixed(frame, &sure, &Mixture::INSEPARABLE);
            assert_eq!(clock.current(), Some((frame / 2) as u32));
            assert_eq!(clock.before(frame + 1).seen(), !0);
        }
        clock.push_mixed(20, &panel(shown(10)), &Mixture::INSEPARABLE);
        assert_eq!(clock.current(), Some(10));
        assert_eq!(clock.before(21), SoftPanel::ERASED);
    }

    #[test]
    fn a_noisy_frame_in_the_middle_of_a_symbol_is_no_mixture() {
        let mut clock = SymbolClock::new(0.9).unwrap();
        let mut symbols = Vec::new();
        for frame in 0..100 {
            let symbol = (0.05 + 0.9 * frame as f64) as u64;
            let reading = panel(shown(symbol));
            // Symbols with two frames that determine the phase, and a noisy one in the middle of them.
            symbols.extend(if frame > 1 && frame % 10 == 5 {
                clock.push_mixed(frame, &reading, &Mixture::INSEPARABLE)
            } else {
                clock.push(frame, &reading)
            });
        }
        let symbols: Vec<_> = symbols.iter().map(|symbol| (symbol.index, symbol.panel.hard().bits())).collect();
        assert_eq!(symbols, expected(symbols.len() as u32));
    }

    #[test]
    fn a_trace_of_another_symbol_makes_none() {
        let mut clock = SymbolClock::new(0.3).unwrap();
        let symbol_of = |frame: u64| (0.05 + frame as f64 * 0.3) as u64;
        for frame in 0..200 {
            let sure = SoftPanel::certain(PanelFrame::from_bits(shown(symbol_of(frame))), 100);
            if frame % 7 == 3 {
                let mut trace = sure;
                trace.0[20..].iter_mut().for_each(|llr| *llr /= 50);
                trace.0[40..].iter_mut().for_each(|llr| *llr = -*llr);
                let mixture = Mixture {
                    share: 0.05,
                    ending: sure,
                    beginning: trace,
                    ..Mixture::INSEPARABLE
                };
                clock.push_mixed(frame, &sure, &mixture);
            } else {
                clock.push(frame, &sure);
            }
            assert_eq!(clock.current().map(u64::from), Some(symbol_of(frame)));
        }
    }

    #[test]
    fn an_exposure_that_saturated_leds_share_is_no_symbol_of_its_own() {
        for symbols_per_frame in [0.3, 0.5, 0.7, 0.8, 0.9] {
            for start in [0.05, 0.35, 0.57, 0.85] {
                let symbols = saturated(symbols_per_frame, start, 100, |_| false);
                let count = (start + 99.0 * symbols_per_frame) as usize + 1;
                assert!(symbols.len() >= count);
                for (index, symbol) in symbols.iter().enumerate() {
                    assert_eq!(symbol.index, index as u32);
                    assert_eq!(wrong(symbol, shown(index as u64)), 0, "{symbols_per_frame} {start} {index}");
                }
            }
        }
    }

    #[test]
    fn a_shared_exposure_after_nothing_is_told_by_the_symbol_after_it() {
        let symbols = saturated(0.9, 0.95, 20, |_| false);
        assert_eq!((symbols[0].index, symbols[1].index), (0, 1));
        assert_eq!((symbols[0].last_frame, symbols[1].first_frame), (0, 0));
        assert_eq!(wrong(&symbols[0], shown(0)), 0);
        assert!(symbols[0].panel.seen().count_ones() >= 24);
        assert_eq!(symbols[1].panel.hard().bits(), shown(1));
        let after_a_gap = saturated(0.9, 0.1, 20, |frame| frame == 0 || frame == 10);
        for symbol in after_a_gap {
            assert_eq!(wrong(&symbol, shown(u64::from(symbol.index) + 1)), 0);
        }
    }

    #[test]
    fn the_symbol_before_is_known_until_its_end() {
        let mut clock = SymbolClock::new(0.4).unwrap();
        assert_eq!(clock.before(0), SoftPanel::ERASED);
        clock.push(0, &panel(shown(0)));
        assert_eq!(clock.before(2), panel(shown(0)));
        assert_eq!(clock.before(0), SoftPanel::ERASED);
        assert_eq!(clock.before(9), SoftPanel::ERASED);
    }

    #[test]
    fn a_doubtful_repeat_is_one_where_the_clock_leaves_no_other() {
        let mut clock = SymbolClock::new(0.4).unwrap();
        let mut doubtful = panel(shown(1));
        // 20 of 64 wrong: a correlation of 24/64.
        doubtful.0.iter_mut().take(20).for_each(|llr| *llr = -*llr);
        for (frame, reading) in [(0, shown(0)), (1, shown(0)), (2, shown(0)), (3, shown(1))] {
            clock.push(frame, &panel(reading));
        }
        assert_eq!(clock.push(4, &doubtful), None);
        assert_eq!(clock.current(), Some(1));
    }

    #[test]
    fn another_symbol_is_one_however_soon_it_comes() {
        let mut clock = SymbolClock::new(0.3).unwrap();
        let symbol_of = |frame: u64| (0.05 + frame as f64 * 0.3) as u64;
        let mut symbols = Vec::new();
        // Every eighth frame is lost without a count.
        let frames = (0..200).filter(|frame| frame % 8 != 5);
        for (number, frame) in frames.enumerate() {
            let sure = SoftPanel::certain(PanelFrame::from_bits(shown(symbol_of(frame))), 100);
            symbols.extend(clock.push(number as u64, &sure));
        }
        symbols.extend(clock.flush());
        assert_eq!(symbols.len() as u64, symbol_of(199) + 1);
        for (index, symbol) in symbols.iter().enumerate() {
            assert_eq!(symbol.index, index as u32);
            assert_eq!(wrong(symbol, shown(index as u64)), 0);
        }
    }

    #[test]
    fn merged_values_stay_in_range() {
        let mut clock = SymbolClock::new(0.01).unwrap();
        let sure = SoftPanel::certain(PanelFrame::from_bits(shown(3)), 127);
        for frame in 0..5 {
            clock.push(frame, &sure);
        }
        assert_eq!(clock.flush().unwrap().panel, sure);
    }

    #[test]
    fn gaps_beyond_all_counting_do_not_panic() {
        let mut clock = SymbolClock::new(1.0).unwrap();
        clock.push(0, &panel(shown(0)));
        assert!(clock.push(u64::MAX, &panel(shown(1))).is_some());
        assert!(clock.flush().is_some());
    }

    /// The first of 1500 frames with a wrong symbol number, at a rate that is off by `ppm`. Frames that catch two symbols show the On LEDs
    /// of both if LEDs are saturated; else they show the next symbol, if the one that ends is known.
    fn miscounted(symbols_per_frame: f64, ppm: f64, start: f64, are_saturated: bool) -> Option<u64> {
        let mut clock = SymbolClock::new(symbols_per_frame as f32).unwrap();
        let per_frame = symbols_per_frame * (1.0 + 1e-6 * ppm);
        (0..1500).find(|&frame| {
            let begin = start + frame as f64 * per_frame;
            let [first, last] = [begin, begin + EXPOSURE_USUAL * per_frame].map(|at| at as u64);
            let both = panel(shown(first) | shown(last));
            if first == last || are_saturated {
                clock.push(frame, &both);
            } else if clock.before(frame).hard().bits() == shown(first) {
                let mixture = Mixture {
                    share: 0.5,
                    ending: panel(shown(first)),
                    beginning: panel(shown(last)),
                    ..Mixture::INSEPARABLE
                };
                clock.push_mixed(frame, &SoftPanel::ERASED, &mixture);
            } else {
                clock.push_mixed(frame, &SoftPanel::ERASED, &Mixture::INSEPARABLE);
            }
            first == last && clock.current().map(u64::from) != Some(first)
        })
    }

    #[test]
    fn rates_that_are_off_by_500_ppm_are_followed() {
        for symbols_per_frame in [0.27, 0.35, 0.61, 0.9] {
            for (ppm, start) in [(-500.0, 0.05), (500.0, 0.05), (-500.0, 0.35), (500.0, 0.35)] {
                for are_saturated in [false, true] {
                    assert_eq!(
                        miscounted(symbols_per_frame, ppm, start, are_saturated),
                        None,
                        "{symbols_per_frame} {ppm} {start} {are_saturated}"
                    );
                }
            }
        }
    }

    /// For frames with these periods between them: the shown symbol and the counted one.
    fn counted(symbols_per_frame: f64, start: f64, periods: &[f64]) -> Vec<(u64, u32)> {
        let mut clock = SymbolClock::new(symbols_per_frame as f32).unwrap();
        let mut time_frames = 0.0;
        let counted = periods.iter().enumerate().map(|(frame, after)| {
            time_frames += after;
            let symbol = (start + time_frames * symbols_per_frame) as u64;
            clock.set_late(time_frames - frame as f64);
            clock.push(frame as u64, &panel(shown(symbol)));
            (symbol, clock.current().unwrap())
        });
        counted.collect()
    }

    properties! {
        #[test]
        fn unsteady_frames_are_counted_by_their_times(
            symbols_per_frame in 0.3f64..0.6, start in 0.0f64..1.0, periods in prop::collection::vec(0.4f64..1.6, 200),
        ) {
            let counted = counted(symbols_per_frame, start, &periods);
            let first = counted[0].0;
            for (symbol, index) in counted {
                prop_assert_eq!(symbol - first, u64::from(index));
            }
        }

        #[test]
        fn each_symbol_comes_once_under_its_number(
            symbols_per_frame in 0.3f32..1.0, start in 0.0f64..1.0, lost in prop::collection::vec(prop::bool::weighted(0.1), 200),
        ) {
            let mut clock = SymbolClock::new(symbols_per_frame).unwrap();
            let symbol_of = |frame: usize| (start + frame as f64 * f64::from(symbols_per_frame)) as u64;
            let seen: Vec<usize> = (0..200).filter(|&frame| frame < 20 || !lost[frame]).collect();
            let mut symbols = Vec::new();
            for &frame in &seen {
                symbols.extend(clock.push(frame as u64, &panel(shown(symbol_of(frame)))));
            }
            symbols.extend(clock.flush());
            let mut expected: Vec<u64> = seen.iter().map(|&frame| symbol_of(frame)).collect();
            expected.dedup();
            prop_assert_eq!(symbols.len(), expected.len());
            for (symbol, expected) in symbols.iter().zip(&expected) {
                prop_assert_eq!(symbol.panel.hard().bits(), shown(*expected));
            }
            // After a gap, a symbol's border may lie so close to the exposure that its side is uncertain.
            for (got, want) in symbols.windows(2).zip(expected.windows(2)) {
                let uncertain = got[1].first_frame - got[0].last_frame > 1;
                let (got, want) = (i64::from(got[1].index - got[0].index), (want[1] - want[0]) as i64);
                prop_assert!((got - want).abs() <= i64::from(uncertain), "{} for {}", got, want);
            }
        }

        #[test]
        fn gaps_at_equal_rates_are_counted_exactly(gap in 1u64..10_000) {
            let mut clock = SymbolClock::new(1.0).unwrap();
            clock.push(100, &panel(shown(0)));
            clock.push(100 + gap, &panel(shown(1)));
            let tolerated = (gap as f64 * CLOCK_TOLERANCE) as u64;
            prop_assert!(u64::from(clock.flush().unwrap().index).abs_diff(gap) <= tolerated);
        }
    }
}
