//! The symbol clock: the times at which a counter latches the LEDs, and their states.
//!
//! ```text
//!   still    │ panel                                         │ panel                         one tick a symbol
//!   carrier  │ panel │ complement    │ panel         │ compl… │ …                             four ticks a cycle
//!            ▲       ▲       ▲       ▲       ▲       ▲
//! ```
//!
//! With a [carrier](link::waveform) each tick is a quarter of a cycle and latches the panel or its complement, in the order of
//! [`QUARTERS`]; between two equal quarters the tick has no visible effect. So each LED is lit for two of four quarters, and 32 of 64 are
//! On on average over a cycle, for any message. The mean intensity of [`IntensityLimit`](link::intensity::IntensityLimit), half of the LEDs
//! On, is then exact for each panel.
//!
//! Ticks are equal whole counts of the clock: the rate is off by half a count at most, and the light has no jitter.

use link::waveform::SymbolTiming;

/// Whether an LED with bit 1 is On in each quarter of a carrier's cycle; one with bit 0 is the opposite.
pub const QUARTERS: [bool; 4] = [true, false, false, true];

/// The shortest latch pulse, in counts of the undivided clock: 47 ns at 150 MHz.
const LATCH_COUNTS: u16 = 7;

/// The settings of a 16-bit counter with an 8-bit divider for the ticks of a symbol timing.
///
/// ```
/// use link::{symbol_rate::SymbolRate, waveform::{SymbolTiming, Waveform}};
/// use tx_firmware::symbol_clock::SymbolClock;
///
/// let still = SymbolClock::new(SymbolTiming::default(), 125_000_000);
/// assert_eq!(still, SymbolClock { ticks: 1, divider: 22, top: 63_130, latch_from: 63_130 });
/// // 1440 Hz: 64 ticks a symbol.
/// let carrier = SymbolTiming::new(SymbolRate::DEFAULT, Waveform::new(16)?)?;
/// assert_eq!(SymbolClock::new(carrier, 125_000_000), SymbolClock { ticks: 64, divider: 1, top: 21_700, latch_from: 21_694 });
/// # Ok::<(), link::waveform::WaveformError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SymbolClock {
    /// Ticks of a symbol.
    pub ticks: u32,
    /// The divider of the system clock.
    pub divider: u8,
    /// The counter's last value: a tick has one more count.
    pub top: u16,
    /// The latch is high from this count to the tick's end. The next panel is shifted from then on, so the latch must not be transparent
    /// while high.
    pub latch_from: u16,
}

impl SymbolClock {
    /// The finest division that fits the 16-bit counter. Half a count is at most 15 parts in a million of a still symbol, and 48 of a cycle
    /// of the fastest carrier at 125 MHz.
    pub fn new(timing: SymbolTiming, system_hz: u32) -> Self {
        Self::with_divider(timing, system_hz, |least| least.clamp(1, 255))
    }

    /// The same for a counter whose divider is a power of two, at most 128. A still symbol fits it if the clock is 75 MHz or less.
    pub fn with_power_of_two(timing: SymbolTiming, system_hz: u32) -> Self {
        Self::with_divider(timing, system_hz, |least| least.next_power_of_two().min(128))
    }

