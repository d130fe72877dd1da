//! The bench measurements of one transmitter.

use crate::l2a_table::Interval;
use fixed::types::{U1F31, U12F20, U32F32};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The measured values of one panel with its driver and its light sensor. `tx_firmware::calibration` defines their ranges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Measured {
    /// Luminance of an On LED at full duty, without ambient light, cd/m².
    pub luminance_full_cd_m2: U32F32,
    /// The shortest pulse at which the LED's light is still proportional to the pulse, ns; 0 to the PWM period. Power drivers need 100 to
    /// 500 ns. Add half a step of the PWM counter, so that rounding does not make a pulse shorter than this.
    pub shortest_pulse_ns: u32,
    /// Period of the dimming, ns. The relative uncertainty of a frame's light is one over the number of periods in its exposure: 20 000 ns
    /// (50 kHz) gives 50 periods in 1 ms.
    pub pwm_period_ns: u32,
    /// Reflectance R of the LED's surface in the camera's direction.
    pub reflectance: U1F31,
    /// LED interval: edge-to-edge gap over diameter.
    pub interval: Interval,
    /// Lux at the panel over the sensor's lux: 1/transmission of the window before it.
    pub sensor_gain: U12F20,
    /// An LED's light at the low current over that at the full one; 1 if the current cannot be switched.
    pub low_current_share: U1F31,
}
