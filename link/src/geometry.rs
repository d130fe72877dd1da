//! The panel's size, which a panel transmits so that cameras can measure its range.

use core::ops::RangeInclusive;

use thiserror::Error;

use crate::l2a_table::Interval;

/// Bits of the diameter in a header.
const DIAMETER_BITS: u32 = 20;

/// The size of a panel: the diameter of an LED's bright disc, and the gap between two discs.
///
/// ```
/// use link::geometry::Geometry;
/// use link::l2a_table::Interval;
/// // The panel of Do & Yoo 2020 at interval 1: LEDs of 30 mm, 30 mm apart.
/// let geometry = Geometry::new(30_000, Interval::ONE)?;
/// assert_eq!((geometry.led_diameter_m(), geometry.interval()), (0.03, 1.0));
/// let none = Geometry::new(0, Interval::ONE).unwrap_err().to_string();
/// assert!(none.starts_with("a panel of LEDs 0 m wide is outside 0.0001 to 1 m"));
/// # Ok::<(), link::geometry::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Geometry {
    led_diameter_um: u32,
    interval: Interval,
}

/// A panel size out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error(
    "a panel of LEDs {} m wide is outside 0.0001 to 1 m: give the diameter of one LED's bright disc",
    f64::from(*.led_diameter_um) / 1e6
)]
pub struct GeometryError {
    /// The diameter of an LED, µm.
    pub led_diameter_um: u32,
}

impl Geometry {
    /// The range of diameters, µm: from a tenth of a millimetre to a metre.
    pub const LED_DIAMETER_UM: RangeInclusive<u32> = 100..=1_000_000;

    /// A panel from the diameter of its LEDs, in µm, and its interval: the gap between their edges over the diameter, 0 to 16.
    ///
    /// # Errors
    /// [`GeometryError`] if the diameter is outside [`LED_DIAMETER_UM`](Self::LED_DIAMETER_UM).
    pub fn new(led_diameter_um: u32, interval: Interval) -> Result<Self, GeometryError> {
        if !Self::LED_DIAMETER_UM.contains(&led_diameter_um) {
            return Err(GeometryError { led_diameter_um });
        }
        Ok(Self { led_diameter_um, interval })
    }

    /// The diameter of an LED, m.
    pub fn led_diameter_m(self) -> f64 {
        f64::from(self.led_diameter_um) / 1e6
    }

    /// The gap between the edges of two LEDs over their diameter.
    pub fn interval(self) -> f64 {
        self.interval.to_num()
    }

    /// Its 36 bits in a header: 20 of the diameter, then 16 of the interval.
    pub(crate) fn to_bits(self) -> u64 {
        u64::from(self.led_diameter_um) | u64::from(self.interval.to_bits()) << DIAMETER_BITS
    }

    /// The panel of these bits.
    pub(crate) fn from_bits(bits: u64) -> Result<Self, GeometryError> {
        let diameter = bits & ((1 << DIAMETER_BITS) - 1);
        let interval = Interval::from_bits((bits >> DIAMETER_BITS) as u16);
        Self::new(diameter as u32, interval)
    }
}
