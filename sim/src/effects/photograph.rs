//! A photograph as background.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, Photograph as Picture, View};

/// See the [module](self).
pub(super) struct Photograph;

impl Effect for Photograph {
    fn about(&self) -> About {
        About {
            name: "photograph",
            model: "a photograph behind the panels, its mean at the background reflectance, seen through the air; it has its own blur",
            keys: &["ambient.background_image"],
            cost: "one copy a pixel",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let values = view.photograph.iter().flat_map(Picture::range);
        let change = values.map(|relative| (relative - 1.0).abs() * view.background);
        range.change(change.fold(0.0, f64::max)).min(255.0)
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        for relative in view.photograph.iter().flat_map(Picture::range) {
            range.widen(relative * view.background, view.background_air);
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.photograph = view.photograph.is_some();
    }
}
