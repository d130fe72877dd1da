//! Several panels in one frame.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct OtherPanels;

impl Effect for OtherPanels {
    fn about(&self) -> About {
        About {
            name: "panels",
            model: "panels other than the first, each by its own projection and brightness, the nearer before the farther",
            keys: &["[[panel]]"],
            cost: "as the first panel, for each",
        }
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if view.panels.len() > 1 { range.range_grey() } else { 0.0 }
    }

    fn include(&self, _view: &View, formation: &mut Formation) {
        formation.other_panels = true;
    }
}
