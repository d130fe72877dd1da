//! The limit of a panel's luminous intensity, independent of the ambient light.

use core::num::NonZeroU32;
use core::ops::RangeInclusive;

use fixed::types::U32F32;
use thiserror::Error;

use crate::geometry::Geometry;
use crate::panel::LEDS;

/// The diameter of a panel's LEDs and, optionally, a limit of the panel's mean luminous intensity, straight ahead.
///
/// A disc of diameter D and luminance L has the intensity L·π/4·D² (ISO 80000-7: luminance is intensity over area), and each of the 64
/// LEDs is On for half of the time:
///
/// ```text
/// I = 64 · π/4·D² · L · 1/2 = 8·π·D²·L
/// ```
///
/// ```
/// use link::intensity::IntensityLimit;
/// // The discs of Do & Yoo 2020, 30 mm wide: 580 cd at 25 600 cd/m².
/// let limit = IntensityLimit::from_cd(Some(100.0), 0.03)?;
/// assert!(limit.luminance_cd_m2().is_some_and(|limit| (limit.to_num::<f64>() - 4421.0).abs() < 1.0));
/// assert_eq!(IntensityLimit::from_cd(None, 0.03)?.luminance_cd_m2(), None);
/// let dark = IntensityLimit::from_cd(Some(0.0), 0.03).unwrap_err().to_string();
/// assert!(dark.starts_with("an intensity limit of 0 cd is outside 0.001 to 1000000 cd"));
/// # Ok::<(), link::intensity::IntensityLimitError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IntensityLimit {
    most_mcd: Option<NonZeroU32>,
    led_diameter_um: u32,
}

/// The mean luminous intensity, cd, of a panel whose On LEDs have a luminance in cd/m² and a diameter in m: 8·π·D²·L. With all LEDs On it
/// is twice as much.
///
/// ```
/// use link::intensity::{IntensityLimit, mean_cd};
/// let limit = IntensityLimit::from_cd(Some(100.0), 0.03)?;
/// assert!(limit.luminance_cd_m2().is_some_and(|limit| (mean_cd(limit.to_num(), 0.03) - 100.0).abs() < 1e-6));
/// # Ok::<(), link::intensity::IntensityLimitError>(())
/// ```
pub fn mean_cd(luminance_cd_m2: f64, led_diameter_m: f64) -> f64 {
    8.0 * core::f64::consts::PI * led_diameter_m * led_diameter_m * luminance_cd_m2
}

/// Why a limit was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum IntensityLimitError {
    /// The intensity, in thousandths of a candela, is outside [`IntensityLimit::MOST_MCD`].
    #[error(
        "an intensity limit of {} cd is outside 0.001 to 1000000 cd: omit it for no limit",
        f64::from(*.0) / 1e3
    )]
    Intensity(u32),
    /// The diameter, in millionths of a metre, is outside [`Geometry::LED_DIAMETER_UM`].
    #[error(
        "an LED diameter of {} m is outside 0.0001 to 1 m: give the diameter of one LED's bright disc",
        f64::from(*.0) / 1e6
    )]
    LedDiameter(u32),
}

impl IntensityLimit {
    /// The range of limits, 1/1000 cd: up to 1000 of the brightest headlamps. The greatest value means no limit: on the wire and in
    /// flash memory it encodes a diameter alone.
    pub const MOST_MCD: RangeInclusive<u32> = 1..=1_000_000_000;

    /// A limit in 1/1000 cd, or none, for LEDs of a diameter in µm.
    ///
    /// # Errors
    /// [`IntensityLimitError`] for a number outside [`MOST_MCD`](Self::MOST_MCD) or [`Geometry::LED_DIAMETER_UM`].
    pub fn new(most_mcd: Option<u32>, led_diameter_um: u32) -> Result<Self, IntensityLimitError> {
        let greatest = *Self::MOST_MCD.end();
        let most_mcd = most_mcd.unwrap_or(greatest);
        if !Self::MOST_MCD.contains(&most_mcd) {
            return Err(IntensityLimitError::Intensity(most_mcd));
        }
        if !Geometry::LED_DIAMETER_UM.contains(&led_diameter_um) {
            return Err(IntensityLimitError::LedDiameter(led_diameter_um));
        }
        Ok(Self {
            most_mcd: NonZeroU32::new(most_mcd).filter(|most| most.get() < greatest),
            led_diameter_um,
        })
    }

    /// A limit in cd, or none, for LEDs of a diameter in m, to the nearest 1/1000 cd and µm.
    ///
    /// # Errors
    /// As [`new`](Self::new), and for NaN.
    pub fn from_cd(most_cd: Option<f64>, led_diameter_m: f64) -> Result<Self, IntensityLimitError> {
        Self::new(
            most_cd.map(|most_cd| (most_cd * 1e3 + 0.5) as u32),
            (led_diameter_m * 1e6 + 0.5) as u32,
        )
    }

