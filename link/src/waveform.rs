//! The waveform of an LED within a symbol: still, or a carrier too fast to be seen.
//!
//! ```text
//!              │◀─ a cycle ─▶│             │             ║
//!   bit 1   ███│      ██████│      ██████│      ██████│      ███║      a symbol ends
//!   bit 0      │██████      │██████      │██████      │██████   ║
//!                           n whole cycles a symbol
//! ```
//!
//! An LED whose bit is 1 is On for the first quarter of each cycle, Off for half of it and On for the last quarter; one whose bit is 0 is
//! the opposite. So each LED is On for half of each cycle with either bit, and a change of bits makes its runs of light and dark shorter,
//! never longer: hardly any power lies below the carrier. If a cycle began with a whole half of light, runs would be twice as long there.
//!
//! Bits are signs, ±1, and so is the wave w of a 1. Over an exposure the light of an LED is ½ + b·c/2 of that of an LED that is always On.
//! The *contrast* c is the mean of w over the exposure: 1 at most, 0 over whole cycles, and negative for exposures about the middle of a
//! cycle. It is the same for all LEDs that are exposed at the same time.

use core::num::NonZeroU32;
use core::ops::RangeInclusive;

use thiserror::Error;

use crate::symbol_rate::SymbolRate;

/// The waveform of a symbol: [`STILL`](Self::STILL), or a carrier of a whole number of cycles a symbol.
///
/// ```
/// use link::waveform::Waveform;
/// let carrier = Waveform::new(16)?;
/// // Its cycles are 1/16 of a symbol long: a 1 is On for the first 1/64.
/// assert!(carrier.is_on(true, 0.01) && !carrier.is_on(false, 0.01));
/// assert!(!carrier.is_on(true, 0.02) && carrier.is_on(false, 0.02));
/// // 1440 Hz at 90 symbols a second. Half a cycle has full contrast, longer exposures less, a whole cycle none.
/// assert_eq!(carrier.carrier_hz(90.0)?, 1440.0);
/// assert_eq!(carrier.contrast(0.25 / 16.0, 0.75 / 16.0), -1.0);
/// assert!((carrier.contrast(0.0, 0.25 / 16.0 + 1.0 / 16.0) - 0.2).abs() < 1e-12);
/// assert!(carrier.contrast(0.3, 0.3 + 1.0 / 16.0).abs() < 1e-12);
/// // A still panel always has full contrast.
/// assert_eq!(Waveform::STILL.contrast(0.3, 0.7), 1.0);
/// # Ok::<(), link::waveform::WaveformError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Waveform {
    /// Cycles a symbol; 0: none.
    cycles: u16,
}

/// A carrier out of range.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum WaveformError {
    /// The number of cycles a symbol is out of range.
    #[error(
        "{cycles} cycles of a carrier a symbol are outside {} to {}: give 0 for still panels, or a number in between",
        Waveform::MIN_CYCLES,
        Waveform::MAX_CYCLES
    )]
    Cycles {
        /// The requested cycles.
        cycles: u32,
    },
    /// At this symbol rate, the carrier is too slow or too fast.
    #[error(
        "{cycles} cycles a symbol at {symbols_hz} symbols a second are a carrier of {} Hz, outside {} to {} Hz: give other cycles or another \
         rate, or 0 cycles for still panels",
        f64::from(*.cycles) * .symbols_hz,
        Waveform::MIN_HZ,
        Waveform::MAX_HZ
    )]
    Frequency {
        /// The cycles a symbol.
        cycles: u16,
        /// The symbols a second.
        symbols_hz: f64,
    },
}

impl Waveform {
    /// Still panels: no carrier.
    pub const STILL: Self = Self { cycles: 0 };
    /// The fewest cycles a symbol: with one, a change of bits would be as slow as the symbols.
    pub const MIN_CYCLES: u16 = 2;
    /// The most cycles a symbol: [`MAX_HZ`](Self::MAX_HZ) at the slowest of symbol rates.
    pub const MAX_CYCLES: u16 = 333;
    /// The slowest carrier, Hz: its cycle is 5 ms, the longest period without visible flicker by IEEE Std 802.15.7.
    pub const MIN_HZ: f64 = 200.0;
    /// The fastest carrier, Hz: IEEE Std 1789 has no limits above it, and exposures would only lose contrast. The next state of the LEDs is
    /// shifted within a quarter of a cycle, 83 µs: five times what eight shift registers take at 4 MHz.
    pub const MAX_HZ: f64 = 3000.0;

