//! A row-scanned panel, which never shows all rows at once.
//!
//! `panel.pwm_hz` is then the number of whole scans a second; 0 is a scan too fast to matter.

use link::panel::{LEDS, SIDE};

use super::pwm::Pulses;
use super::{About, Effect};
use crate::camera::clock::Moment;
use crate::formation::{Formation, LedStage};
use crate::view::{LinearRange, PanelView, View};

/// See the [module](self).
pub(super) struct Scanning;

impl Effect for Scanning {
    fn about(&self) -> About {
        About {
            name: "scanning",
            model: "row scanning: row r is lit in slot r mod n of each scan, n times as bright, pwm_hz scans a second",
            keys: &["panel.scan_rows", "panel.pwm_hz"],
            cost: "one multiplication an LED",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        range.change_by_strays(view.panels.iter().map(|panel| stray(view, panel)))
    }

    fn gain(&self, view: &View, panel: usize) -> f64 {
        1.0 + stray(view, &view.panels[panel])
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        let panels = view
            .panels
            .iter()
            .map(|panel| (panel.panel.scan_rows, panel.panel.pwm_hz))
            .collect();
        formation.led_stages.push(Box::new(Scan { panels }));
    }
}

/// The greatest relative deviation of an exposure's light from its mean: a slot that is missed or seen once more.
fn stray(view: &View, panel: &PanelView) -> f64 {
    if panel.panel.scan_rows < 2 || panel.panel.pwm_hz == 0.0 {
        return 0.0;
    }
    let rows = f64::from(panel.panel.scan_rows);
    ((1.0 - 1.0 / rows) / (panel.panel.pwm_hz * view.exposure.time_s)).min(rows)
}

struct Scan {
    panels: Vec<(u32, f64)>,
}

impl LedStage for Scan {
    fn apply(&self, panel: usize, moment: &Moment, delay_s: &[f64; LEDS], own_light: &mut [f64; LEDS]) {
        let (rows, hz) = self.panels[panel];
        if rows < 2 {
            return;
        }
        let slot = Pulses {
            hz,
            duty: 1.0 / f64::from(rows),
        };
        for (led, (light, delay_s)) in own_light.iter_mut().zip(delay_s).enumerate() {
            let row = (led / SIDE) as u32;
            *light *= slot.during(moment, *delay_s, f64::from(row % rows) / f64::from(rows));
        }
    }
}
