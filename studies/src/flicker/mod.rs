//! The modulation of a panel's light and its visibility, by IEEE Std 1789-2015, IEEE Std 802.15.7, IEC TR 61547-1 and CIE TN 006:2016.
//!
//! The symbols are the firmware's own ([`panels`]). A repeated message has a period of two repeats, because the second is the complement of
//! the first; an idle transmitter's beacon has the same. So the light is periodic, and its spectrum is exactly that of one period: lines at
//! multiples of the symbol rate over the panels of two repeats, and nothing below the first of them.
//!
//! # Modulation at a frequency
//!
//! The standard's percent modulation, 100·(most − least)/(most + least), is defined for a light with one frequency. Data have many, so each
//! line is summed with all others in the third of an octave around it (IEC 61260-1 measures noise in such bands):
//!
//! ```text
//! A(k) = 2·|X(k)| / X(0) · |sinc(k/P)|          X: Fourier transform of the P symbols of a period; sinc: a symbol is held until the next
//! modulation at f(k) = √(Σ A(j)²)               over the lines j with f(j) within f(k)·2^(±1/6)
//! ```
//!
//! This is the amplitude of the sine with the same power, over the mean light. A sine gets its own percent modulation. A light that is On
//! for half of each period would have 127 %, its fundamental's; the standard counts it as 100 %, and so does this module for everything
//! above 100 %. Bands of a whole octave would show up to √3 times as much for a spectrum without single strong lines.
//!
//! The modulation scales with the symbol rate: it is the same at the same number of cycles a symbol ([`Line`]). Lines above
//! [`HIGHEST_CYCLES`] are left out, and so is the dimming at 20 kHz and more, which no practice limits. With a carrier, the transform of
//! its cycles replaces the sinc ([`Light`]), and lines up to [`HIGHEST_CARRIERS`] are used.
//!
//! ```
//! use studies::flicker::{Flicker, Practice, Visibility, panels};
//! let flicker = Flicker::of(&panels(Some(b"Ice"))?);
//! // 90 symbols a second: people see single LEDs flicker, and the low-risk practice is not met.
//! assert_eq!(Visibility::of(&flicker.worst_led, 90.0), Visibility::Flickers);
//! assert!(Practice::LowRisk.worst(&flicker.worst_led, 90.0).is_some_and(|worst| worst.times_limit() > 1.0));
//! // The panel as a whole is far steadier.
//! assert!(Practice::LowRisk.lowest_rate_hz(&flicker.panel) < Practice::LowRisk.lowest_rate_hz(&flicker.worst_led));
//! # Ok::<(), link::framing::FramingError>(())
//! ```

mod flickermeter;
mod light;
mod practice;
mod spectrum;
mod stroboscopic;
mod symbols;
mod visibility;

pub use flickermeter::short_term;
pub use light::Light;
pub use practice::{Practice, WorstModulation};
pub use spectrum::{HIGHEST_CARRIERS, HIGHEST_CYCLES, Line, Spectrum};
pub use stroboscopic::stroboscopic;
pub use symbols::{manchester, panels};
pub use visibility::Visibility;

use link::panel::{LEDS, PanelFrame};
use link::waveform::Waveform;

use crate::stop::Stop;

/// The modulation of a panel's light.
#[derive(Clone, Debug, PartialEq)]
pub struct Flicker {
    /// At each frequency, the greatest modulation of any LED.
    pub worst_led: Spectrum,
    /// At each frequency the root mean square over all LEDs.
    pub usual_led: Spectrum,
    /// The modulation of all LEDs' light together.
    pub panel: Spectrum,
    /// The light of each LED.
    leds: Vec<Light>,
    /// The light of all LEDs.
    all: Light,
}

/// Measures of a light by standards other than IEEE Std 1789.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// The longest flicker period, s: see [`Light::longest_period`].
    pub longest_period_s: f64,
    /// P_st^LM: see [`short_term`].
    pub short_term: f64,
    /// SVM: see [`stroboscopic`].
    pub stroboscopic: f64,
}

impl Flicker {
    /// The flicker of panels that repeat, each still for a symbol.
    pub fn of(panels: &[PanelFrame]) -> Self {
        Self::with_waveform(panels, Waveform::STILL)
    }

    /// The flicker of panels that repeat, with a waveform.
    pub fn with_waveform(panels: &[PanelFrame], waveform: Waveform) -> Self {
        let leds: Vec<Light> = (0..LEDS).map(|led| Light::of_led(panels, led, waveform)).collect();
        let all = Light::of_panel(panels, waveform);
        let (mut worst_led, mut squares) = (Spectrum::default(), Spectrum::default());
        for led in &leds {
            let spectrum = Spectrum::of_light(led);
            worst_led.gather(&spectrum, f64::max);
            squares.gather(&spectrum, |sum, percent| sum + percent * percent);
        }
        Self {
            worst_led,
            usual_led: squares.root_of_mean(LEDS),
            panel: Spectrum::of_light(&all),
            leds,
            all,
        }
    }

