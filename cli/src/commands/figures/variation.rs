//! The variables of the figures: L2A, interval and distance.

use studies::reproduction::OperatingPoint;
use studies::reproduction::paper::{BEST_L2A, BVAR_LEVELS_OFF_L2A, BVAR_PEAK_INTERVAL};

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
    /// The statements of the paper's text: the quantity, the variable's value and the words.
    pub stated: &'static [(&'static str, f64, &'static str)],
}

pub const L2A: Variation = Variation {
    key: "l2a",
    label: "L2A",
    at: OperatingPoint::at_l2a,
    words: |l2a| format!("L2A {l2a}"),
    stated: &[("Bvar", BVAR_LEVELS_OFF_L2A, "paper: levels off"), ("B2W", BEST_L2A, "paper: best")],
};

pub const INTERVAL: Variation = Variation {
    key: "interval",
    label: "interval (gap / diameter)",
    at: OperatingPoint::at_interval,
    words: |interval| format!("interval {interval}"),
    stated: &[("Bvar", BVAR_PEAK_INTERVAL, "paper: peak")],
};

pub const DISTANCE: Variation = Variation {
    key: "distance_m",
    label: "distance (m)",
    at: OperatingPoint::at_distance,
    words: |distance_m| format!("{distance_m} m"),
    stated: &[],
};
