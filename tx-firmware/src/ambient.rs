//! The ambient illuminance E from a sensor's readings.
//!
//! Light is smoothed on a logarithmic scale, like that of eyes and exposure controls. The filter is of first order,
//!
//! ```text
//! y ← y + (1 − exp(−T/τ))·(log₂(reading) − y),      E = 2^y
//! ```
//!
//! with the sample period T and a time constant τ that depends on the reading:
//!
//! | reading relative to y | τ of [`Smoothing`] | why |
//! |---|---|---|
//! | below by more than [`BAND_OCTAVES`] | `darker_ms`, short | under a bridge the panel's ratio to the light jumps: it must dim before it flares |
//! | above by more than [`BAND_OCTAVES`] | `brighter_ms`, longer | too dim for a while does no harm, and headlamps pass |
//! | within it | `still_ms`, long | it suppresses the rest of a lamp's 100 or 120 Hz after the sensor's integration |
//!
//! **Hysteresis**: once outside the band, y moves at the quicker pace until it is within [`SETTLED_OCTAVES`] of the readings or passes
//! them, so that it does not stop at the band's edge. A step of the light from E₀ to E₁ gives, n readings later, E =
//! E₁·(E₀/E₁)^exp(−n·T/τ), until it has settled: 63 % of the octaves between the two after τ, 95 % after 3 τ, and no overshoot. The first
//! reading applies unfiltered, so that a panel does not fade in for seconds after power-up.
//!
//! **Flicker**: a sensor that integrates for t sees a lamp with 100 % flicker at f as a ripple of at most 1/(π·f·t): 3.5 % for 100 Hz and
//! 90 ms, 0.1 octaves from trough to crest, within the band.
//!
//! E always stays in [`DARKEST_LX`] to [`BRIGHTEST_LX`]: zero and negative readings count as the darkest.
//! [`light_watch`](crate::light_watch) handles missing readings.

use fixed::types::{I6F26, I32F32, U12F20, U32F32};
use link::l2a_table::{Illuminance, log2};

use crate::power::exp2;

/// The least illuminance above darkness, lx: a moonless clear night, and the resolution of common sensors.
pub const DARKEST_LX: Illuminance = Illuminance::lit("0.01");

/// The greatest illuminance, lx: direct sun at the zenith, with a clear sky around it.
pub const BRIGHTEST_LX: Illuminance = Illuminance::lit("130000");

/// The greatest distance between a reading and the smoothed light that counts as the same light, in octaves: 9 %.
pub const BAND_OCTAVES: I6F26 = I6F26::lit("0.125");

/// The distance to the readings at which the quicker pace ends, in octaves: 1.1 %.
pub const SETTLED_OCTAVES: I6F26 = I6F26::lit("0.015625");

/// Bound of the filter's error against the formula of the [module](self), in octaves, for T/τ of
/// 1/1000 and more; the result is then rounded to the nearest of [`Illuminance`]'s steps, 1/4096
/// lx.
///
/// A test checks it: `cargo test -p vocc-tx-firmware ambient`.
pub const FILTER_ERROR_OCTAVES: f64 = 2e-5;

/// The smoothing of readings: times in milliseconds, 1 to 65 535. A sample period of 0 counts as 1; a time constant of 0 disables the
/// smoothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothing {
    /// The time between readings, T.
    pub sample_period_ms: u16,
    /// The time constant τ for falling light: after it, 63 % of a step's octaves are done.
    pub darker_ms: u16,
    /// The same for rising light.
    pub brighter_ms: u16,
    /// The same for light within [`BAND_OCTAVES`].
    pub still_ms: u16,
}

impl Default for Smoothing {
    /// A reading every 100 ms. Into the dark of a bridge, from 50 000 to 500 lx, the panel is within a factor of
    /// 2 after 0.2 s; out of it, after 2 s.
    fn default() -> Self {
        Self {
            sample_period_ms: 100,
            darker_ms: 100,
            brighter_ms: 1_000,
            still_ms: 10_000,
        }
    }
}

