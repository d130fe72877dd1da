//! What the figures vary, one at a time: L2A, interval and distance.

use studies::reproduction::OperatingPoint;

/// One of the three.
pub struct Variation {
    /// Its column in tables of numbers.
    pub key: &'static str,
    /// Its axis.
    pub label: &'static str,
    /// The point at one of its values.
    pub at: fn(f64) -> OperatingPoint,
    /// What is written at one of its values.
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
