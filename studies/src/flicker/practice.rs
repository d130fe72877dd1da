//! The recommended practices of IEEE Std 1789-2015, 8.1.1, "Simple recommended practices".

use std::fmt;

use super::Spectrum;
use super::spectrum::TO_BAND_END;

/// The frequency below which modulation is limited more, Hz.
const SEEN_BELOW_HZ: f64 = 90.0;

/// A recommended practice: the limit of modulation at a frequency.
///
/// | practice | below 90 Hz | from 90 Hz on | above |
/// |---|---|---|---|
/// | [`LowRisk`](Self::LowRisk) (1) | 0.025·f % | 0.08·f % | 1250 Hz: no limit |
/// | [`NoEffect`](Self::NoEffect) (2) | 0.01·f % | 0.0333·f % | 3000 Hz: no limit |
/// | [`NoSeizures`](Self::NoSeizures) (3) | 5 % | no limit | |
///
/// The standard applies them to the light source as a whole, not to single LEDs in it (comment 3). The first two are for those who wish
/// to limit effects, the third is for all lights at all times (comment 2).
///
/// ```
/// use studies::flicker::Practice;
/// assert_eq!(Practice::LowRisk.limit_percent(50.0), 1.25);
/// assert_eq!(Practice::LowRisk.limit_percent(100.0), 8.0);
/// // A light with full modulation needs a frequency of 1250 Hz.
/// assert_eq!(Practice::LowRisk.lowest_hz(100.0), 1250.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Practice {
    /// Recommended practice 1: low risk of effects.
    LowRisk,
    /// Recommended practice 2: no effect has been observed.
    NoEffect,
    /// Recommended practice 3: no seizures.
    NoSeizures,
}

/// The frequency at which a light is nearest to a limit, or farthest beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstModulation {
    /// The frequency, Hz.
    pub hz: f64,
    /// The modulation there, %.
    pub percent: f64,
    /// The practice's limit there, %.
    pub limit_percent: f64,
}

impl WorstModulation {
    /// The modulation over its limit: above 1, the practice is violated.
    pub fn times_limit(&self) -> f64 {
        self.percent / self.limit_percent
    }
}

impl Practice {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::LowRisk, Self::NoEffect, Self::NoSeizures];

    /// Percent per hertz below 90 Hz and from there on, and the frequency above which there is no limit; `None` for a limit that is
    /// constant below 90 Hz.
    fn slopes(self) -> Option<([f64; 2], f64)> {
        match self {
            Self::LowRisk => Some(([0.025, 0.08], 1250.0)),
            Self::NoEffect => Some(([0.01, 0.1 / 3.0], 3000.0)),
            Self::NoSeizures => None,
        }
    }

    /// The greatest allowed modulation at a frequency in Hz, %; infinite without a limit.
    pub fn limit_percent(self, hz: f64) -> f64 {
        match self.slopes() {
            None if hz < SEEN_BELOW_HZ => 5.0,
            Some((_, unlimited_hz)) if hz > unlimited_hz => f64::INFINITY,
            Some(([low, _], _)) if hz < SEEN_BELOW_HZ => low * hz,
            Some(([_, high], _)) => high * hz,
            None => f64::INFINITY,
        }
    }

    /// The frequency from which on it allows a modulation in %; Hz.
    pub fn lowest_hz(self, percent: f64) -> f64 {
        match self.slopes() {
            None if percent < 5.0 => 0.0,
            None => SEEN_BELOW_HZ,
            Some(([low, _], _)) if percent < low * SEEN_BELOW_HZ => percent / low,
            Some(([_, high], unlimited_hz)) => (percent / high).clamp(SEEN_BELOW_HZ, unlimited_hz),
        }
    }

    /// The lowest frequency in Hz of a square carrier whose third of an octave reaches no frequency that limits a modulation of 100 %.
    ///
    /// ```
    /// use studies::flicker::Practice;
    /// assert_eq!(Practice::LowRisk.lowest_carrier_hz().round(), 1403.0);
    /// ```
    pub fn lowest_carrier_hz(self) -> f64 {
        self.lowest_hz(100.0) * TO_BAND_END
    }

    /// The worst modulation of a light at a symbol rate in Hz; `None` if no line is limited.
    pub fn worst(self, light: &Spectrum, rate_hz: f64) -> Option<WorstModulation> {
        let lines = light.lines().map(|line| {
            let hz = line.cycles * rate_hz;
            let (percent, limit_percent) = (line.percent, self.limit_percent(hz));
            WorstModulation {
                hz,
                percent,
                limit_percent,
            }
        });
        lines
            .filter(|worst| worst.limit_percent.is_finite())
            .max_by(|one, other| one.times_limit().total_cmp(&other.times_limit()))
    }

    /// The greatest modulation of a light over its limit, at a symbol rate in Hz: up to 1, it complies. 0 if no line is limited.
    pub fn times(self, light: &Spectrum, rate_hz: f64) -> f64 {
        self.worst(light, rate_hz).map_or(0.0, |worst| worst.times_limit())
    }

    /// The symbol rate from which on a light complies, Hz; 0 for a steady light.
    ///
    /// Limits grow with the frequency, so a light that complies at one rate complies at every higher rate.
    pub fn lowest_rate_hz(self, light: &Spectrum) -> f64 {
        light
            .lines()
            .map(|line| self.lowest_hz(line.percent) / line.cycles)
            .fold(0.0, f64::max)
    }
}