    fn with_divider(timing: SymbolTiming, system_hz: u32, divider_from: impl Fn(u64) -> u64) -> Self {
        let cycles = u32::from(timing.waveform().cycles());
        let ticks = (QUARTERS.len() as u32 * cycles).max(1);
        let millihertz = timing.rate().millihertz();
        // A carrier's short tick takes the nearest count, a still symbol the next below.
        let [ticks_millihertz, half] = [millihertz * ticks, millihertz * (ticks / 2)].map(u64::from);
        let system_cycles = (u64::from(system_hz) * 1000 + half) / ticks_millihertz;
        let divider = divider_from(system_cycles.div_ceil(1 << 16));
        let counts = (system_cycles + divider / 2) / divider;
        let divider = divider as u8;
        let top = counts.saturating_sub(1).min(u16::MAX.into()) as u16;
        Self {
            ticks,
            divider,
            top,
            latch_from: top.saturating_sub(LATCH_COUNTS.div_ceil(divider.into()) - 1),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use link::panel::LEDS;
    use link::symbol_rate::SymbolRate;
    use link::waveform::Waveform;
    use properties::prelude::*;
    use std::vec::Vec;

    /// The RP2040's and the RP2350's.
    const CLOCKS_HZ: [u32; 2] = [125_000_000, 150_000_000];
    /// The time for eight registers at 4 MHz, s.
    const SHIFTED_S: f64 = 16e-6;

    prop_compose! {
        fn timings()(cycles in prop_oneof![Just(0), 2..=333u32], share in 0.0..=1.0f64) -> SymbolTiming {
            let waveform = Waveform::new(cycles).unwrap();
            let [least, most] = waveform.rates_millihertz().map(f64::from);
            let rate = SymbolRate::from_millihertz((least + share * (most - least)) as u32).unwrap();
            SymbolTiming::new(rate, waveform).unwrap()
        }
    }

    /// The start of each tick of a symbol, and the end of the last, s.
    fn ticks_s(clock: SymbolClock, system_hz: u32) -> Vec<f64> {
        let tick_s = f64::from(clock.divider) * (f64::from(clock.top) + 1.0) / f64::from(system_hz);
        (0..=clock.ticks).map(|tick| f64::from(tick) * tick_s).collect()
    }

    properties! {
        #[test]
        fn ticks_are_where_the_carrier_has_its_edges(timing in timings()) {
            for system_hz in CLOCKS_HZ {
                let clock = SymbolClock::new(timing, system_hz);
                let ticks_s = ticks_s(clock, system_hz);
                let waveform = timing.waveform();
                for (tick, edges) in ticks_s.windows(2).enumerate() {
                    // For a simulated camera: the state in the middle of the tick, by the time in symbols.
                    let middle = (edges[0] + edges[1]) / 2.0 * timing.rate().hz();
                    let is_panel = QUARTERS[tick % QUARTERS.len()];
                    prop_assert!(waveform.is_still() || waveform.is_on(true, middle) == is_panel, "{timing:?}, tick {tick}");
                }
                // Half a count of 65 536/2 with a divided clock, or of the counts of a tick.
                let symbol_s = ticks_s[ticks_s.len() - 1];
                let counts = f64::from(clock.top) + 1.0;
                let error = (symbol_s * timing.rate().hz() - 1.0).abs();
                prop_assert!(error <= 1.001 * 0.5 / counts.min(32_768.0) + 1e-9, "{timing:?}: {error}");
                prop_assert!(error <= if waveform.is_still() { 1.6e-5 } else { 4.9e-5 }, "{timing:?}: {error}");
            }
        }

        #[test]
        fn a_tick_has_room_for_a_panel_to_be_shifted_and_for_a_clean_latch(timing in timings()) {
            for system_hz in CLOCKS_HZ {
                let clock = SymbolClock::new(timing, system_hz);
                let tick_s = ticks_s(clock, system_hz)[1];
                prop_assert!(tick_s > 5.0 * SHIFTED_S);
                let latch_s = f64::from(clock.divider) * (f64::from(clock.top) + 1.0 - f64::from(clock.latch_from)) / f64::from(system_hz);
                prop_assert!((40e-9..2.1e-6).contains(&latch_s) && tick_s - latch_s > 4.0 * SHIFTED_S, "{clock:?}");
            }
        }

        #[test]
        fn a_power_of_two_divides_still_symbols_as_finely(
            millihertz in SymbolRate::MIN.millihertz()..=SymbolRate::MAX.millihertz(), system_hz in 4_000_000u32..=75_000_000,
        ) {
            let timing = SymbolTiming::still(SymbolRate::from_millihertz(millihertz).unwrap());
            let clock = SymbolClock::with_power_of_two(timing, system_hz);
            prop_assert!(clock.divider.is_power_of_two() && clock.ticks == 1);
            let symbol_s = ticks_s(clock, system_hz)[1];
            let error = (symbol_s * timing.rate().hz() - 1.0).abs();
            let (counts, divider) = (f64::from(clock.top) + 1.0, f64::from(clock.divider));
            prop_assert!(clock.divider == 1 || counts > 32_767.0, "{clock:?}");
            prop_assert!(error <= (0.5 * divider + 1.0) / (counts * divider), "{timing:?} at {system_hz} Hz: {error}");
            let latch_s = (counts - f64::from(clock.latch_from)) * f64::from(clock.divider) / f64::from(system_hz);
            prop_assert!((40e-9..35e-6).contains(&latch_s), "{latch_s}");
        }

        #[test]
        fn each_led_is_lit_for_half_of_each_cycle_and_half_of_them_on_average(bits in any::<u64>()) {
            let shown = QUARTERS.map(|is_panel| if is_panel { bits } else { !bits });
            for led in 0..LEDS {
                prop_assert_eq!(shown.iter().filter(|shown| *shown >> led & 1 == 1).count(), 2);
            }
            prop_assert_eq!(shown.iter().map(|shown| shown.count_ones()).sum::<u32>() as usize, QUARTERS.len() * LEDS / 2);
        }
    }
}