    /// A carrier of `cycles` cycles a symbol; 0: none.
    ///
    /// # Errors
    /// [`WaveformError::Cycles`] outside [`MIN_CYCLES`](Self::MIN_CYCLES) to [`MAX_CYCLES`](Self::MAX_CYCLES).
    pub const fn new(cycles: u32) -> Result<Self, WaveformError> {
        if cycles != 0 && (cycles < Self::MIN_CYCLES as u32 || cycles > Self::MAX_CYCLES as u32) {
            return Err(WaveformError::Cycles { cycles });
        }
        Ok(Self { cycles: cycles as u16 })
    }

    /// Cycles of the carrier a symbol; 0: none.
    pub const fn cycles(self) -> u16 {
        self.cycles
    }

    /// The range of symbol rates at which a transmitter can show it, in thousandths of a symbol a second: the least and the greatest.
    pub fn rates_millihertz(self) -> [u32; 2] {
        let [least, most] = [SymbolRate::MIN, SymbolRate::MAX].map(SymbolRate::millihertz);
        let Some(cycles) = NonZeroU32::new(self.cycles.into()) else {
            return [least, most];
        };
        let slowest = CARRIER_MILLIHERTZ.start().div_ceil(cycles.get());
        let fastest = *CARRIER_MILLIHERTZ.end() / cycles;
        [least.max(slowest), most.min(fastest)]
    }

    /// Whether panels are still.
    pub const fn is_still(self) -> bool {
        self.cycles == 0
    }

    /// The frequency of the carrier at `symbols_hz` symbols a second, Hz; 0: none.
    ///
    /// # Errors
    /// [`WaveformError::Frequency`] if no board can show it: outside [`MIN_HZ`](Self::MIN_HZ) to [`MAX_HZ`](Self::MAX_HZ).
    pub fn carrier_hz(self, symbols_hz: f64) -> Result<f64, WaveformError> {
        let hz = f64::from(self.cycles) * symbols_hz;
        if self.is_still() || (Self::MIN_HZ..=Self::MAX_HZ).contains(&hz) {
            return Ok(hz);
        }
        Err(WaveformError::Frequency {
            cycles: self.cycles,
            symbols_hz,
        })
    }

    /// Whether an LED of this bit is On at a time, in symbols since the start of any symbol.
    pub fn is_on(self, bit: bool, at: f64) -> bool {
        let cycle = phase(f64::from(self.cycles) * at + 0.25);
        bit == (self.is_still() || cycle < 0.5)
    }

    /// The contrast of an exposure from one time to another, in symbols since the start of any symbol: the mean of a 1's wave of −1 and 1.
    ///
    /// It is exact: the wave's integral is a triangle, evaluated at two points. Rounding adds 1e-16 of the times in cycles, over the cycles
    /// between them. The contrast of a single time is that of the state that starts with it.
    pub fn contrast(self, from: f64, to: f64) -> f64 {
        if self.is_still() {
            return 1.0;
        }
        if to <= from {
            return if self.is_on(true, from) { 1.0 } else { -1.0 };
        }
        let [from, to] = [from, to].map(|at| f64::from(self.cycles) * at);
        ((Self::integral(to) - Self::integral(from)) / (to - from)).clamp(-1.0, 1.0)
    }

    /// The integral of a 1's wave of −1 and 1 from the start of a cycle to `cycles` after it: from −¼ to ¼ cycle.
    ///
    /// ```
    /// use link::waveform::Waveform;
    /// assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(Waveform::integral), [0.0, 0.25, 0.0, -0.25, 0.0]);
    /// ```
    pub const fn integral(cycles: f64) -> f64 {
        0.25 - (phase(cycles + 0.25) - 0.5).abs()
    }

    /// The part of an exposure in which an LED of this bit is On, 0 to 1; times as in [`contrast`](Self::contrast).
    pub fn lit(self, bit: bool, from: f64, to: f64) -> f64 {
        let contrast = self.contrast(from, to);
        0.5 + 0.5 * if bit { contrast } else { -contrast }
    }
}

