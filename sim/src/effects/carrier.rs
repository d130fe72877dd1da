//! A carrier for the symbols: an exposure sees a part of a few of its cycles.
//!
//! The ratio of LED to ambient light is that of an LED that is always On. With a carrier each LED is On for half of the time, so that the
//! panel is half as bright on average. Dimming pulses and motion within the exposure act on the exposure's mean.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Carrier;

impl Effect for Carrier {
    fn about(&self) -> About {
        About {
            name: "carrier",
            model: "the part of the exposure in which the carrier lights an LED of each bit, as an integral in closed form",
            keys: &["link.carrier_cycles", "link.symbol_rate_hz", "link.phase", "link.clock_ppm"],
            cost: "one integral an LED and symbol",
        }
    }

    /// The whole range with a carrier; otherwise 0.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if view.waveform.is_still() { 0.0 } else { range.range_grey() }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.waveform = view.waveform;
    }
}
