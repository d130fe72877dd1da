//! The duty of the LEDs from ambient light and an L2A ratio.
//!
//! The L2A is r = L/(E·R) (Do & Yoo 2020, Eq. (9)): the LED's own luminance L over the ambient illuminance E times the reflectance R of the
//! LED's surface. Solved for the luminance of the table's ratio:
//!
//! ```text
//! L* = r·E·R
//! ```
//!
//! A panel cannot always give it. [`Dimming`] has the wanted and the actual luminance, and the limit between them:
//!
//! | [`Limit`] | when | given |
//! |---|---|---|
//! | none | floor ≤ L* ≤ most | L* |
//! | `Top` | L* > most | most |
//! | `Floor` | L* < floor, and the floor's L2A is at most [`L2A_MAX`] | the floor |
//! | `Off` | L* < floor, and the floor's L2A would be above [`L2A_MAX`]; or floor > most | dark |
//!
//! *Most* is full luminance, or less where the calibration limits the panel's intensity ([`Calibration::luminance_most_cd_m2`]) or where
//! its board has a [`ceiling`] of the duty. The floor is the shortest clean pulse in each PWM period,
//! [`Calibration::luminance_floor_cd_m2`]. Just below it the floor is held, because a link somewhat brighter than best still works. Far
//! below it, at night, the same pulse would dazzle a driver, and the camera's image of it would bloom until On and Off are
//! indistinguishable. The panel then stays dark: no panel is better than a wrong one.
//!
//! ## Accuracy
//!
//! L* is truncated once, at 2⁻³² cd/m², and the duty once, at 2⁻³² of full luminance. Against the
//! same formula in `f64` the errors are at most [`LUMINANCE_ERROR_CD_M2`] and [`DUTY_ERROR`], for E
//! up to 130 000 lx, any R of a [`Calibration`] and r up to 4: `cargo test -p vocc-tx-firmware dimming`.
//! At night the driver limits a panel: [`drive`](crate::drive).

use fixed::types::U32F32;
use link::l2a_table::{self, Illuminance, L2a};
pub use link::serial::Limit;

use crate::{ambient::BRIGHTEST_LX, calibration::Calibration};

pub use crate::matrix::Duty;

/// The greatest L2A that a panel is ever driven to, that of tables: the end of the range that Do & Yoo 2020, Table 1, examine, beyond
/// which LEDs flare.
pub const L2A_MAX: L2a = L2a::from_bits((l2a_table::L2A_MAX * (1u32 << L2a::FRAC_NBITS) as f32) as u16);

/// The illuminance that counts as night, lx: a well-lit road. At an L2A of [`L2A_MAX`] it gives the night limit, 4·50 lx·R = 200·R cd/m²,
/// the greatest luminance of a panel in unknown light.
pub const NIGHT_LX: Illuminance = Illuminance::lit("50");

/// Bound of the wanted luminance's error, cd/m²: one step of its type.
pub const LUMINANCE_ERROR_CD_M2: f64 = 1.0 / (1u64 << 32) as f64;

/// Bound of the duty's error: one step of its type, plus the effect of the luminance's error on a panel of 1 cd/m².
pub const DUTY_ERROR: f64 = 1.0 / (1u64 << 32) as f64 + LUMINANCE_ERROR_CD_M2;

/// The panel's brightness, and the reason for it.
///
/// ```
/// use fixed::types::{U1F31, U32F32};
/// use link::l2a_table::{Illuminance, L2a};
/// use tx_firmware::{calibration::{BENCH, Calibration, Measured}, dimming::{Dimming, Duty, Limit}};
///
/// let calibration = Calibration::new(Measured {
///     luminance_full_cd_m2: U32F32::lit("8000"),
///     pwm_period_ns: 20_000,
///     reflectance: U1F31::lit("0.5"),
///     ..BENCH
/// })?;
/// let l2a = L2a::lit("2");
///
/// let overcast = Dimming::new(l2a, Illuminance::lit("4000"), &calibration);
/// assert!(overcast.luminance_cd_m2 == 4000 && overcast.duty == Duty::lit("0.5") && overcast.limited.is_none());
///
/// let noon = Dimming::new(l2a, Illuminance::lit("100000"), &calibration);
/// assert!(noon.wanted_cd_m2 == 100_000 && noon.duty == Duty::MAX && noon.limited == Some(Limit::Top));
///
/// let dusk = Dimming::new(l2a, Illuminance::lit("30"), &calibration);
/// assert!(dusk.wanted_cd_m2 == 30 && dusk.luminance_cd_m2 == 40 && dusk.limited == Some(Limit::Floor));
///
/// let night = Dimming::new(l2a, Illuminance::lit("10"), &calibration);
/// assert!(night.wanted_cd_m2 == 10 && night.duty == 0 && night.limited == Some(Limit::Off));
/// # Ok::<(), tx_firmware::calibration::CalibrationError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimming {
    /// The wanted L2A, at most [`L2A_MAX`].
    pub l2a: L2a,
    /// The wanted luminance L* of an On LED, cd/m².
    pub wanted_cd_m2: U32F32,
    /// The actual luminance, cd/m².
    pub luminance_cd_m2: U32F32,
    /// The same as a share of full luminance.
    pub duty: Duty,
    /// Why the luminance differs from the wanted one; `None` if it does not.
    pub limited: Option<Limit>,
}

