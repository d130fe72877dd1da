//! The spectrum of a light that is switched symbol by symbol.

use super::Light;

/// The highest line in use, in cycles a symbol. A higher line has at most 2/(8·π), 8 %, of the mean light, because symbols are held and
/// light is never negative.
pub const HIGHEST_CYCLES: f64 = 8.0;
/// The highest line in use with a carrier, in cycles of it: above all limited frequencies.
pub const HIGHEST_CARRIERS: f64 = 16.0;
/// The ratio of the end to the middle of a third of an octave.
pub(super) const TO_BAND_END: f64 = 1.122_462_048_309_373;
/// The greatest rounding error of a zero line, %.
const ROUNDING_PERCENT: f64 = 1e-6;

/// The modulation at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Cycles a symbol: the frequency over the symbol rate, above 0 to [`HIGHEST_CYCLES`], or to [`HIGHEST_CARRIERS`] times those of a
    /// carrier.
    pub cycles: f64,
    /// The modulation in the third of an octave around it, above 0 to 100 % of the mean light.
    pub percent: f64,
}

/// The modulation of a periodic light, at each of its lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Symbols of a period.
    period: usize,
    /// The modulation at 1, 2, 3 … cycles a period, %; 0 if the light has no line there.
    percents: Vec<f64>,
}

impl Spectrum {
    /// The spectrum of one period of a light, symbol by symbol, in any unit.
    ///
    /// ```
    /// use studies::flicker::Spectrum;
    /// // Alternately On and Off: a square wave of half of the symbol rate, and its third harmonic.
    /// let square = Spectrum::of(&[1.0, 0.0]);
    /// let lines: Vec<_> = square.lines().take(2).collect();
    /// assert_eq!((lines[0].cycles, lines[0].percent), (0.5, 100.0));
    /// assert!(lines[1].cycles == 1.5 && (lines[1].percent - 400.0 / (3.0 * std::f64::consts::PI)).abs() < 1e-9);
    /// assert_eq!(Spectrum::of(&[3.0; 10]).lines().count(), 0);
    /// ```
    pub fn of(light: &[f64]) -> Self {
        Self::of_light(&Light::still(light))
    }

    /// The spectrum of a light.
    pub fn of_light(light: &Light) -> Self {
        let (period, cycles) = (light.period(), light.highest_cycles());
        let amplitudes = (1..=(cycles * TO_BAND_END * period as f64).ceil() as usize).map(|line| light.amplitude_percent(line));
        let amplitudes: Vec<f64> = amplitudes.collect();
        // Sums of all powers up to each line, so that a band is a difference of two.
        let mut powers = vec![0.0; 1];
        powers.extend(amplitudes.iter().scan(0.0, |sum, amplitude| {
            *sum += amplitude * amplitude;
            Some(*sum)
        }));
        let band = |line: usize| {
            let middle = line as f64;
            let below = (middle / TO_BAND_END).ceil() as usize - 1;
            let last = ((middle * TO_BAND_END) as usize).min(amplitudes.len());
            (powers[last] - powers[below]).max(0.0).sqrt().min(100.0)
        };
        let lines = 1..=(cycles * period as f64) as usize;
        let percents = lines.map(|line| match amplitudes.get(line - 1) {
            Some(&amplitude) if amplitude > ROUNDING_PERCENT => band(line),
            _ => 0.0,
        });
        Self {
            period,
            percents: percents.collect(),
        }
    }

    /// Combines the modulation at each frequency with that of another light of the same period, by `gathered`; start with the default.
    pub(super) fn gather(&mut self, other: &Self, gathered: impl Fn(f64, f64) -> f64) {
        self.period = other.period;
        self.percents.resize(other.percents.len(), 0.0);
        for (so_far, &percent) in self.percents.iter_mut().zip(&other.percents) {
            *so_far = gathered(*so_far, percent);
        }
    }

    /// The root mean square over `lights` lights, from the sum of squares.
    pub(super) fn root_of_mean(mut self, lights: usize) -> Self {
        self.percents
            .iter_mut()
            .for_each(|percent| *percent = (*percent / lights as f64).sqrt());
        self
    }

    /// The modulation at each existing line, from the slowest on.
    pub fn lines(&self) -> impl Iterator<Item = Line> {
        let lines = (1..).zip(&self.percents);
        let lines = lines.filter(|(_, percent)| **percent > 0.0);
        lines.map(|(line, &percent)| Line {
            cycles: f64::from(line) / self.period as f64,
            percent,
        })
    }

    /// The strongest line from `from_hz` to below `to_hz` at a symbol rate, all in Hz; `None` if there is no line.
    pub fn strongest(&self, rate_hz: f64, from_hz: f64, to_hz: f64) -> Option<Line> {
        let within = |line: &Line| (from_hz..to_hz).contains(&(line.cycles * rate_hz));
        self.lines()
            .filter(within)
            .max_by(|one, other| one.percent.total_cmp(&other.percent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    use properties::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn a_light_that_is_dark_or_steady_or_not_there_has_no_lines() {
        for light in [vec![], vec![0.0; 6], vec![1.0; 7]] {
            assert_eq!(Spectrum::of(&light).lines().count(), 0, "{light:?}");
        }
    }

    #[test]
    fn a_square_wave_over_several_symbols_has_its_own_frequency() {
        for half in [1, 3, 8] {
            let light = [vec![1.0; half], vec![0.0; half]].concat();
            let first = Spectrum::of(&light).lines().next().expect("a line");
            assert_eq!(first.cycles, 0.5 / half as f64);
            assert_eq!(first.percent, 100.0);
        }
    }

    #[test]
    fn a_small_square_wave_has_four_over_pi_of_its_amplitude() {
        let first = Spectrum::of(&[1.1, 0.9]).lines().next().expect("a line");
        assert!((first.percent - 40.0 / PI).abs() < 1e-9);
    }

    #[test]
    fn random_symbols_have_the_spectrum_that_theory_gives_them() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let light: Vec<f64> = (0..1 << 16).map(|_| f64::from(random.next_u32() & 1)).collect();
        let spectrum = Spectrum::of(&light);
        // Twice a density of 2·sinc², over a third of an octave.
        let octave = TO_BAND_END - 1.0 / TO_BAND_END;
        for cycles in [0.02, 0.1, 0.3] {
            let line = spectrum.lines().find(|line| line.cycles >= cycles);
            let sinc = (PI * cycles).sin() / (PI * cycles);
            let theory = 100.0 * (2.0 * 2.0 * sinc * sinc * octave * cycles).sqrt();
            let found = line.expect("a line").percent;
            assert!((found / theory - 1.0).abs() < 0.1, "{cycles}: {found} against {theory}");
        }
    }

    properties! {
        #[test]
        fn brighter_or_begun_elsewhere_the_light_flickers_as_much(
            light in prop::collection::vec(0.0..1.0_f64, 1..40), begin in 0usize..40, times in 0.1..1e6_f64,
        ) {
            let mut other: Vec<f64> = light.iter().map(|light| times * light).collect();
            other.rotate_left(begin % light.len());
            let [one, other] = [Spectrum::of(&light), Spectrum::of(&other)];
            for (one, other) in one.percents.iter().zip(&other.percents) {
                prop_assert!((one - other).abs() < 1e-5);
            }
        }
    }
}
