//! The panel of `docs/hardware.md`, as a bench measures it: what a Pico takes its own for until somebody has measured that.

use fixed::types::{U1F31, U12F20, U32F32};
use link::l2a_table::Interval;
use link::serial::Measured;
use tx_firmware::drive::{EXPOSURE_LONG_NS, period_ns};

/// Its values.
pub const BENCH: Measured = Measured {
    luminance_full_cd_m2: U32F32::lit("26000"),
    shortest_pulse_ns: 100,
    pwm_period_ns: period_ns(EXPOSURE_LONG_NS),
    reflectance: U1F31::lit("0.4"),
    interval: Interval::lit("1"),
    sensor_gain: U12F20::lit("1"),
    low_current_share: U1F31::lit("0.125"),
};