impl Dimming {
    /// The dimming of the panel of `calibration` for the ratio `l2a` under `illuminance_lx`.
    ///
    /// An `l2a` above [`L2A_MAX`] and an illuminance above [`BRIGHTEST_LX`] count as these.
    pub fn new(l2a: L2a, illuminance_lx: Illuminance, calibration: &Calibration) -> Self {
        let l2a = l2a.min(L2A_MAX);
        let full_cd_m2 = calibration.measured().luminance_full_cd_m2;
        let most_cd_m2 = calibration.luminance_most_cd_m2();
        let floor_cd_m2 = calibration.luminance_floor_cd_m2();
        let luminance_of = |l2a| luminance_cd_m2(l2a, illuminance_lx, calibration);

        let wanted_cd_m2 = luminance_of(l2a);
        let (luminance_cd_m2, limited) = if floor_cd_m2 > most_cd_m2 {
            (U32F32::ZERO, Some(Limit::Off))
        } else if wanted_cd_m2 > most_cd_m2 {
            (most_cd_m2, Some(Limit::Top))
        } else if wanted_cd_m2 >= floor_cd_m2 {
            (wanted_cd_m2, None)
        } else if floor_cd_m2 <= luminance_of(L2A_MAX) {
            (floor_cd_m2, Some(Limit::Floor))
        } else {
            (U32F32::ZERO, Some(Limit::Off))
        };
        Self {
            l2a,
            wanted_cd_m2,
            luminance_cd_m2,
            duty: duty(luminance_cd_m2, full_cd_m2),
            limited,
        }
    }
}

/// Do & Yoo 2020, Eq. (9), solved for the luminance: L = r·E·R.
fn luminance_cd_m2(l2a: L2a, illuminance_lx: Illuminance, calibration: &Calibration) -> U32F32 {
    let illuminance_lx = illuminance_lx.min(BRIGHTEST_LX);
    let reflectance = calibration.measured().reflectance;
    // 16 + 29 + 32 bits, of them 13 + 12 + 31 of fraction: exact in 128 bits, truncated once, to 32.
    let product = u128::from(l2a.to_bits()) * u128::from(illuminance_lx.to_bits()) * u128::from(reflectance.to_bits());
    U32F32::from_bits((product >> 24) as u64)
}

/// The ratio of `luminance_cd_m2` to `full_cd_m2`, at most 1.
fn duty(luminance_cd_m2: U32F32, full_cd_m2: U32F32) -> Duty {
    let luminance = u128::from(luminance_cd_m2.to_bits()) << Duty::FRAC_NBITS;
    let share = luminance / u128::from(full_cd_m2.to_bits().max(1));
    Duty::from_bits(share.try_into().unwrap_or(u32::MAX))
}

/// The greatest duty at the sensor's reading before any gain, for LEDs that may have full duty from `full_duty_lx` on: in proportion to the
/// light below, and never less than at [`NIGHT_LX`].
///
/// ```
/// use link::l2a_table::Illuminance;
/// use tx_firmware::dimming::{Duty, ceiling};
/// let at = |lx: &str| ceiling(4000, lx.parse::<Illuminance>().unwrap());
/// assert_eq!((at("4000"), at("1000"), at("50")), (Duty::MAX, Duty::lit("0.25"), Duty::lit("0.0125")));
/// assert_eq!(at("0"), at("50"));
/// ```
pub fn ceiling(full_duty_lx: u32, reading_lx: Illuminance) -> Duty {
    let lux = u64::from(reading_lx.max(NIGHT_LX).to_bits()) << (Duty::FRAC_NBITS - Illuminance::FRAC_NBITS);
    let share = lux.checked_div(full_duty_lx.into()).and_then(|share| share.try_into().ok());
    share.map_or(Duty::MAX, Duty::from_bits)
}

