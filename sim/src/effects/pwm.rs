//! Dimming by pulses: the luminance of an exposure depends on the phase and number of its periods.
//!
//! The duty is the luminance over the panel's full luminance, or, if that is unlimited, over the luminance of the highest ratio.

use link::panel::LEDS;

use super::{About, Effect};
use crate::camera::clock::Moment;
use crate::formation::{Formation, LedStage};
use crate::l2a;
use crate::scene::{Panel, Scene};
use crate::view::{LinearRange, PanelView, View};

/// See the [module](self).
pub(super) struct Pwm;

impl Effect for Pwm {
    fn about(&self) -> About {
        About {
            name: "pwm",
            model: "the part of the dimming pulses that falls into the exposure, over its mean",
            keys: &[
                "panel.pwm_hz",
                "panel.luminance_max_cd_m2",
                "camera.exposure_max_s",
                "camera.exposure_s",
            ],
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
        let panels = view.panels.iter().map(|panel| {
            (panel.panel.scan_rows < 2).then(|| Pulses {
                hz: panel.panel.pwm_hz,
                duty: duty(&view.scene, panel),
            })
        });
        formation.led_stages.push(Box::new(Drive { panels: panels.collect() }));
    }
}

/// The greatest relative deviation of an exposure's light from its mean: (1 − duty) of a period, or duty of one, whichever is less, over
/// duty·exposure.
fn stray(view: &View, panel: &PanelView) -> f64 {
    if panel.panel.pwm_hz == 0.0 || panel.panel.scan_rows > 1 {
        return 0.0;
    }
    let duty = duty(&view.scene, panel);
    (duty.min(1.0 - duty) / (panel.panel.pwm_hz * view.exposure.time_s * duty)).min(1.0 / duty)
}

fn duty(scene: &Scene, panel: &PanelView) -> f64 {
    let wanted = panel.l2a * scene.ambient.illuminance_lx * panel.panel.reflectance;
    (wanted / l2a::full_luminance_cd_m2(scene, &panel.panel)).clamp(1e-6, 1.0)
}

/// Pulses of a frequency and a duty, the first starting at time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulses {
    /// Pulses a second; 0: steady light.
    pub hz: f64,
    /// The lit part of a period, above 0.
    pub duty: f64,
}

impl Pulses {
    /// The pulses of a panel's LEDs, dimmed by PWM or scanned row by row; `None` if their light is steady.
    pub fn of(view: &View, panel: &PanelView) -> Option<Self> {
        let Panel { pwm_hz, scan_rows, .. } = panel.panel;
        (pwm_hz > 0.0).then(|| Self {
            hz: pwm_hz,
            duty: match scan_rows {
                0 | 1 => duty(&view.scene, panel),
                rows => 1.0 / f64::from(rows),
            },
        })
    }

    /// The greatest relative deviation of an exposure's light from its mean, over all phases of the start: 0 for a whole number of periods.
    ///
    /// ```
    /// use sim::effects::Pulses;
    /// let pulses = Pulses { hz: 200.0, duty: 0.5 };
    /// assert_eq!(pulses.stray(0.01), 0.0);
    /// // One and a half pulses: between one and two.
    /// assert!((pulses.stray(0.0075) - 1.0 / 3.0).abs() < 1e-9);
    /// ```
    pub fn stray(&self, exposure_s: f64) -> f64 {
        let periods = self.hz * exposure_s;
        let rest = periods.fract();
        let (least, most) = ((rest + self.duty - 1.0).max(0.0), rest.min(self.duty));
        let mean = rest * self.duty;
        (most - mean).max(mean - least) / (periods * self.duty)
    }

    /// The light of an exposure that starts `delay_s` after `moment`, relative to the long-term mean, for pulses delayed by `late` of a
    /// period. The pulses follow the transmitter's clock.
    pub fn during(&self, moment: &Moment, delay_s: f64, late: f64) -> f64 {
        let rate = moment.transmitter_rate;
        self.received((moment.start_s + delay_s) * rate, moment.exposure_s * rate, late)
    }

    /// The light between two times relative to its long-term mean, for pulses delayed by `late` of a period.
    pub fn received(&self, start_s: f64, length_s: f64, late: f64) -> f64 {
        if self.hz <= 0.0 {
            return 1.0;
        }
        let lit = |time_s: f64| {
            let periods = time_s * self.hz - late;
            (periods.floor() * self.duty) + periods.rem_euclid(1.0).min(self.duty)
        };
        (lit(start_s + length_s) - lit(start_s)) / (length_s * self.hz * self.duty)
    }
}

struct Drive {
    panels: Vec<Option<Pulses>>,
}

impl LedStage for Drive {
    fn apply(&self, panel: usize, moment: &Moment, delay_s: &[f64; LEDS], own_light: &mut [f64; LEDS]) {
        if let Some(pulses) = self.panels[panel] {
            for (light, delay_s) in own_light.iter_mut().zip(delay_s) {
                *light *= pulses.during(moment, *delay_s, 0.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Pulses;

    #[test]
    fn no_exposure_strays_further_than_is_said_and_some_do_as_far() {
        for (hz, duty, exposure_s) in [(1000.0, 0.25, 0.0024), (90.0, 0.7, 0.001), (333.0, 0.03, 0.01)] {
            let pulses = Pulses { hz, duty };
            let starts = (0..10_000).map(|step| f64::from(step) / (1e4 * hz));
            let light = starts.map(|start| pulses.received(start, exposure_s, 0.0));
            let most = light.fold(0.0, |most: f64, light| most.max((light - 1.0).abs()));
            assert!((most - pulses.stray(exposure_s)).abs() < 1e-3 * most, "{most}");
        }
    }

    #[test]
    fn whole_periods_give_the_mean_and_half_ones_do_not() {
        let pulses = Pulses { hz: 1000.0, duty: 0.25 };
        for phase in 0..10 {
            let start = f64::from(phase) * 1e-4;
            assert!((pulses.received(start, 0.003, 0.0) - 1.0).abs() < 1e-9);
        }
        assert!((pulses.received(0.0, 0.000_5, 0.0) - 2.0).abs() < 1e-9);
        assert!((pulses.received(0.000_5, 0.000_5, 0.0)).abs() < 1e-9);
    }
}