/// A transmitter's symbol rate and waveform. A carrier in it is within the boards' range.
///
/// ```
/// use link::{symbol_rate::SymbolRate, waveform::{SymbolTiming, Waveform}};
/// let timing = SymbolTiming::new(SymbolRate::DEFAULT, Waveform::new(16)?)?;
/// assert_eq!((timing.rate().hz(), timing.waveform().cycles()), (90.0, 16));
/// let fast = SymbolTiming::new(SymbolRate::MAX, timing.waveform()).unwrap_err().to_string();
/// assert!(fast.starts_with("16 cycles a symbol at 300 symbols a second are a carrier of 4800 Hz, outside 200 to 3000 Hz"));
/// let carrier = SymbolTiming::CARRIER;
/// assert_eq!(Ok(carrier), SymbolTiming::new(carrier.rate(), carrier.waveform()));
/// # Ok::<(), link::waveform::WaveformError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SymbolTiming {
    rate: SymbolRate,
    waveform: Waveform,
}

/// The slowest and the fastest carrier, thousandths of a cycle a second.
const CARRIER_MILLIHERTZ: RangeInclusive<u32> = (Waveform::MIN_HZ * 1e3) as u32..=(Waveform::MAX_HZ * 1e3) as u32;

impl SymbolTiming {
    /// A carrier of 1443.2 Hz: of low flicker risk, and apart from the multiples of half the usual frame rates, at which a camera would see
    /// its phase stand still. At exactly [`SymbolRate::DEFAULT`], every carrier is such a multiple. It is the default of LEDs that can show a
    /// carrier.
    pub const CARRIER: Self = match SymbolRate::from_millihertz(90_200) {
        Ok(rate) => Self {
            rate,
            waveform: Waveform { cycles: 16 },
        },
        Err(_) => panic!("a rate in range"),
    };

    /// Symbols at `rate`, each shown by `waveform`.
    ///
    /// # Errors
    /// As [`Waveform::carrier_hz`].
    #[inline]
    pub fn new(rate: SymbolRate, waveform: Waveform) -> Result<Self, WaveformError> {
        // At most 300 000 times 333.
        if waveform.is_still() || CARRIER_MILLIHERTZ.contains(&(rate.millihertz() * u32::from(waveform.cycles))) {
            return Ok(Self { rate, waveform });
        }
        Err(WaveformError::Frequency {
            cycles: waveform.cycles,
            symbols_hz: rate.hz(),
        })
    }

    /// Still panels at `rate`.
    pub const fn still(rate: SymbolRate) -> Self {
        Self {
            rate,
            waveform: Waveform::STILL,
        }
    }

    /// The symbol rate.
    pub const fn rate(self) -> SymbolRate {
        self.rate
    }

    /// The waveform of each symbol.
    pub const fn waveform(self) -> Waveform {
        self.waveform
    }
}