impl fmt::Display for Practice {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::LowRisk => "low risk",
            Self::NoEffect => "no effect",
            Self::NoSeizures => "no seizures",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    #[test]
    fn the_limits_are_those_of_the_standard() {
        let limits = |hz| Practice::ALL.map(|practice| practice.limit_percent(hz));
        assert_eq!(limits(8.0), [0.2, 0.08, 5.0]);
        assert_eq!(limits(90.0), [7.2, 3.0, f64::INFINITY]);
        assert_eq!(limits(1250.0)[0], 100.0);
        assert_eq!(limits(3000.0)[..2], [f64::INFINITY, 100.0]);
        assert_eq!(limits(3001.0), [f64::INFINITY; 3]);
    }

    #[test]
    fn a_square_wave_needs_twice_the_frequency_from_which_on_nothing_is_limited() {
        let square = Spectrum::of(&[1.0, 0.0]);
        let rates = Practice::ALL.map(|practice| practice.lowest_rate_hz(&square));
        assert!((rates[0] - 2500.0).abs() < 1e-9 && (rates[1] - 6000.0).abs() < 1e-9);
        assert_eq!(rates[2], 180.0);
        let worst = Practice::LowRisk.worst(&square, 90.0).expect("a limit");
        assert_eq!((worst.hz, worst.percent), (45.0, 100.0));
        assert!((worst.times_limit() - 100.0 / 1.125).abs() < 1e-9);
        assert_eq!(Practice::LowRisk.worst(&square, 9000.0), None);
    }

    #[test]
    fn a_steady_light_keeps_to_all_at_any_rate() {
        let steady = Spectrum::of(&[1.0; 4]);
        for practice in Practice::ALL {
            assert_eq!(practice.lowest_rate_hz(&steady), 0.0);
            assert_eq!(practice.worst(&steady, 9.0), None);
        }
    }

    properties! {
        #[test]
        fn a_light_keeps_to_a_practice_from_its_lowest_rate_on_and_not_below(
            light in prop::collection::vec(0.0..1.0_f64, 2..20), practice in prop::sample::select(&Practice::ALL[..]),
        ) {
            let spectrum = Spectrum::of(&light);
            let lowest_hz = practice.lowest_rate_hz(&spectrum);
            let times = |rate_hz| practice.worst(&spectrum, rate_hz).map_or(0.0, |worst| worst.times_limit());
            prop_assert!(times(1.0001 * lowest_hz) <= 1.0);
            prop_assert!(lowest_hz == 0.0 || times(0.9999 * lowest_hz) >= 1.0);
        }
    }
}
