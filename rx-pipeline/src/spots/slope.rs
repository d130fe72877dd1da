//! The fit of a model, and the slope of its loss.

use super::profile::Moments;
use link::panel::LEDS;

/// The fit of a model, and the slope of its loss.
pub(crate) struct Slope {
    pub squares: f32,
    pub total: f32,
    /// Pixels whose light is known.
    pub pixels: u32,
    /// Pixels in all.
    pub window_pixels: u32,
    pub(super) background: [f32; 2],
    pub(super) led: [Moments; LEDS],
}

impl Slope {
    /// Σ w·g² of an LED's spot g over the pixels' weights w.
    pub fn led_weight(&self, led: usize) -> f32 {
        self.led[led].weight
    }

    /// Σ w·g·r of an LED's spot g and the residuals r.
    pub fn led_agreement(&self, led: usize) -> f32 {
        self.led[led].height
    }

    /// The share of the variance around the background that the model explains.
    pub fn explained(&self) -> f32 {
        1.0 - self.squares / self.total.max(f32::MIN_POSITIVE)
    }
}