    /// The limit encoded by two numbers on the wire and in flash memory: the limit, 1/1000 cd, and the diameter, µm; both 0 if neither is
    /// known.
    ///
    /// ```
    /// use link::intensity::IntensityLimit;
    /// let diameter_alone = IntensityLimit::new(None, 30_000).ok();
    /// for (numbers, limit) in [([0, 0], None), ([1_000_000_000, 30_000], diameter_alone)] {
    ///     assert_eq!(IntensityLimit::from_numbers(numbers), Ok(limit));
    ///     assert_eq!(IntensityLimit::numbers(limit), numbers);
    /// }
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_numbers([most_mcd, led_diameter_um]: [u32; 2]) -> Result<Option<Self>, IntensityLimitError> {
        if [most_mcd, led_diameter_um] == [0, 0] {
            return Ok(None);
        }
        Self::new(Some(most_mcd), led_diameter_um).map(Some)
    }

    /// The two numbers that encode it on the wire and in flash memory.
    pub fn numbers(limit: Option<Self>) -> [u32; 2] {
        limit.map_or([0, 0], |limit| {
            let most_mcd = limit.most_mcd.map_or(*Self::MOST_MCD.end(), NonZeroU32::get);
            [most_mcd, limit.led_diameter_um]
        })
    }

    /// The greatest intensity, cd; `None` without a limit.
    pub fn most_cd(self) -> Option<f64> {
        self.most_mcd.map(|most_mcd| f64::from(most_mcd.get()) / 1e3)
    }

    /// The diameter of an LED, µm.
    pub fn led_diameter_um(self) -> u32 {
        self.led_diameter_um
    }

    /// The luminance of On LEDs at the limit of the panel's mean intensity, cd/m², never rounded up; `None` without a limit.
    pub fn luminance_cd_m2(self) -> Option<U32F32> {
        // LEDS/2·π/4, with its last digit rounded up.
        const AREAS_BILLIONTHS: u128 = 25_132_741_229;
        const _: () = assert!(LEDS == 64);
        // The factor from 1/1000 cd over µm² to cd/m² is 10⁹. 30 + 30 + 30 + 32 bits over 35 + 40.
        let area = AREAS_BILLIONTHS * u128::from(self.led_diameter_um).pow(2);
        let intensity = u128::from(self.most_mcd?.get()) * 1_000_000_000 * 1_000_000_000;
        // Bit by bit, which saves a small processor 600 bytes of program over a division of 128 bits.
        let [mut bits, mut rest, mut dividend] = [0u128, 0, intensity << U32F32::FRAC_NBITS];
        for _ in 0..u128::BITS {
            rest = rest << 1 | dividend >> (u128::BITS - 1);
            let is_whole = rest >= area;
            rest -= if is_whole { area } else { 0 };
            bits = bits << 1 | u128::from(is_whole);
            dividend <<= 1;
        }
        Some(U32F32::from_bits(bits.try_into().unwrap_or(u64::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    #[test]
    fn what_is_no_limit_is_refused() {
        for most_mcd in [0, 1_000_000_001, u32::MAX] {
            let refused = IntensityLimit::new(Some(most_mcd), 30_000);
            assert_eq!(refused, Err(IntensityLimitError::Intensity(most_mcd)));
        }
        for diameter_um in [0, 99, 1_000_001, u32::MAX] {
            let refused = IntensityLimit::new(Some(1000), diameter_um);
            assert_eq!(refused, Err(IntensityLimitError::LedDiameter(diameter_um)));
        }
        for wild in [f64::NAN, -1.0, f64::INFINITY, 0.0] {
            assert!(IntensityLimit::from_cd(Some(wild), 0.03).is_err());
            assert!(IntensityLimit::from_cd(Some(1.0), wild).is_err());
        }
    }

    properties! {
        #[test]
        fn a_panel_of_its_luminance_has_at_most_its_intensity(
            most_mcd in 1u32..1_000_000_000, diameter_um in Geometry::LED_DIAMETER_UM,
        ) {
            let limit = IntensityLimit::new(Some(most_mcd), diameter_um).expect("a limit");
            let luminance = limit.luminance_cd_m2().expect("limited").to_num::<f64>();
            let area_m2 = core::f64::consts::PI / 4.0 * (f64::from(diameter_um) / 1e6).powi(2);
            let exact = f64::from(most_mcd) / 1e3 / (32.0 * area_m2);
            prop_assert!(luminance <= exact * (1.0 + 1e-12));
            let room = U32F32::MAX.to_num::<f64>();
            prop_assert!(luminance >= exact.min(room) * (1.0 - 1e-9) - 1e-9);
        }
    }
}
