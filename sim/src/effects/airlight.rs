//! Light scattered into the line of sight by the air before panels and background (see [`crate::air`]).

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Airlight;

impl Effect for Airlight {
    fn about(&self) -> About {
        About {
            name: "airlight",
            model: "Koschmieder 1924: the air adds (1 - exp(-beta d)) of the horizon luminance to panels and background",
            keys: &["atmosphere.airlight", "atmosphere.airlight_cd_m2", "atmosphere.transmission_at_70m"],
            cost: "none",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let panels = view.air.iter().map(|air| air.veil);
        range.change(panels.fold(view.background_air.veil, f64::max))
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        for (air, seen) in formation.air.iter_mut().zip(&view.air) {
            air.veil = seen.veil;
        }
        formation.background_air.veil = view.background_air.veil;
    }
}
