//! A sensor's readings → the ambient illuminance E.
//!
//! Light is smoothed on a logarithmic scale, as eyes and exposure controls see it: going from 10
//! 000 lx into a tunnel of 100 lx then takes as long as coming out. The filter is of first order,
//!
//! ```text
//! y ← y + (1 − exp(−T/τ))·(log₂(reading) − y),      E = 2^y
//! ```
//!
//! with the sample period T and the time constant τ of [`Smoothing`]. After a step of the light
//! from E₀ to E₁ it has, n readings later, E = E₁·(E₀/E₁)^exp(−n·T/τ): 63 % of the octaves between
//! the two after τ, 95 % after 3 τ, and no overshoot. The first reading is taken as it is, so that
//! a panel does not fade in for seconds after power-up.
//!
//! Sensors saturate, return nonsense and fall off the bus. Whatever the reading, E stays in
//! [`DARKEST_LX`] to [`BRIGHTEST_LX`]: zero and negative readings count as the darkest. A reading
//! that did not come ([`Ambient::miss`]) leaves E as it is at first; after [`MISSES_HELD`] in a
//! row, every further one counts as the darkest too. So a panel whose sensor is gone dims itself
//! instead of carrying the noon into the night.

use fixed::types::{I6F26, I32F32, U12F20, U32F32};
use link::l2a_table::{Illuminance, log2};

use crate::power::exp2;

/// The least illuminance told apart from darkness, lx: a moonless clear night, and the least that
/// common sensors resolve.
pub const DARKEST_LX: Illuminance = Illuminance::lit("0.01");

/// The greatest illuminance, lx: direct sun at the zenith, with a clear sky around it.
pub const BRIGHTEST_LX: Illuminance = Illuminance::lit("130000");

/// How many readings in a row may be missing before the light counts as gone.
pub const MISSES_HELD: u16 = 20;

/// Bound of the filter's error against the formula of the [module](self), in octaves, for T/τ of
/// 1/1000 and more; the result is then rounded to the nearest of [`Illuminance`]'s steps, 1/4096
/// lx.
///
/// A test holds it: `cargo test -p tx-firmware ambient`.
pub const FILTER_ERROR_OCTAVES: f64 = 2e-5;

/// How much the readings are smoothed: times in milliseconds, 1 to 65 535. A sample period of 0
/// counts as 1; a time constant of 0 switches the smoothing off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothing {
    /// The time from one reading to the next, T.
    pub sample_period_ms: u16,
    /// The time in which 63 % of a step's octaves are made up, τ.
    pub time_constant_ms: u16,
}

impl Default for Smoothing {
    /// A reading every 100 ms, a time constant of 1 s: slower than the shadows of trees and passing
    /// headlamps, quick enough to follow into a tunnel within about four seconds.
    fn default() -> Self {
        Self {
            sample_period_ms: 100,
            time_constant_ms: 1000,
        }
    }
}

impl Smoothing {
    /// 1 − exp(−T/τ): the share of the distance to a new reading that is gone at once.
    fn share(self) -> I6F26 {
        let period = U32F32::from_num(self.sample_period_ms.max(1));
        match period.checked_div_int(self.time_constant_ms.into()) {
            Some(ratio) => {
                let octaves = I6F26::saturating_from_num(ratio * U32F32::LOG2_E);
                I6F26::ONE - I6F26::from_num(exp2(-octaves))
            }
            None => I6F26::ONE,
        }
    }
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
    share: I6F26,
    log2_lx: Option<I6F26>,
    misses: u16,
}

impl Ambient {
    /// A filter that has seen no light yet, for a sensor whose readings times `sensor_gain` are
    /// lux.
    pub fn new(sensor_gain: U12F20, smoothing: Smoothing) -> Self {
        Self {
            sensor_gain,
            share: smoothing.share(),
            log2_lx: None,
            misses: 0,
        }
    }

    /// Takes a reading, in lux before the sensor's gain, and returns the illuminance E, lx.
    pub fn sense(&mut self, reading_lx: I32F32) -> Illuminance {
        self.misses = 0;
        let reading_lx = U32F32::saturating_from_num(reading_lx);
        self.smooth(nearest(reading_lx.saturating_mul(self.sensor_gain.into())))
    }

