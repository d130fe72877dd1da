//! Brightness that differs from LED to LED.

use link::panel::LEDS;

use super::{About, Effect};
use crate::camera::clock::Moment;
use crate::formation::{Formation, LedStage};
use crate::random::{Purpose, normal, stream};
use crate::scene::Panel;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct LedSpread;

impl Effect for LedSpread {
    fn about(&self) -> About {
        About {
            name: "led_spread",
            model: "the luminance of each LED is scaled by 1 + s n, n standard normal and fixed for the panel",
            keys: &["panel.led_spread", "panel.seed"],
            cost: "one multiplication an LED",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let largest = (0..view.panels.len())
            .flat_map(|p| gains(&view.panels[p].panel, p))
            .map(|gain| (gain - 1.0).abs())
            .fold(0.0, f64::max);
        range.change((range.peak - range.floor) * largest)
    }

    fn gain(&self, view: &View, panel: usize) -> f64 {
        let gains = gains(&view.panels[panel].panel, panel);
        gains.into_iter().fold(1.0, f64::max)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        let panels = (0..view.panels.len())
            .map(|panel| gains(&view.panels[panel].panel, panel))
            .collect();
        formation.led_stages.push(Box::new(Gains { panels }));
    }
}

/// The factors of one panel's LEDs: the same for the same panel index and seed, in all runs.
fn gains(panel: &Panel, index: usize) -> [f64; LEDS] {
    let mut random = stream(0x1ed5_94ea_d000_0000 ^ u64::from(panel.seed), index as u64, Purpose::Panel);
    std::array::from_fn(|_| (1.0 + panel.led_spread * normal(&mut random)).max(0.0))
}

struct Gains {
    panels: Vec<[f64; LEDS]>,
}

impl LedStage for Gains {
    fn apply(&self, panel: usize, _moment: &Moment, _delay_s: &[f64; LEDS], own_light: &mut [f64; LEDS]) {
        for (light, gain) in own_light.iter_mut().zip(&self.panels[panel]) {
            *light *= gain;
        }
    }
}
