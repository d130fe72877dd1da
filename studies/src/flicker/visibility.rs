//! The visibility of a modulated light.

use std::fmt;

use super::Spectrum;

/// The range of the flicker fusion frequency ("Most humans are unable to perceive flicker in light above 60-90 Hz", Lehman et al.,
/// Proposing measures of flicker in the low frequencies for lighting applications, 2011).
const FUSION_HZ: [f64; 2] = [60.0, 90.0];
/// The threshold at the frequency of greatest sensitivity, about 10 Hz (De Lange, J. Opt. Soc. Am. 48, 777, 1958), %.
const NOTICED_PERCENT: f64 = 1.0;
/// The general limit below 90 Hz (IEEE Std 1789-2015, recommended practice 3), %.
const STRONG_PERCENT: f64 = 5.0;

/// The visibility of a light's flicker to a steady eye. Moving eyes see more: flickering LEDs become rows of dots, at several times these
/// frequencies (Davis et al., Sci. Rep. 5, 7861, 2015).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// Less than 1 % below 60 Hz and less than 5 % below 90 Hz.
    Steady,
    /// 5 % or more from 60 to 90 Hz, which some people see.
    FlickersForSome,
    /// 1 to 5 % below 60 Hz, which people may notice.
    Shimmers,
    /// 5 % or more below 60 Hz.
    Flickers,
}

impl Visibility {
    /// The visibility at a symbol rate in Hz.
    ///
    /// ```
    /// use studies::flicker::{Visibility, Spectrum};
    /// let square = Spectrum::of(&[1.0, 0.0]);
    /// assert_eq!(Visibility::of(&square, 100.0), Visibility::Flickers);
    /// assert_eq!(Visibility::of(&square, 150.0), Visibility::FlickersForSome);
    /// assert_eq!(Visibility::of(&square, 200.0), Visibility::Steady);
    /// ```
    pub fn of(light: &Spectrum, rate_hz: f64) -> Self {
        let [some_hz, all_hz] = [FUSION_HZ[1], FUSION_HZ[0]];
        let strongest = |from_hz, to_hz| {
            let strongest = light.strongest(rate_hz, from_hz, to_hz);
            strongest.map_or(0.0, |line| line.percent)
        };
        match (strongest(0.0, all_hz), strongest(all_hz, some_hz)) {
            (all, _) if all >= STRONG_PERCENT => Self::Flickers,
            (all, _) if all >= NOTICED_PERCENT => Self::Shimmers,
            (_, some) if some >= STRONG_PERCENT => Self::FlickersForSome,
            _ => Self::Steady,
        }
    }
}

impl fmt::Display for Visibility {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Steady => "steady",
            Self::FlickersForSome => "flickers for some",
            Self::Shimmers => "shimmers",
            Self::Flickers => "flickers",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_much_is_seen_goes_by_modulation_and_frequency() {
        let of = |percent: f64, hz| {
            // The fundamental of a square wave has 4/π of its amplitude.
            let swing = percent / 100.0 * std::f64::consts::PI / 4.0;
            Visibility::of(&Spectrum::of(&[1.0 + swing, 1.0 - swing]), 2.0 * hz)
        };
        assert_eq!(of(0.9, 10.0), Visibility::Steady);
        assert_eq!(of(1.1, 10.0), Visibility::Shimmers);
        assert_eq!(of(6.0, 10.0), Visibility::Flickers);
        assert_eq!(of(6.0, 70.0), Visibility::FlickersForSome);
        assert_eq!(of(4.0, 70.0), Visibility::Steady);
        assert_eq!(of(100.0, 91.0), Visibility::Steady);
    }
}