    /// Like the function [`low_risk_times`], from spectra that are already computed, at a symbol rate in Hz.
    pub fn low_risk_times(&self, rate_hz: f64) -> f64 {
        let [led, all] = [&self.worst_led, &self.panel].map(|spectrum| Practice::LowRisk.times(spectrum, rate_hz));
        led.max(all)
    }

    /// For each measure the worst LED's, at a symbol rate in Hz.
    pub fn worst_led_measures(&self, rate_hz: f64) -> Measures {
        let measures = self.leds.iter().map(|led| Measures::of(led, rate_hz));
        measures.fold(Measures::of(&Light::still(&[]), rate_hz), |worst, led| Measures {
            longest_period_s: worst.longest_period_s.max(led.longest_period_s),
            short_term: worst.short_term.max(led.short_term),
            stroboscopic: worst.stroboscopic.max(led.stroboscopic),
        })
    }

    /// The measures of all LEDs together, at a symbol rate in Hz.
    pub fn panel_measures(&self, rate_hz: f64) -> Measures {
        Measures::of(&self.all, rate_hz)
    }
}

/// The greatest modulation of any LED, and of all together, relative to the limit of [`Practice::LowRisk`], at `rate_hz` symbols a second.
/// Up to 1, the light meets the practice at every frequency. `None` on a stop.
///
/// ```
/// use link::waveform::Waveform;
/// use studies::flicker::{low_risk_times, panels};
/// use studies::stop::Stop;
/// let panels = panels(None)?;
/// let times = |cycles| low_risk_times(&panels, Waveform::new(cycles).ok()?, 90.0, Stop::NEVER);
/// assert!(times(0).is_some_and(|times| times > 100.0) && times(16).is_some_and(|times| times < 1.0));
/// # Ok::<(), link::framing::FramingError>(())
/// ```
pub fn low_risk_times(panels: &[PanelFrame], waveform: Waveform, rate_hz: f64, stop: Stop) -> Option<f64> {
    let leds = (0..LEDS).map(|led| Light::of_led(panels, led, waveform));
    let mut lights = leds.chain([Light::of_panel(panels, waveform)]);
    lights.try_fold(0.0, |greatest: f64, light| {
        let times = Practice::LowRisk.times(&Spectrum::of_light(&light), rate_hz);
        (!stop.is_asked()).then_some(greatest.max(times))
    })
}

