//! The variables of the figures: L2A, interval and distance.

use studies::reproduction::OperatingPoint;

/// One of the three variables.
pub struct Variation {
    /// Its column in the numbers.
    pub key: &'static str,
    /// Its axis label.
    pub label: &'static str,
    /// The operating point at a value.
    pub at: fn(f64) -> OperatingPoint,
    /// The caption of a value.
    pub words: fn(f64) -> String,
}

pub const L2A: Variation = Variation {
    key: "l2a",
    label: "L2A",
    at: OperatingPoint::at_l2a,
    words: |l2a| format!("L2A {l2a}"),
};

pub const INTERVAL: Variation = Variation {
    key: "interval",
    label: "interval (gap / diameter)",
    at: OperatingPoint::at_interval,
    words: |interval| format!("interval {interval}"),
};

pub const DISTANCE: Variation = Variation {
    key: "distance_m",
    label: "distance (m)",
    at: OperatingPoint::at_distance,
    words: |distance_m| format!("{distance_m} m"),
};