/// The number of PWM steps, of `max_duty_cycle`, nearest to `duty`.
///
/// ```
/// use tx_firmware::dimming::{Duty, duty_cycle};
/// assert_eq!(duty_cycle(Duty::MAX, 2500), 2500);
/// assert_eq!(duty_cycle(Duty::lit("0.5"), 2500), 1250);
/// assert_eq!(duty_cycle(Duty::lit("0.000198"), 2500), 0); // 0.495 of a step
/// assert_eq!(duty_cycle(Duty::MAX, 0), 0);
/// ```
pub fn duty_cycle(duty: Duty, max_duty_cycle: u16) -> u16 {
    const HALF: u64 = 1 << (Duty::FRAC_NBITS - 1);
    // Less than 2³²·max + 2³¹ before the shift, hence at most `max_duty_cycle` after it.
    ((u64::from(duty.to_bits()) * u64::from(max_duty_cycle) + HALF) >> Duty::FRAC_NBITS) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibration::{BENCH, Measured},
        drive::{Drive, Pulses},
        max7219::intensity,
    };
    use fixed::types::{U1F31, U12F20};
    use link::geometry::Geometry;
    use link::intensity::IntensityLimit;
    use link::l2a_table::Interval;
    use properties::prelude::*;

    prop_compose! {
        fn calibrations()(
            full in 1.0f64..1e6, pulse_share in 0.0f64..0.02, period_ns in 100u32..10_000_000,
            reflectance in 0.051f64..1.0, interval in 0.51f64..3.0,
        ) -> Calibration {
            Calibration::new(Measured {
                luminance_full_cd_m2: U32F32::from_num(full),
                shortest_pulse_ns: (f64::from(period_ns) * pulse_share) as u32,
                pwm_period_ns: period_ns,
                reflectance: U1F31::from_num(reflectance),
                interval: Interval::from_num(interval),
                sensor_gain: U12F20::ONE,
                low_current_share: U1F31::ONE,
            }).unwrap()
        }
    }

    /// Illuminances uniform in the logarithm from darkness to sun.
    fn illuminances_lx() -> impl Strategy<Value = Illuminance> {
        (0.01f64.log2()..130_000f64.log2()).prop_map(|octave| Illuminance::from_num(octave.exp2()))
    }

    fn l2as() -> impl Strategy<Value = L2a> {
        (0.2f64..4.0).prop_map(L2a::from_num)
    }

    /// The same path in `f64`: wanted luminance, actual luminance, duty.
    fn reference(l2a: L2a, illuminance_lx: Illuminance, calibration: &Calibration) -> (f64, f64, f64) {
        let measured = calibration.measured();
        let full = measured.luminance_full_cd_m2.to_num::<f64>();
        let floor = full * f64::from(measured.shortest_pulse_ns) / f64::from(measured.pwm_period_ns);
        let one_to_one = illuminance_lx.to_num::<f64>() * measured.reflectance.to_num::<f64>();
        let wanted = l2a.to_num::<f64>() * one_to_one;
        let given = if wanted < floor && floor > 4.0 * one_to_one {
            0.0
        } else {
            wanted.max(floor).min(full)
        };
        (wanted, given, given / full)
    }

    properties! {
        #[test]
        fn fixed_point_keeps_its_bound(l2a in l2as(), lx in illuminances_lx(), calibration in calibrations()) {
            let dimming = Dimming::new(l2a, lx, &calibration);
            let (wanted, given, duty) = reference(l2a, lx, &calibration);
            // The reference's own rounding, a few parts in 2⁵³, does not belong to the fixed point's error.
            let rounding = 1.0 + 1e-15;
            prop_assert!((dimming.wanted_cd_m2.to_num::<f64>() - wanted).abs() <= LUMINANCE_ERROR_CD_M2 + wanted * (rounding - 1.0));
            prop_assert!((dimming.luminance_cd_m2.to_num::<f64>() - given).abs() <= LUMINANCE_ERROR_CD_M2 + given * (rounding - 1.0));
            prop_assert!((dimming.duty.to_num::<f64>() - duty).abs() <= DUTY_ERROR * rounding, "{} against {duty}", dimming.duty);
        }

        #[test]
        fn no_light_and_no_table_takes_a_panel_above_its_intensity_limit(
            l2a in any::<u16>(), lx in any::<u32>(), calibration in calibrations(),
            most_mcd in IntensityLimit::MOST_MCD, octaves in 0u32..30, diameter_um in Geometry::LED_DIAMETER_UM,
        ) {
            // Limits uniform in the logarithm.
            let limit = IntensityLimit::new(Some((most_mcd >> octaves).max(1)), diameter_um).unwrap();
            let calibration = calibration.limited_to(Some(limit));
            let dimming = Dimming::new(L2a::from_bits(l2a), Illuminance::from_bits(lx), &calibration);
            let most_cd_m2 = limit.luminance_cd_m2().map_or(f64::MAX, |most| most.to_num());
            let full_cd_m2 = calibration.measured().luminance_full_cd_m2.to_num::<f64>();
            prop_assert!(dimming.luminance_cd_m2.to_num::<f64>() <= most_cd_m2);
            prop_assert!(dimming.duty.to_num::<f64>() * full_cd_m2 <= most_cd_m2);
            let free = Dimming::new(L2a::from_bits(l2a), Illuminance::from_bits(lx), &calibration.limited_to(None));
            prop_assert!(dimming.luminance_cd_m2 <= free.luminance_cd_m2);
            prop_assert_eq!(dimming.wanted_cd_m2, free.wanted_cd_m2);
        }

        #[test]
        fn no_step_of_a_driver_does_so_either(duty in any::<u32>(), most_mcd in 1u32..1_000_000, clock_mhz in 65u32..=150, low: bool) {
            let limit = IntensityLimit::new(Some(most_mcd), 30_000).unwrap();
            let calibration = Calibration::new(BENCH).unwrap().limited_to(Some(limit));
            let most_cd_m2 = limit.luminance_cd_m2().map_or(f64::MAX, |most| most.to_num());
            let full_cd_m2 = BENCH.luminance_full_cd_m2.to_num::<f64>();
            let given = |most: U32F32| super::duty(most, BENCH.luminance_full_cd_m2).min(Duty::from_bits(duty));
            let before = Pulses { low_current: low, ..Pulses::default() };
            let drive = Drive::new(&BENCH, clock_mhz * 1_000_000);
            let pulses = drive.pulses(given(calibration.luminance_most_cd_m2()), before);
            prop_assert!(pulses.duty(BENCH.low_current_share).to_num::<f64>() * full_cd_m2 <= most_cd_m2);

            // A MAX7219 lights 1/32 to 31/32; its full luminance is that of 31/32.
            let steps = Measured { shortest_pulse_ns: 40_323, pwm_period_ns: 1_250_000, ..BENCH };
            let calibration = Calibration::new(steps).unwrap().limited_to(Some(limit));
            if calibration.luminance_floor_cd_m2() <= calibration.luminance_most_cd_m2() {
                let step = intensity(given(calibration.luminance_most_cd_m2()));
                let light = step.map_or(0.0, |step| (2.0 * f64::from(step) + 1.0) / 31.0);
                prop_assert!(light * full_cd_m2 <= most_cd_m2, "{light}");
            }
        }

        #[test]
        fn no_panel_is_driven_beyond_the_greatest_l2a(l2a in any::<u16>(), lx in illuminances_lx(), calibration in calibrations()) {
            let dimming = Dimming::new(L2a::from_bits(l2a), lx, &calibration);
            let at_l2a_4 = 4.0 * lx.to_num::<f64>() * calibration.measured().reflectance.to_num::<f64>();
            let full = calibration.measured().luminance_full_cd_m2.to_num::<f64>();
            prop_assert!(dimming.luminance_cd_m2.to_num::<f64>() <= at_l2a_4);
            prop_assert!(dimming.duty.to_num::<f64>() * full <= at_l2a_4);
        }

        #[test]
        fn the_limit_says_which_way_the_luminance_went(l2a in l2as(), lx in illuminances_lx(), calibration in calibrations()) {
            let dimming = Dimming::new(l2a, lx, &calibration);
            let (wanted, given) = (dimming.wanted_cd_m2, dimming.luminance_cd_m2);
            match dimming.limited {
                None => prop_assert_eq!(given, wanted),
                Some(Limit::Top) => prop_assert!(given < wanted && dimming.duty == Duty::MAX),
                Some(Limit::Floor) => prop_assert!(given > wanted),
                Some(Limit::Off) => prop_assert!(given == 0 && dimming.duty == 0),
            }
        }

        #[test]
        fn more_ambient_light_never_dims_the_panel(lx in illuminances_lx(), l2a in l2as(), calibration in calibrations()) {
            let dimmer = Dimming::new(l2a, lx / 2, &calibration);
            let brighter = Dimming::new(l2a, lx, &calibration);
            prop_assert!(dimmer.luminance_cd_m2 <= brighter.luminance_cd_m2);
            prop_assert!(dimmer.duty <= brighter.duty);
        }

        #[test]
        fn any_input_is_answered(l2a in any::<u16>(), lx in any::<u32>(), calibration in calibrations()) {
            let dimming = Dimming::new(L2a::from_bits(l2a), Illuminance::from_bits(lx), &calibration);
            prop_assert!(dimming.l2a <= L2A_MAX);
            prop_assert!(dimming.luminance_cd_m2 <= calibration.measured().luminance_full_cd_m2);
        }

        #[test]
        fn duty_cycles_are_the_nearest_steps(duty in any::<u32>(), max in any::<u16>()) {
            let duty = Duty::from_bits(duty);
            let exact = duty.to_num::<f64>() * f64::from(max);
            let steps = duty_cycle(duty, max);
            prop_assert!(steps <= max);
            prop_assert!((f64::from(steps) - exact).abs() <= 0.5);
        }
    }
}
