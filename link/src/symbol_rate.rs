//! Symbol rates: the range of transmitters, and the share of a camera's frame rate.

use core::fmt;
use core::ops::RangeInclusive;

use thiserror::Error;

/// The rate of a transmitter's symbols, in steps of 1/1000 a second, from [`MIN`](Self::MIN) to [`MAX`](Self::MAX).
///
/// ```
/// use link::symbol_rate::SymbolRate;
/// assert_eq!(SymbolRate::DEFAULT, SymbolRate::from_hz(90.0)?);
/// assert_eq!(SymbolRate::from_hz(22.5)?.millihertz(), 22_500);
/// let slow = SymbolRate::from_hz(2.0).unwrap_err().to_string();
/// assert!(slow.starts_with("2 symbols a second are outside 9 to 300:"));
/// # Ok::<(), link::symbol_rate::SymbolRateError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SymbolRate {
    millihertz: u32,
}

/// A symbol rate out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{}", Outside(*.millihertz, SymbolRate::MIN.millihertz..=SymbolRate::MAX.millihertz))]
pub struct SymbolRateError {
    /// The requested rate, in thousandths of a symbol a second.
    pub millihertz: u32,
}

impl SymbolRate {
    /// 9 a second: the rate for a camera of 10 frames a second, and the slowest that a 16-bit counter reaches behind a divider by 255 at
    /// 150 MHz.
    pub const MIN: Self = Self { millihertz: 9_000 };
    /// 300 a second: a board can still prepare the panels for the 0.4 s for which a write to flash memory may stop its processor.
    pub const MAX: Self = Self { millihertz: 300_000 };
    /// 90 a second, for a camera of 100 frames a second: the default of a transmitter without a carrier.
    pub const DEFAULT: Self = Self { millihertz: 90_000 };

    /// The symbol rate relative to a camera's frame rate.
    ///
    /// At the frame rate itself the exposures may start within a change of symbols for seconds. A tenth below, the phase has passed through
    /// a whole cycle after ten frames, and every symbol has a whole exposure of its own up to 1/9 of the time between frames. The cost is a
    /// tenth of the rate.
    pub const SHARE_OF_FRAMES: f64 = 0.9;

    /// A rate in thousandths of a symbol a second.
    ///
    /// # Errors
    /// [`SymbolRateError`] outside [`MIN`](Self::MIN) to [`MAX`](Self::MAX).
    pub const fn from_millihertz(millihertz: u32) -> Result<Self, SymbolRateError> {
        if millihertz < Self::MIN.millihertz || millihertz > Self::MAX.millihertz {
            return Err(SymbolRateError { millihertz });
        }
        Ok(Self { millihertz })
    }

    /// A rate in symbols a second, rounded to thousandths.
    ///
    /// # Errors
    /// [`SymbolRateError`] outside [`MIN`](Self::MIN) to [`MAX`](Self::MAX), and for NaN.
    pub fn from_hz(hz: f64) -> Result<Self, SymbolRateError> {
        Self::from_millihertz((hz * 1e3 + 0.5) as u32)
    }

    /// The rate for a camera of `frames_hz` frames a second that exposes for `exposure_s`, s. For a rolling shutter, add the time in which
    /// the panel's lines are read.
    ///
    /// A symbol holds a whole exposure at any phase if it lasts at least the time between frames plus an exposure (`docs/detectors.md`,
    /// "Symbols and clocks"), and no rate exceeds [`SHARE_OF_FRAMES`](Self::SHARE_OF_FRAMES) of the frame rate. Cameras faster than a
    /// transmitter get [`MAX`](Self::MAX).
    ///
    /// ```
    /// use link::symbol_rate::SymbolRate;
    /// for (frames_hz, exposure_s, rate_hz) in [(30.0, 0.001, 27.0), (60.0, 0.001, 54.0), (100.0, 0.001, 90.0), (30.0, 1.0 / 30.0, 15.0)] {
    ///     assert_eq!(SymbolRate::for_camera(frames_hz, exposure_s)?, SymbolRate::from_hz(rate_hz)?);
    /// }
    /// # Ok::<(), link::symbol_rate::SymbolRateError>(())
    /// ```
    ///
    /// # Errors
    /// [`SymbolRateError`] if the camera is too slow for [`MIN`](Self::MIN), or if a value is invalid.
    pub fn for_camera(frames_hz: f64, exposure_s: f64) -> Result<Self, SymbolRateError> {
        let whole_exposures_hz = 1.0 / (1.0 / frames_hz + exposure_s);
        let hz = (Self::SHARE_OF_FRAMES * frames_hz).min(whole_exposures_hz);
        Self::from_hz(hz.min(Self::MAX.hz()))
    }

    /// Thousandths of a symbol a second.
    pub const fn millihertz(self) -> u32 {
        self.millihertz
    }

    /// Symbols a second.
    pub fn hz(self) -> f64 {
        f64::from(self.millihertz) / 1e3
    }
}

impl Default for SymbolRate {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl fmt::Display for SymbolRate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.hz().fmt(formatter)
    }
}

/// The error text for a rate out of its range, in thousandths of a symbol a second.
pub(crate) struct Outside(pub u32, pub RangeInclusive<u32>);

impl fmt::Display for Outside {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(asked, range) = self;
        let [asked, least, most] = [asked, range.start(), range.end()].map(|&rate| f64::from(rate) / 1e3);
        write!(
            formatter,
            "{asked} symbols a second are outside {least} to {most}: give a rate a little below the camera's frames a second"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;
    use std::string::ToString;

    #[test]
    fn the_ends_of_the_range_are_allowed_and_nothing_beyond() {
        for rate in [SymbolRate::MIN, SymbolRate::DEFAULT, SymbolRate::MAX] {
            assert_eq!(SymbolRate::from_millihertz(rate.millihertz()), Ok(rate));
            assert_eq!(SymbolRate::from_hz(rate.hz()), Ok(rate));
        }
        for millihertz in [0, 8_999, 300_001, u32::MAX] {
            assert_eq!(SymbolRate::from_millihertz(millihertz), Err(SymbolRateError { millihertz }));
        }
        for hz in [f64::NAN, -27.0, f64::INFINITY, 0.0] {
            assert!(SymbolRate::from_hz(hz).is_err());
        }
        let error = SymbolRate::from_hz(8.9995).map(|rate| rate.to_string());
        assert_eq!(error, Ok("9".into()));
    }

    properties! {
        #[test]
        fn a_symbol_holds_a_whole_exposure_of_its_camera(frames_hz in 11.0..400.0_f64, share in 0.0..1.0_f64) {
            let exposure_s = share / frames_hz;
            match SymbolRate::for_camera(frames_hz, exposure_s) {
                Ok(rate) => {
                    let rounding_hz = 0.5e-3;
                    prop_assert!(1.0 / (rate.hz() - rounding_hz) >= 1.0 / frames_hz + exposure_s);
                    prop_assert!(rate.hz() <= 0.9 * frames_hz + rounding_hz);
                }
                Err(_) => prop_assert!(1.0 / (1.0 / frames_hz + exposure_s) < SymbolRate::MIN.hz()),
            }
        }
    }
}