    /// Notes that a reading did not come, and returns the illuminance E, lx, if there ever was one.
    pub fn miss(&mut self) -> Option<Illuminance> {
        self.misses = self.misses.saturating_add(1);
        if self.misses > MISSES_HELD && self.log2_lx.is_some() {
            self.smooth(DARKEST_LX);
        }
        self.illuminance_lx()
    }

    /// The illuminance E, lx: from [`DARKEST_LX`] to [`BRIGHTEST_LX`]; none before the first
    /// reading.
    pub fn illuminance_lx(&self) -> Option<Illuminance> {
        self.log2_lx.map(illuminance_lx)
    }

    fn smooth(&mut self, lx: Illuminance) -> Illuminance {
        let target = log2(lx.clamp(DARKEST_LX, BRIGHTEST_LX));
        let smoothed = self
            .log2_lx
            .map_or(target, |y| y + (target - y) * self.share);
        self.log2_lx = Some(smoothed);
        illuminance_lx(smoothed)
    }
}

fn illuminance_lx(log2_lx: I6F26) -> Illuminance {
    nearest(exp2(log2_lx)).clamp(DARKEST_LX, BRIGHTEST_LX)
}

/// To the nearest step of the type, or its end.
fn nearest(lx: U32F32) -> Illuminance {
    const HALF_STEP: U32F32 = U32F32::from_bits(1 << 19);
    Illuminance::saturating_from_num(lx.saturating_add(HALF_STEP))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GAIN: U12F20 = U12F20::ONE;

    fn settled_at(lx: impl Into<I32F32>, smoothing: Smoothing) -> Ambient {
        let mut ambient = Ambient::new(GAIN, smoothing);
        ambient.sense(lx.into());
        ambient
    }

    /// As likely in the dark as in the sun.
    fn any_light() -> impl Strategy<Value = Illuminance> {
        (0.0102f64.log2()..130_000f64.log2())
            .prop_map(|octave| Illuminance::from_num(octave.exp2()))
    }

    proptest! {
        #[test]
        fn a_step_is_answered_by_the_stated_response(
            from in any_light(), to in any_light(), readings in 1u32..40,
            sample_period_ms in 10u16..1000, time_constant_ms in 100u16..10_000,
        ) {
            let mut ambient = settled_at(from, Smoothing { sample_period_ms, time_constant_ms });
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
            sample_period_ms in any::<u16>(), time_constant_ms in any::<u16>(),
        ) {
            let mut ambient = Ambient::new(U12F20::from_bits(gain), Smoothing { sample_period_ms, time_constant_ms });
            for reading in readings {
                let lx = match reading {
                    Some(bits) => Some(ambient.sense(I32F32::from_bits(bits))),
                    None => ambient.miss(),
                };
                prop_assert!(lx.is_none_or(|lx| (DARKEST_LX..=BRIGHTEST_LX).contains(&lx)));
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
        let smoothing = Smoothing {
            sample_period_ms: 100,
            time_constant_ms: 0,
        };
        assert_eq!(
            settled_at(20_000u16, smoothing).sense(I32F32::ONE),
            Illuminance::ONE
        );
    }

    #[test]
    fn a_few_missing_readings_are_bridged_and_more_bring_the_night() {
        let mut ambient = settled_at(20_000u16, Smoothing::default());
        let noon = ambient.illuminance_lx();
        for _ in 0..MISSES_HELD {
            assert_eq!(ambient.miss(), noon);
        }
        assert!(ambient.miss() < noon);
        for _ in 0..200 {
            ambient.miss();
        }
        assert_eq!(ambient.illuminance_lx(), Some(DARKEST_LX));
    }

    #[test]
    fn a_reading_ends_a_run_of_missing_ones() {
        let mut ambient = settled_at(20_000u16, Smoothing::default());
        for _ in 0..5 {
            for _ in 0..MISSES_HELD {
                ambient.miss();
            }
            assert!(
                ambient
                    .sense(I32F32::from_num(20_000))
                    .abs_diff(20_000u16.into())
                    < 0.01
            );
        }
    }

    #[test]
    fn a_sensor_that_never_answered_gives_no_illuminance() {
        let mut ambient = Ambient::new(GAIN, Smoothing::default());
        for _ in 0..100 {
            assert_eq!(ambient.miss(), None);
        }
    }
}