impl Measures {
    /// The measures of a light at a symbol rate in Hz.
    pub fn of(light: &Light, rate_hz: f64) -> Self {
        Self {
            longest_period_s: light.longest_period() / rate_hz,
            short_term: short_term(light, rate_hz),
            stroboscopic: stroboscopic(light, rate_hz),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_of_as_many_leds_always_is_steady_whatever_its_leds_do() {
        let halves = [0xffff_ffff_u64, !0xffff_ffff].map(PanelFrame::from_bits);
        let flicker = Flicker::of(&halves);
        assert_eq!(flicker.panel.lines().count(), 0);
        assert_eq!(Visibility::of(&flicker.panel, 9.0), Visibility::Steady);
        let first = flicker.worst_led.lines().next().expect("a line");
        assert_eq!((first.cycles, first.percent), (0.5, 100.0));
        assert_eq!(flicker.worst_led, flicker.usual_led);
    }

    #[test]
    fn nothing_of_a_message_is_slower_than_two_of_its_repeats() {
        for message in [None, Some(b"Ice".as_slice()), Some(&[b'x'; 100])] {
            let panels = panels(message).expect("a message");
            let flicker = Flicker::of(&panels);
            for spectrum in [flicker.worst_led, flicker.panel] {
                // Complements leave only odd multiples of the lowest frequency.
                let lines = spectrum.lines();
                let multiples = lines.map(|line| (line.cycles * panels.len() as f64).round() as u64);
                assert!(multiples.into_iter().all(|multiple| multiple % 2 == 1));
            }
        }
    }

    #[test]
    fn manchester_takes_the_low_frequencies_away() {
        let panels = panels(Some(&[b'x'; 100])).expect("a message");
        let [plain, coded] = [Flicker::of(&panels), Flicker::of(&manchester(&panels))];
        for practice in Practice::ALL {
            let lowest = |flicker: &Flicker| practice.lowest_rate_hz(&flicker.worst_led);
            assert!(lowest(&coded) < lowest(&plain), "{practice}");
        }
    }
    /// Symbols a second.
    const RATE_HZ: f64 = 90.0;

    /// Panels of a message of 128 bytes.
    fn long() -> Vec<PanelFrame> {
        let text = b"Slow down: road works ahead, the left lane is closed for 800 metres. ";
        let message: Vec<u8> = text.iter().copied().cycle().take(128).collect();
        panels(Some(&message)).expect("a message")
    }

    /// The light of an LED whose symbols are `cycles` cycles of four quarters: those in `lit` for a 1, the others for a 0.
    fn quarters(panels: &[PanelFrame], led: usize, cycles: usize, lit: [bool; 4]) -> Vec<f64> {
        let of_bit = |bit: bool| lit.repeat(cycles).into_iter().map(move |lit| f64::from(u8::from(lit == bit)));
        panels.iter().flat_map(|panel| of_bit(panel.led(led))).collect()
    }

    const COSINE: [bool; 4] = [true, false, false, true];
    const SINE: [bool; 4] = [true, true, false, false];

    #[test]
    fn a_carrier_s_series_is_that_of_its_quarters() {
        let panels = &panels(Some(b"Ice")).expect("a message");
        for cycles in [2, 3, 5, 16] {
            let waveform = Waveform::new(cycles as u32).expect("a carrier");
            let flicker = Flicker::with_waveform(panels, waveform);
            for led in [0, 17, 63] {
                let drawn = Light::still(&quarters(panels, led, cycles, COSINE));
                for line in 1..HIGHEST_CARRIERS as usize * cycles * panels.len() {
                    let [one, other] = [&flicker.leds[led], &drawn].map(|light| light.amplitude_percent(line));
                    assert!((one - other).abs() < 1e-9, "{cycles} cycles, line {line}: {one} against {other}");
                }
                // The parts of one are relative to the middle of a symbol, of the other to that of a quarter.
                let [one, other] = [
                    short_term(&flicker.leds[led], RATE_HZ),
                    short_term(&drawn, RATE_HZ * 4.0 * cycles as f64),
                ];
                assert!((one - other).abs() < 1e-3 * one, "{one} against {other}");
                let [one, other] = [
                    stroboscopic(&flicker.leds[led], RATE_HZ),
                    stroboscopic(&drawn, RATE_HZ * 4.0 * cycles as f64),
                ];
                assert!((one - other).abs() < 1e-9, "{one} against {other}");
            }
        }
    }

    /// The worst LED below 90 Hz: relative to the low-risk limit, and in %.
    fn below_90_hz(panels: &[PanelFrame], cycles: usize, lit: [bool; 4]) -> [f64; 2] {
        let mut worst = [0.0f64; 2];
        for led in 0..LEDS {
            let spectrum = Spectrum::of(&quarters(panels, led, cycles, lit));
            let rate_hz = RATE_HZ * 4.0 * cycles as f64;
            for line in spectrum.lines().take_while(|line| line.cycles * rate_hz < 90.0) {
                let limit = Practice::LowRisk.limit_percent(line.cycles * rate_hz);
                worst = [worst[0].max(line.percent / limit), worst[1].max(line.percent)];
            }
        }
        worst
    }

    #[test]
    fn a_cycle_begun_in_the_middle_of_a_half_leaves_far_less_below_the_carrier() {
        let panels = long();
        for (cycles, lit, times, percent) in [
            (3, SINE, 30.0, 16.0),
            (3, COSINE, 2.0, 3.2),
            (5, COSINE, 0.64, 0.8),
            (14, SINE, 5.0, 3.3),
            (14, COSINE, 0.08, 0.12),
        ] {
            let found = below_90_hz(&panels, cycles, lit);
            for (found, expected) in found.into_iter().zip([times, percent]) {
                assert!(
                    (0.5..2.0).contains(&(found / expected)),
                    "{cycles} cycles, {lit:?}: {found} against {expected}"
                );
            }
        }
    }

    #[test]
    fn a_carrier_of_1440_hz_is_of_low_risk_and_the_same_in_sine_phase_is_not() {
        let carrier = Waveform::new(16).expect("a carrier");
        for message in [
            None,
            Some(vec![0; 8]),
            Some(vec![0xa5; 32]),
            Some(vec![b'x'; 128]),
            Some(vec![0x3c; 1024]),
        ] {
            let panels = panels(message.as_deref()).expect("a message");
            let flicker = Flicker::with_waveform(&panels, carrier);
            let times = flicker.low_risk_times(RATE_HZ);
            assert!(times < 1.0, "{times}");
            assert_eq!(low_risk_times(&panels, carrier, RATE_HZ, Stop::NEVER), Some(times));
            for measures in [flicker.worst_led_measures(RATE_HZ), flicker.panel_measures(RATE_HZ)] {
                assert!(measures.longest_period_s < 0.005 && measures.short_term < 1.0, "{measures:?}");
            }
        }
        let [times, _] = below_90_hz(&long(), 16, SINE);
        assert!(times > 1.0, "{times}");
    }

    #[test]
    fn panels_that_stand_still_are_far_beyond_all_measures() {
        let flicker = Flicker::of(&long());
        let worst = flicker.worst_led_measures(RATE_HZ);
        assert!(worst.longest_period_s > 0.02 && worst.short_term > 10.0, "{worst:?}");
    }
}
