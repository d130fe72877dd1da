//! Synthetic features and frames.

use link::panel::LEDS;
use rx_pipeline::features::Features;

/// Features with AGR `agr` and GRI `gri` for each cell; grey follows AGR.
pub fn features(agr: impl Fn(usize) -> f32, gri: impl Fn(usize) -> f32) -> Features {
    let agr = std::array::from_fn(agr);
    Features {
        mean_grey: agr.map(|agr| 100.0 * agr),
        agr,
        gri: std::array::from_fn(gri),
        saturated: [0; LEDS],
        pixels: [16; LEDS],
        panel_grey: 100.0,
    }
}

/// A pseudo-random number from −1 to 1: the fractional parts of multiples of an irrational number are equidistributed.
pub fn spread(k: usize, step: f64) -> f32 {
    ((k as f64 * step).fract() * 2.0 - 1.0) as f32
}
