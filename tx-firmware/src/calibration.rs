//! The bench measurements of one transmitter, checked once.

use core::ops::RangeInclusive;

use fixed::types::{U1F31, U12F20, U32F32};
use link::geometry::Geometry;
use link::intensity::IntensityLimit;
use link::l2a_table::Interval;
pub use link::serial::Measured;
use thiserror::Error;

use crate::drive::{EXPOSURE_LONG_NS, period_ns};
use crate::matrix::Duty;

/// The range of a panel's luminance at full duty, cd/m²: an L2A of 4 on a white panel in the brightest sun takes 520 000.
pub const LUMINANCE_CD_M2: RangeInclusive<U32F32> = U32F32::ONE..=U32F32::lit("1000000");
/// The range of the dimming's period, ns: from 10 MHz down to 100 Hz, below which flicker is visible.
pub const PWM_PERIOD_NS: RangeInclusive<u32> = 100..=10_000_000;
/// The range of the reflectance of an LED's surface.
pub const REFLECTANCE: RangeInclusive<U1F31> = U1F31::lit("0.05")..=U1F31::ONE;
/// The range of a panel's LED interval (Do & Yoo 2020, Eq. (17)).
pub const INTERVAL: RangeInclusive<Interval> = Interval::lit("0.5")..=Interval::lit("3");
/// The range of an LED's light at the low current, as a share of its full light.
pub const LOW_CURRENT_SHARE: RangeInclusive<U1F31> = U1F31::lit("0.01")..=U1F31::ONE;
/// The range of a light sensor's gain.
pub const SENSOR_GAIN: RangeInclusive<U12F20> = U12F20::lit("0.01")..=U12F20::lit("1000");

/// The illuminance from which on [`BENCH`]'s panel may have full duty (lx): four times the duty that it needs at the greatest ratio. A
/// panel with less than a quarter of its luminance needs more light, and so a lower value.
pub const BENCH_FULL_DUTY_LX: u32 = 4_000;

/// The bench measurements of the panel of `docs/hardware/road-kit.md`: the default of a board until its own panel is measured.
///
/// One program serves panels with and without a [current switch](SWITCHED), and this is the safe value for both: with a share *s* below 1,
/// a panel without the switch would give 1/*s* of the light that was asked for.
pub const BENCH: Measured = Measured {
    luminance_full_cd_m2: U32F32::lit("26000"),
    shortest_pulse_ns: 100,
    pwm_period_ns: period_ns(EXPOSURE_LONG_NS),
    reflectance: U1F31::lit("0.4"),
    interval: Interval::lit("1"),
    sensor_gain: U12F20::lit("1"),
    low_current_share: U1F31::ONE,
};

/// [`BENCH`] with the current switch of `docs/hardware/road-kit.md`. A register's current is proportional to 1/R, so the low one is
/// R_switched/(R_switched + R_always) of the full one, with 1.1 kΩ and 5.6 kΩ.
pub const SWITCHED: Measured = Measured {
    low_current_share: U1F31::from_bits(((1_100u64 << U1F31::FRAC_NBITS) / (1_100 + 5_600)) as u32),
    ..BENCH
};