/// The distance of a number below 2⁶³ from the greatest integer that is not above it.
const fn phase(cycles: f64) -> f64 {
    let part = cycles - cycles as i64 as f64;
    if part < 0.0 { part + 1.0 } else { part }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbol_rate::SymbolRate;
    use properties::prelude::*;
    use std::string::ToString;

    #[test]
    fn cycles_and_frequencies_outside_of_the_range_are_refused() {
        for cycles in [1, 334, u32::MAX] {
            assert_eq!(Waveform::new(cycles), Err(WaveformError::Cycles { cycles }));
        }
        for cycles in [0, 2, 333] {
            assert_eq!(Waveform::new(cycles).map(Waveform::cycles), Ok(cycles as u16));
        }
        assert_eq!(Waveform::new(0), Ok(Waveform::STILL));
        assert_eq!(Waveform::STILL.carrier_hz(9.0), Ok(0.0));
        let carrier = |cycles, symbols_hz| Waveform::new(cycles).and_then(|waveform| waveform.carrier_hz(symbols_hz));
        assert_eq!(carrier(2, 100.0), Ok(200.0));
        assert_eq!(carrier(10, 300.0), Ok(3000.0));
        for (cycles, symbols_hz) in [(2, 99.0), (11, 300.0), (16, f64::NAN), (16, 0.0)] {
            assert!(matches!(carrier(cycles, symbols_hz), Err(WaveformError::Frequency { .. })));
        }
        let slow = carrier(16, 9.0).unwrap_err().to_string();
        assert!(slow.contains("144 Hz, outside 200 to 3000 Hz"), "{slow}");
        let slowest = SymbolRate::MIN.hz();
        assert!(carrier(u32::from(Waveform::MAX_CYCLES), slowest).is_ok());
        assert!(f64::from(Waveform::MAX_CYCLES + 1) * slowest > Waveform::MAX_HZ);
    }

    #[test]
    fn rates_are_kept_where_their_carrier_can_be_latched() {
        for cycles in [0, 2, 3, 16, 54, 333] {
            let waveform = Waveform::new(cycles).expect("a carrier");
            let timing = |millihertz| SymbolRate::from_millihertz(millihertz).map(|rate| SymbolTiming::new(rate, waveform));
            let within = |millihertz| matches!(timing(millihertz), Ok(Ok(_)));
            let [least, most] = waveform.rates_millihertz();
            assert!(within(least) && within(most) && !within(least - 1) && !within(most + 1), "{cycles}");
            for millihertz in [least, most] {
                assert!(waveform.carrier_hz(f64::from(millihertz) / 1e3).is_ok());
            }
        }
    }

    #[test]
    fn a_cycle_begins_in_the_middle_of_a_half() {
        let carrier = Waveform::new(3).expect("a carrier");
        let states = |bit| -> Vec<bool> {
            (0..12)
                .map(|quarter| carrier.is_on(bit, (f64::from(quarter) + 0.5) / 12.0))
                .collect()
        };
        assert_eq!(states(true), [true, false, false, true].repeat(3));
        assert_eq!(states(false), [false, true, true, false].repeat(3));
    }

    #[test]
    fn a_camera_sees_at_most_what_its_exposure_holds_beyond_whole_cycles() {
        // 1440 Hz at 1/4000, 1/1000 s: all of it on some phases, and 0.31 at most.
        let carrier = Waveform::new(16).expect("a carrier");
        for (exposure_s, most) in [(0.000_25, 1.0), (0.001, 0.44 / 1.44), (1.0 / 1440.0, 0.0)] {
            let contrasts = (0..1000).map(|step| f64::from(step) / 16_000.0);
            let contrasts = contrasts.map(|from| carrier.contrast(from, from + 90.0 * exposure_s).abs());
            assert!((contrasts.fold(0.0, f64::max) - most).abs() < 1e-9, "{exposure_s} s");
        }
    }

    properties! {
        #[test]
        fn the_contrast_is_the_mean_of_the_states(cycles in 2u32..40, from in 0.0..3.0_f64, length in 0.0..2.0_f64) {
            let carrier = Waveform::new(cycles).expect("a carrier");
            // Edges at odd quarters of cycles divide the exposure.
            let edge = |half: f64| (0.25 + 0.5 * half) / f64::from(cycles);
            let first = (from * f64::from(cycles) - 0.25) * 2.0;
            let mut times = vec![from];
            times.extend((0..).map(|step| edge(libm::floor(first) + f64::from(step) + 1.0)).take_while(|&at| at < from + length));
            times.push(from + length);
            let on: f64 = times
                .windows(2)
                .map(|part| if carrier.is_on(true, (part[0] + part[1]) / 2.0) { part[1] - part[0] } else { 0.0 })
                .sum();
            let [lit, unlit] = [true, false].map(|bit| carrier.lit(bit, from, from + length));
            prop_assert!((lit * length - on).abs() < 1e-12, "{lit} of {length}, {on}");
            prop_assert!((lit + unlit - 1.0).abs() < 1e-12);
        }

        #[test]
        fn whole_cycles_say_nothing(cycles in 2u32..40, count in 1u32..20, from in 0.0..3.0_f64) {
            let carrier = Waveform::new(cycles).expect("a carrier");
            let to = from + f64::from(count) / f64::from(cycles);
            prop_assert!(carrier.contrast(from, to).abs() < 1e-12);
        }
    }
}
