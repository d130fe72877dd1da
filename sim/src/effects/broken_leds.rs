//! Faulty LEDs: dead ones, stuck ones, a dim row.

use link::panel::{LEDS, SIDE};
use rand::seq::SliceRandom;

use super::{About, Effect};
use crate::formation::{Formation, LedStage};
use crate::random::{Purpose, stream};
use crate::scene::{Leds, Panel};
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct BrokenLeds;

impl Effect for BrokenLeds {
    fn about(&self) -> About {
        About {
            name: "broken_leds",
            model: "dead LEDs give no light of their own, stuck ones always do, a dim row gives a part of it; which ones, the \
         panel's seed or a list says",
            keys: &[
                "panel.dead_leds",
                "panel.stuck_leds",
                "panel.dim_row",
                "panel.dim_row_light",
                "panel.seed",
            ],
            cost: "one look at each LED",
        }
    }

    /// The missing or excess light of the worst LED.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let worst = faults(view).flat_map(|faults| faults.map(Fault::most));
        range.change_by_strays(worst)
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.led_stages.push(Box::new(LedFaults {
            panels: faults(view).collect(),
        }));
    }
}

/// The fault of one LED.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    /// Its own light relative to an intact LED's; 1 for an intact one.
    Dimmed(f64),
    /// It is always on.
    Stuck,
}

impl Fault {
    /// The greatest difference of its own light from an intact LED's, relative to the latter's On light.
    fn most(self) -> f64 {
        match self {
            Self::Dimmed(part) => 1.0 - part,
            Self::Stuck => 1.0,
        }
    }
}

fn faults(view: &View) -> impl Iterator<Item = [Fault; LEDS]> {
    let panels = view.panels.iter().enumerate();
    panels.map(|(index, panel)| faults_of(&panel.panel, index))
}

fn faults_of(panel: &Panel, index: usize) -> [Fault; LEDS] {
    let mut order: [u8; LEDS] = std::array::from_fn(|led| led as u8);
    order.shuffle(&mut stream(panel.seed.into(), index as u64, Purpose::BrokenLeds));
    let mut faults = std::array::from_fn(|led| match panel.dim_row {
        Some(row) if led / SIDE == usize::from(row) => Fault::Dimmed(panel.dim_row_light),
        _ => Fault::Dimmed(1.0),
    });
    let dead = choose(&panel.dead_leds, order.iter());
    // From the other end, so that no LED is both dead and stuck.
    let stuck = choose(&panel.stuck_leds, order.iter().rev());
    dead.into_iter().for_each(|led| faults[led] = Fault::Dimmed(0.0));
    stuck.into_iter().for_each(|led| faults[led] = Fault::Stuck);
    faults
}

/// The selected LEDs: those of the list, or the first of the panel's `order`.
fn choose<'a>(leds: &Leds, order: impl Iterator<Item = &'a u8>) -> Vec<usize> {
    match leds {
        Leds::Count(count) => order.take(usize::from(*count)).map(|&led| led.into()).collect(),
        Leds::List(list) => list.iter().map(|&led| usize::from(led) % LEDS).collect(),
    }
}

struct LedFaults {
    panels: Vec<[Fault; LEDS]>,
}

impl LedStage for LedFaults {
    fn apply(&self, panel: usize, _moment: &crate::camera::clock::Moment, _delay_s: &[f64; LEDS], own_light: &mut [f64; LEDS]) {
        for (light, fault) in own_light.iter_mut().zip(&self.panels[panel]) {
            match fault {
                Fault::Dimmed(part) => *light *= part,
                Fault::Stuck => *light = 1.0,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(panel: &Panel, index: usize, fault: Fault) -> usize {
        let faults = faults_of(panel, index);
        faults.iter().filter(|&&other| other == fault).count()
    }

    #[test]
    fn as_many_are_broken_as_the_scene_says_and_not_always_the_same() {
        let panel = |seed| Panel {
            seed,
            dead_leds: Leds::Count(40),
            stuck_leds: Leds::Count(24),
            ..Panel::default()
        };
        assert_eq!(count(&panel(1), 0, Fault::Dimmed(0.0)), 40);
        assert_eq!(count(&panel(1), 0, Fault::Stuck), 24);
        assert_eq!(faults_of(&panel(1), 0), faults_of(&panel(1), 0));
        assert_ne!(faults_of(&panel(1), 0), faults_of(&panel(2), 0));
        assert_ne!(faults_of(&panel(1), 0), faults_of(&panel(1), 1));
    }

    #[test]
    fn a_list_and_a_row_mean_the_leds_they_name() {
        let panel = Panel {
            dead_leds: Leds::List(vec![3, 63]),
            stuck_leds: Leds::List(vec![17]),
            dim_row: Some(2),
            dim_row_light: 0.6,
            ..Panel::default()
        };
        let faults = faults_of(&panel, 0);
        assert_eq!([faults[3], faults[63]], [Fault::Dimmed(0.0); 2]);
        assert_eq!([faults[16], faults[17]], [Fault::Dimmed(0.6), Fault::Stuck]);
        assert_eq!(count(&panel, 0, Fault::Dimmed(1.0)), 64 - 3 - 7);
    }
}