/// A measured value out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationError {
    /// The luminance at full duty is outside [`LUMINANCE_CD_M2`].
    #[error(
        "full luminance {0} cd/m² is outside {min} to {max}: \
         measure an On LED at full duty with ambient light shut out",
        min = LUMINANCE_CD_M2.start(),
        max = LUMINANCE_CD_M2.end()
    )]
    LuminanceFull(#[cfg_attr(feature = "defmt", defmt(Display2Format))] U32F32),
    /// The shortest pulse is longer than the PWM period.
    #[error(
        "a shortest pulse of {pulse_ns} ns does not fit into the PWM period, 0 to {period_ns} ns: \
         lower the PWM frequency or use a faster LED driver"
    )]
    ShortestPulse {
        /// The given shortest pulse, ns.
        pulse_ns: u32,
        /// The given PWM period, ns.
        period_ns: u32,
    },
    /// The PWM period is outside [`PWM_PERIOD_NS`].
    #[error(
        "a PWM period of {0} ns is outside {min} to {max} ns: \
         choose one that the shortest exposure holds at least 20 times",
        min = PWM_PERIOD_NS.start(),
        max = PWM_PERIOD_NS.end()
    )]
    PwmPeriod(u32),
    /// The reflectance is outside [`REFLECTANCE`].
    #[error(
        "reflectance {0} is outside {min} to {max}: \
         compare an Off LED with a grey card (0.18) in the same light",
        min = REFLECTANCE.start(),
        max = REFLECTANCE.end()
    )]
    Reflectance(#[cfg_attr(feature = "defmt", defmt(Display2Format))] U1F31),
    /// The LED interval is outside [`INTERVAL`].
    #[error(
        "LED interval {0} is outside {min} to {max}: \
         give the gap between LEDs over their diameter",
        min = INTERVAL.start(),
        max = INTERVAL.end()
    )]
    Interval(#[cfg_attr(feature = "defmt", defmt(Display2Format))] Interval),
    /// The sensor's gain is outside [`SENSOR_GAIN`].
    #[error(
        "sensor gain {0} is outside {min} to {max}: \
         give the lux of a meter beside the panel over the lux that the sensor reads",
        min = SENSOR_GAIN.start(),
        max = SENSOR_GAIN.end()
    )]
    SensorGain(#[cfg_attr(feature = "defmt", defmt(Display2Format))] U12F20),
    /// The light at the low current is outside [`LOW_CURRENT_SHARE`].
    #[error(
        "low-current share {0} is outside {min} to {max}: \
         give an On LED's light at the low current over that at the full one, or 1 where it cannot be switched",
        min = LOW_CURRENT_SHARE.start(),
        max = LOW_CURRENT_SHARE.end()
    )]
    LowCurrentShare(#[cfg_attr(feature = "defmt", defmt(Display2Format))] U1F31),
}

/// Measured values within their ranges.
///
/// ```
/// use fixed::types::{U1F31, U32F32};
/// use tx_firmware::calibration::{BENCH, Calibration, CalibrationError, Measured};
///
/// let measured = Measured {
///     luminance_full_cd_m2: U32F32::lit("8000"),
///     pwm_period_ns: 20_000,
///     ..BENCH
/// };
/// let calibration = Calibration::new(measured)?;
/// assert_eq!(calibration.luminance_floor_cd_m2(), 40);
///
/// let slow_driver = Measured { shortest_pulse_ns: 30_000, ..measured };
/// assert!(matches!(Calibration::new(slow_driver), Err(CalibrationError::ShortestPulse { pulse_ns: 30_000, .. })));
/// # Ok::<(), CalibrationError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    measured: Measured,
    limit: Option<IntensityLimit>,
    most_cd_m2: U32F32,
}

/// The greatest addition to the light by a driver's step: 1/512 of it, as [`drive`](crate::drive) rounds, plus the light of the shortest
/// pulse once, as for the steps of a [`max7219`](crate::max7219).
const STEP_SHIFT: u32 = 9;

impl Calibration {
    /// Checks the measured values.
    ///
    /// # Errors
    /// [`CalibrationError`] for the first value out of its range.
    pub fn new(measured: Measured) -> Result<Self, CalibrationError> {
        let Measured {
            luminance_full_cd_m2,
            shortest_pulse_ns: pulse_ns,
            pwm_period_ns: period_ns,
            reflectance,
            interval,
            sensor_gain,
            low_current_share,
        } = measured;
        if !LUMINANCE_CD_M2.contains(&luminance_full_cd_m2) {
            return Err(CalibrationError::LuminanceFull(luminance_full_cd_m2));
        }
        if !PWM_PERIOD_NS.contains(&period_ns) {
            return Err(CalibrationError::PwmPeriod(period_ns));
        }
        if pulse_ns > period_ns {
            return Err(CalibrationError::ShortestPulse { pulse_ns, period_ns });
        }
        if !REFLECTANCE.contains(&reflectance) {
            return Err(CalibrationError::Reflectance(reflectance));
        }
        if !INTERVAL.contains(&interval) {
            return Err(CalibrationError::Interval(interval));
        }
        if !SENSOR_GAIN.contains(&sensor_gain) {
            return Err(CalibrationError::SensorGain(sensor_gain));
        }
        if !LOW_CURRENT_SHARE.contains(&low_current_share) {
            return Err(CalibrationError::LowCurrentShare(low_current_share));
        }
        Ok(Self {
            measured,
            limit: None,
            most_cd_m2: luminance_full_cd_m2,
        })
    }