impl Smoothing {
    /// 1 − exp(−T/τ): the filter's gain per reading.
    fn share(self, time_constant_ms: u16) -> I6F26 {
        let period = U32F32::from_num(self.sample_period_ms.max(1));
        match period.checked_div_int(time_constant_ms.into()) {
            Some(ratio) => {
                let octaves = I6F26::saturating_from_num(ratio * U32F32::LOG2_E);
                I6F26::ONE - I6F26::from_num(exp2(-octaves))
            }
            None => I6F26::ONE,
        }
    }
}

/// The direction of the light's change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pace {
    Darker,
    Brighter,
    Still,
}

/// The smoothed ambient illuminance.
///
/// ```
/// use fixed::types::{I32F32, U12F20};
/// use tx_firmware::ambient::{Ambient, Smoothing};
///
/// let gain = U12F20::lit("2.5"); // behind a window that lets 40 % through
/// let mut ambient = Ambient::new(gain, Smoothing::default());
/// assert_eq!(ambient.illuminance_lx(), None);
/// let illuminance_lx = ambient.sense(I32F32::from_num(400));
/// assert!(illuminance_lx.abs_diff(1000u16.into()) < 0.001);
/// ```
#[derive(Clone, Debug)]
pub struct Ambient {
    sensor_gain: U12F20,
    /// The filter's gain at each [`Pace`].
    shares: [I6F26; 3],
    pace: Pace,
    log2_lx: Option<I6F26>,
}

impl Ambient {
    /// A filter before its first reading, for a sensor whose readings times `sensor_gain` are lux.
    pub fn new(sensor_gain: U12F20, smoothing: Smoothing) -> Self {
        let Smoothing {
            darker_ms,
            brighter_ms,
            still_ms,
            ..
        } = smoothing;
        Self {
            sensor_gain,
            shares: [darker_ms, brighter_ms, still_ms].map(|time| smoothing.share(time)),
            pace: Pace::Still,
            log2_lx: None,
        }
    }

    /// Takes a reading, in lux before the sensor's gain, and returns the illuminance E, lx.
    pub fn sense(&mut self, reading_lx: I32F32) -> Illuminance {
        let reading_lx = U32F32::saturating_from_num(reading_lx);
        self.smooth(nearest(reading_lx.saturating_mul(self.sensor_gain.into())))
    }

    /// Smooths a reading of [`BRIGHTEST_LX`], for light beyond the sensor, and returns the illuminance E, lx.
    pub fn sense_daylight(&mut self) -> Illuminance {
        self.smooth(BRIGHTEST_LX)
    }

    /// Reduces E to at most `most_lx`, once; before the first reading, sets it to that.
    pub fn fall_back(&mut self, most_lx: Illuminance) {
        let most = log2(most_lx.clamp(DARKEST_LX, BRIGHTEST_LX));
        self.log2_lx = Some(self.log2_lx.map_or(most, |y| y.min(most)));
    }

    /// Sets the sensor's gain for later readings.
    pub fn set_sensor_gain(&mut self, sensor_gain: U12F20) {
        self.sensor_gain = sensor_gain;
    }

    /// The illuminance E, lx: from [`DARKEST_LX`] to [`BRIGHTEST_LX`]; `None` before the first reading.
    pub fn illuminance_lx(&self) -> Option<Illuminance> {
        self.log2_lx.map(illuminance_lx)
    }

    fn smooth(&mut self, lx: Illuminance) -> Illuminance {
        let target = log2(lx.clamp(DARKEST_LX, BRIGHTEST_LX));
        let smoothed = match self.log2_lx {
            Some(y) => {
                let distance = target - y;
                self.pace = self.pace.after(distance);
                y + distance * self.shares[self.pace as usize]
            }
            None => target,
        };
        self.log2_lx = Some(smoothed);
        illuminance_lx(smoothed)
    }
}

