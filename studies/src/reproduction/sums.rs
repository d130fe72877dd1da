//! The sums of the frames' features.

use link::panel::LEDS;
use serde::{Deserialize, Serialize};

use crate::monte_carlo::Observation;
use crate::statistics::{Distinguishability, Moments};

/// The sums over a batch's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sums {
    /// (AGR, GRI) of On LEDs.
    pub on: Moments,
    /// (AGR, GRI) of Off LEDs.
    pub off: Moments,
    /// (grey at the LED's centre, share of the cell's pixels at 255) of On LEDs.
    pub on_grey: Moments,
    /// The same for Off LEDs.
    pub off_grey: Moments,
}

impl Sums {
    /// Adds one frame, with the grey levels at the LEDs' centres.
    pub fn push(&mut self, observed: &Observation, led_greys: &[u8; LEDS]) {
        let features = &observed.features;
        for (led, &led_grey) in led_greys.iter().enumerate() {
            let (class, grey) = if observed.bits.led(led) {
                (&mut self.on, &mut self.on_grey)
            } else {
                (&mut self.off, &mut self.off_grey)
            };
            class.push([features.agr[led].into(), features.gri[led].into()]);
            let saturated = f64::from(features.saturated[led]) / f64::from(features.pixels[led]);
            grey.push([led_grey.into(), saturated]);
        }
    }

    /// Adds all frames of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.on.merge(&other.on);
        self.off.merge(&other.off);
        self.on_grey.merge(&other.on_grey);
        self.off_grey.merge(&other.off_grey);
    }

    /// Between- and within-class variance of (AGR, GRI) and their ratio.
    pub fn distinguishability(&self) -> Distinguishability {
        Distinguishability::of(&self.on, &self.off)
    }
}
