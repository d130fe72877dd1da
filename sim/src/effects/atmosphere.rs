//! Attenuation by the air between camera and panels, and in lit air before the background (see [`crate::air`]).

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Attenuation;

impl Effect for Attenuation {
    fn about(&self) -> About {
        About {
            name: "atmosphere",
            model: "Beer-Lambert attenuation exp(-beta d) of the light from panels, and in lit air from the background, with exp(-beta 70 m) given",
            keys: &["atmosphere.transmission_at_70m", "pose.distance_m"],
            cost: "none",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let panels = view.air.iter().map(|air| air.transmission);
        range.change_by_factor(panels.fold(view.background_air.transmission, f64::min))
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        for (air, seen) in formation.air.iter_mut().zip(&view.air) {
            air.transmission = seen.transmission;
        }
        formation.background_air.transmission = view.background_air.transmission;
    }
}