impl Pace {
    /// The pace for the `distance` to a reading, in octaves.
    fn after(self, distance: I6F26) -> Self {
        let way = if distance < 0 { Self::Darker } else { Self::Brighter };
        if distance.abs() > BAND_OCTAVES || (self == way && distance.abs() > SETTLED_OCTAVES) {
            way
        } else {
            Self::Still
        }
    }
}

fn illuminance_lx(log2_lx: I6F26) -> Illuminance {
    nearest(exp2(log2_lx)).clamp(DARKEST_LX, BRIGHTEST_LX)
}

/// The nearest step of the type, clamped to its range.
fn nearest(lx: U32F32) -> Illuminance {
    const HALF_STEP: U32F32 = U32F32::from_bits(1 << 19);
    Illuminance::saturating_from_num(lx.saturating_add(HALF_STEP))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use properties::prelude::*;

    const GAIN: U12F20 = U12F20::ONE;

    /// The same time constant for any change of the light.
    fn even(sample_period_ms: u16, time_constant_ms: u16) -> Smoothing {
        Smoothing {
            sample_period_ms,
            darker_ms: time_constant_ms,
            brighter_ms: time_constant_ms,
            still_ms: time_constant_ms,
        }
    }

    fn settled_at(lx: impl Into<I32F32>, smoothing: Smoothing) -> Ambient {
        let mut ambient = Ambient::new(GAIN, smoothing);
        ambient.sense(lx.into());
        ambient
    }

    fn octaves_between(one: Illuminance, other: Illuminance) -> f64 {
        (one.to_num::<f64>() / other.to_num::<f64>()).log2().abs()
    }

    /// Uniform in the logarithm from darkness to sun.
    fn any_light() -> impl Strategy<Value = Illuminance> {
        (0.0102f64.log2()..130_000f64.log2()).prop_map(|octave| Illuminance::from_num(octave.exp2()))
    }

    properties! {
        #[test]
        fn a_step_is_answered_by_the_stated_response(
            from in any_light(), to in any_light(), readings in 1u32..40,
            sample_period_ms in 10u16..1000, time_constant_ms in 100u16..10_000,
        ) {
            let mut ambient = settled_at(from, even(sample_period_ms, time_constant_ms));
            for _ in 0..readings {
                ambient.sense(to.into());
            }
            let time_constants = f64::from(readings) * f64::from(sample_period_ms) / f64::from(time_constant_ms);
            let (from_lx, to_lx): (f64, f64) = (from.to_num(), to.to_num());
            let expected_lx = to_lx * (from_lx / to_lx).powf((-time_constants).exp());
            let error_lx = ambient.illuminance_lx().unwrap().to_num::<f64>() - expected_lx;
            let bound_lx = expected_lx * (FILTER_ERROR_OCTAVES.exp2() - 1.0) + 0.5 / 4096.0;
            prop_assert!(error_lx.abs() <= bound_lx, "{error_lx} lx off {expected_lx} after {time_constants} time constants");
        }

        #[test]
        fn any_readings_give_an_illuminance_in_range(
            readings in prop::collection::vec(any::<Option<i64>>(), 0..60), gain in any::<u32>(),
            sample_period_ms in any::<u16>(), darker_ms in any::<u16>(), brighter_ms in any::<u16>(), still_ms in any::<u16>(),
        ) {
            let smoothing = Smoothing { sample_period_ms, darker_ms, brighter_ms, still_ms };
            let mut ambient = Ambient::new(U12F20::from_bits(gain), smoothing);
            for reading in readings {
                let lx = match reading {
                    Some(bits) => ambient.sense(I32F32::from_bits(bits)),
                    None => ambient.sense_daylight(),
                };
                prop_assert!((DARKEST_LX..=BRIGHTEST_LX).contains(&lx));
            }
        }

        #[test]
        fn the_gain_multiplies_the_reading(reading in 1u16..1000, gain in 0.01f64..100.0) {
            let gain = U12F20::from_num(gain);
            let lx = Ambient::new(gain, Smoothing::default()).sense(reading.into()).to_num::<f64>();
            let expected_lx = (f64::from(reading) * gain.to_num::<f64>()).max(DARKEST_LX.to_num());
            prop_assert!((lx - expected_lx).abs() <= 1.0 / 4096.0 + expected_lx * 1e-7);
        }
    }

    #[test]
    fn zero_and_negative_readings_are_darkness_and_leave_no_trace_below_it() {
        let dark = settled_at(DARKEST_LX, Smoothing::default());
        for reading in [I32F32::ZERO, I32F32::MIN, I32F32::from_num(-3)] {
            let mut ambient = settled_at(reading, Smoothing::default());
            assert_eq!(ambient.illuminance_lx(), Some(DARKEST_LX));
            assert_eq!(ambient.sense(I32F32::ONE), dark.clone().sense(I32F32::ONE));
        }
    }

    #[test]
    fn without_a_time_constant_every_reading_is_taken_at_once() {
        assert_eq!(settled_at(20_000u16, even(100, 0)).sense(I32F32::ONE), Illuminance::ONE);
    }

    #[test]
    fn under_a_bridge_light_is_within_a_factor_of_2_in_0_2_s_and_beyond_it_in_2_s() {
        let mut ambient = settled_at(50_000u16, Smoothing::default());
        let dark = Illuminance::from_num(500);
        let into = (1..).find(|_| octaves_between(ambient.sense(dark.into()), dark) < 1.0);
        assert_eq!(into, Some(2));
        for _ in 0..30 {
            ambient.sense(dark.into());
        }
        let light = Illuminance::from_num(50_000);
        let out_of = (1..).find(|_| octaves_between(ambient.sense(light.into()), light) < 1.0);
        assert_eq!(out_of, Some(19));
    }

    #[test]
    fn a_step_is_made_up_to_less_than_the_band() {
        for (from, to) in [(1000u16, 1200u16), (1200, 1000), (50, 60_000), (60_000, 50)] {
            let mut ambient = settled_at(from, Smoothing::default());
            for _ in 0..80 {
                ambient.sense(to.into());
            }
            let left = octaves_between(ambient.illuminance_lx().unwrap(), to.into());
            assert!(left < SETTLED_OCTAVES.to_num::<f64>(), "{left} octaves from {to} lx");
        }
    }

    /// The reading of a sensor that integrates for `integration_s` under a lamp with 100 % flicker at `lamp_hz`.
    fn flickering(mean_lx: f64, lamp_hz: f64, integration_s: f64, start_s: f64) -> I32F32 {
        let phase = |at_s: f64| core::f64::consts::TAU * lamp_hz * at_s;
        let swing = (phase(start_s).cos() - phase(start_s + integration_s).cos()) / (core::f64::consts::TAU * lamp_hz * integration_s);
        I32F32::from_num(mean_lx * (1.0 + swing))
    }

    properties! {
        #[test]
        fn the_flicker_of_a_street_lamp_does_not_show(
            lamp_hz in prop::sample::select(&[100.0f64, 120.0][..]), integration_s in 0.09f64..0.11,
            clock in 0.99f64..1.01, start_s in 0.0f64..1.0, mean_lx in 5.0f64..200.0,
        ) {
            let mut ambient = Ambient::new(GAIN, Smoothing::default());
            let readings = (0..600).map(|n| {
                let at_s = start_s + f64::from(n) * 0.1 * clock;
                ambient.sense(flickering(mean_lx, lamp_hz, integration_s, at_s))
            });
            let smoothed: std::vec::Vec<f64> = readings.map(|lx| lx.to_num::<f64>().log2()).collect();
            for pair in smoothed[1..].windows(2) {
                // The band's width and `still_ms` allow at most 0.15 % between readings.
                prop_assert!((pair[1] - pair[0]).abs() < 0.125 * 0.01 + 0.001 / mean_lx, "{pair:?}");
            }
            for octave in smoothed {
                prop_assert!((octave - mean_lx.log2()).abs() < 0.06);
            }
        }
    }
}
