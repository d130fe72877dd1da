//! How much the light of a panel goes up and down, and what people see of it, against IEEE Std 1789-2015.
//!
//! The symbols are the firmware's own ([`panels`]). A message that is shown again and again repeats after two repeats, the second of which
//! is the complement of the first, and an idle transmitter's beacon does so too. So the light is periodic, and its spectrum is exactly
//! that of one period: lines at multiples of the symbol rate over the panels of two repeats, and nothing below the first of them.
//!
//! # Modulation at a frequency
//!
//! The standard's percent modulation, 100·(most − least)/(most + least), is that of a light with one frequency. Data have many, so each
//! line is taken with all others in the third of an octave around it (IEC 61260-1 measures noise in such bands):
//!
//! ```text
//! A(k) = 2·|X(k)| / X(0) · |sinc(k/P)|          X: Fourier transform of the P symbols of a period; sinc: a symbol is held until the next
//! modulation at f(k) = √(Σ A(j)²)               over the lines j with f(j) within f(k)·2^(±1/6)
//! ```
//!
//! which is the amplitude of the sine that has as much power, over the mean light. A sine has its own percent modulation so. A light that
//! is On for half of each period would have 127 %, its fundamental's; the standard counts it as 100 %, and so is everything above 100 %.
//! Bands of a whole octave would show up to √3 times as much of a spectrum without single strong lines.
//!
//! The modulation scales with the symbol rate: it is the same at the same number of cycles a symbol ([`Line`]). What is faster than
//! [`HIGHEST_CYCLES`] is left out, and so is the dimming of 20 kHz and more, which no practice limits.
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

mod practice;
mod spectrum;
mod symbols;
mod visibility;

pub use practice::{Practice, WorstModulation};
pub use spectrum::{HIGHEST_CYCLES, Line, Spectrum};
pub use symbols::{manchester, panels};
pub use visibility::Visibility;

use link::panel::{LEDS, PanelFrame};

/// The modulation of a panel's light.
#[derive(Clone, Debug, PartialEq)]
pub struct Flicker {
    /// At each frequency that of the LED that has most of it.
    pub worst_led: Spectrum,
    /// At each frequency the root mean square over all LEDs.
    pub usual_led: Spectrum,
    /// Of the light of all LEDs together.
    pub panel: Spectrum,
}

impl Flicker {
    /// That of panels that are shown again and again.
    pub fn of(panels: &[PanelFrame]) -> Self {
        let light = |led: usize| panels.iter().map(move |panel| f64::from(panel.led(led)));
        let leds: Vec<Spectrum> = (0..LEDS).map(|led| Spectrum::of(&light(led).collect::<Vec<_>>())).collect();
        let all: Vec<f64> = panels.iter().map(|panel| f64::from(panel.count_on())).collect();
        Self {
            worst_led: Spectrum::greatest(&leds),
            usual_led: Spectrum::root_mean_square(&leds),
            panel: Spectrum::of(&all),
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
                // Complements leave odd multiples of the lowest frequency alone.
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
}