    /// The same panel with a limit of its luminous intensity, or without one.
    ///
    /// ```
    /// use link::intensity::IntensityLimit;
    /// use tx_firmware::calibration::{BENCH, Calibration};
    ///
    /// let limit = IntensityLimit::from_cd(Some(100.0), 0.03)?;
    /// let limited = Calibration::new(BENCH)?.limited_to(Some(limit));
    /// assert!(Some(limited.luminance_most_cd_m2()) < limit.luminance_cd_m2());
    /// assert_eq!(limited.limited_to(None), Calibration::new(BENCH)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn limited_to(self, limit: Option<IntensityLimit>) -> Self {
        let full_cd_m2 = self.measured.luminance_full_cd_m2;
        let at_limit = limit.and_then(IntensityLimit::luminance_cd_m2);
        let most_cd_m2 = at_limit.map_or(full_cd_m2, |at_limit| {
            let below_step = at_limit - (at_limit >> STEP_SHIFT);
            let most_cd_m2 = below_step.saturating_sub(self.luminance_floor_cd_m2());
            most_cd_m2.min(full_cd_m2)
        });
        Self { limit, most_cd_m2, ..self }
    }

    /// The same panel with this limit of the duty.
    pub(crate) fn with_duty_at_most(self, most: Duty) -> Self {
        if most == Duty::MAX {
            return self;
        }
        let share = u128::from(self.measured.luminance_full_cd_m2.to_bits()) * u128::from(most.to_bits());
        let most_cd_m2 = U32F32::from_bits((share >> Duty::FRAC_NBITS) as u64).min(self.most_cd_m2);
        Self { most_cd_m2, ..self }
    }

    /// The limit of the luminous intensity, if there is one.
    pub fn limit(&self) -> Option<IntensityLimit> {
        self.limit
    }

    /// The panel's size; `None` without a limit, because only the limit includes the diameter of an LED.
    ///
    /// ```
    /// use link::intensity::IntensityLimit;
    /// use tx_firmware::calibration::{BENCH, Calibration};
    ///
    /// let calibration = Calibration::new(BENCH)?;
    /// assert_eq!(calibration.geometry(), None);
    /// let limited = calibration.limited_to(Some(IntensityLimit::from_cd(Some(100.0), 0.03)?));
    /// assert_eq!(limited.geometry().map(|size| size.led_diameter_m()), Some(0.03));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn geometry(&self) -> Option<Geometry> {
        Geometry::new(self.limit?.led_diameter_um(), self.measured.interval).ok()
    }

    /// The greatest luminance of an On LED, cd/m²: full luminance, or less within the limit. No step of its dimming takes the panel above
    /// the limit.
    pub fn luminance_most_cd_m2(&self) -> U32F32 {
        self.most_cd_m2
    }

    /// The values as given.
    pub fn measured(&self) -> &Measured {
        &self.measured
    }

    /// The least luminance above 0 that the driver can give, cd/m²: the shortest pulse in each of the longest periods, at the low current.
    // Inlined twice, its division of 128 bits would take 1000 bytes more of a small processor's program.
    #[inline(never)]
    pub fn luminance_floor_cd_m2(&self) -> U32F32 {
        // 10⁶ · 10⁷ at most, with 32 and 31 bits of fraction: too much for 64 bits.
        let brightest = u128::from(self.measured.luminance_full_cd_m2.to_bits()) * u128::from(self.measured.low_current_share.to_bits());
        let floor = brightest * u128::from(self.measured.shortest_pulse_ns) / u128::from(self.measured.pwm_period_ns.max(1));
        U32F32::from_bits((floor >> 31).try_into().unwrap_or(u64::MAX))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use properties::prelude::*;
    use std::string::ToString;

    const PANEL: Measured = Measured {
        luminance_full_cd_m2: U32F32::lit("8000"),
        shortest_pulse_ns: 200,
        pwm_period_ns: 20_000,
        ..BENCH
    };

    #[test]
    fn each_value_has_its_own_error_with_the_value_and_the_range() {
        let refused = |measured| Calibration::new(measured).unwrap_err().to_string();
        let cases = [
            (
                refused(Measured {
                    luminance_full_cd_m2: U32F32::ZERO,
                    ..PANEL
                }),
                "luminance 0 cd/m² is outside 1 to 1000000",
            ),
            (
                refused(Measured {
                    pwm_period_ns: 99,
                    ..PANEL
                }),
                "period of 99 ns is outside 100 to 10000000 ns",
            ),
            (
                refused(Measured {
                    shortest_pulse_ns: 20_001,
                    ..PANEL
                }),
                "pulse of 20001 ns does not fit into the PWM period, 0 to 20000 ns",
            ),
            (
                refused(Measured {
                    reflectance: U1F31::MAX,
                    ..PANEL
                }),
                "is outside 0.05 to 1",
            ),
            (
                refused(Measured {
                    interval: Interval::lit("3.5"),
                    ..PANEL
                }),
                "interval 3.5 is outside 0.5 to 3",
            ),
            (
                refused(Measured {
                    sensor_gain: U12F20::ZERO,
                    ..PANEL
                }),
                "gain 0 is outside 0.01 to 1000",
            ),
            (
                refused(Measured {
                    low_current_share: U1F31::ZERO,
                    ..PANEL
                }),
                "share 0 is outside 0.01 to 1",
            ),
        ];
        for (message, expected) in cases {
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn the_ends_of_every_range_are_allowed() {
        for ends in [
            Measured {
                luminance_full_cd_m2: *LUMINANCE_CD_M2.end(),
                pwm_period_ns: *PWM_PERIOD_NS.end(),
                ..PANEL
            },
            Measured {
                reflectance: *REFLECTANCE.end(),
                interval: *INTERVAL.end(),
                sensor_gain: *SENSOR_GAIN.end(),
                ..PANEL
            },
            Measured {
                reflectance: *REFLECTANCE.start(),
                interval: *INTERVAL.start(),
                sensor_gain: *SENSOR_GAIN.start(),
                ..PANEL
            },
            Measured {
                shortest_pulse_ns: 0,
                ..PANEL
            },
            Measured {
                shortest_pulse_ns: PANEL.pwm_period_ns,
                ..PANEL
            },
        ] {
            assert_eq!(Calibration::new(ends).map(|valid| *valid.measured()), Ok(ends));
        }
    }

    properties! {
        #[test]
        fn any_values_are_accepted_or_refused_and_the_floor_is_below_the_top(
            full in any::<u64>(), shortest_pulse_ns in any::<u32>(), pwm_period_ns in any::<u32>(),
            reflectance in any::<u32>(), interval in any::<u16>(), sensor_gain in any::<u32>(),
            low_current_share in any::<u32>(),
        ) {
            let wild = Measured {
                luminance_full_cd_m2: U32F32::from_bits(full), shortest_pulse_ns, pwm_period_ns,
                reflectance: U1F31::from_bits(reflectance), interval: Interval::from_bits(interval),
                sensor_gain: U12F20::from_bits(sensor_gain), low_current_share: U1F31::from_bits(low_current_share),
            };
            // Few random sets are valid as a whole, so each value is also tried among valid ones.
            for measured in [
                wild,
                Measured { luminance_full_cd_m2: wild.luminance_full_cd_m2, ..PANEL },
                Measured { shortest_pulse_ns, pwm_period_ns, ..PANEL },
            ] {
                if let Ok(calibration) = Calibration::new(measured) {
                    prop_assert!(calibration.luminance_floor_cd_m2() <= measured.luminance_full_cd_m2);
                }
            }
        }

        #[test]
        fn the_floor_is_the_shortest_pulse_s_share_of_the_low_current_s_light(
            full in 1.0f64..1e6, period_ns in 100u32..10_000_000, share in 0.0f64..1.0, low_current in 0.01f64..1.0,
        ) {
            let measured = Measured {
                luminance_full_cd_m2: U32F32::from_num(full),
                shortest_pulse_ns: (f64::from(period_ns) * share) as u32,
                pwm_period_ns: period_ns,
                low_current_share: U1F31::from_num(low_current),
                ..PANEL
            };
            let floor = Calibration::new(measured).unwrap().luminance_floor_cd_m2().to_num::<f64>();
            let exact = low_current * full * f64::from(measured.shortest_pulse_ns) / f64::from(period_ns);
            prop_assert!((floor - exact).abs() <= exact * 1e-7 + 1e-9);
        }
    }
}
