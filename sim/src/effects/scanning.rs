//! A row-scanned panel, which never shows all rows at once.
//!
//! `panel.pwm_hz` is then the number of whole scans a second; 0 stands for a scan too fast to matter.

use super::Effect;
use crate::formation::Formation;
use crate::view::{LinearRange, PanelView, View};

/// See the [module](self).
pub(super) struct Scanning;

impl Effect for Scanning {
    fn name(&self) -> &'static str {
        "scanning"
    }

    fn model(&self) -> &'static str {
        "row scanning: row r is lit in slot r mod n of each scan, n times as bright, pwm_hz scans a second"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["panel.scan_rows", "panel.pwm_hz"]
    }

    fn cost(&self) -> &'static str {
        "one multiplication an LED"
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

/// How far the light of an exposure can stray from its mean, relatively: by what a slot that is missed or met once more holds.
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

impl crate::formation::LedStage for Scan {
    fn apply(
        &self,
        panel: usize,
        moment: &crate::camera::clock::Moment,
        delay_s: &[f64; link::panel::LEDS],
        own_light: &mut [f64; link::panel::LEDS],
    ) {
        let (rows, hz) = self.panels[panel];
        if rows < 2 {
            return;
        }
        let slot = super::pwm::Pulses {
            hz,
            duty: 1.0 / f64::from(rows),
        };
        for (led, (light, delay_s)) in own_light.iter_mut().zip(delay_s).enumerate() {
            let row = (led / link::panel::SIDE) as u32;
            *light *= slot.during(moment, *delay_s, f64::from(row % rows) / f64::from(rows));
        }
    }
}
