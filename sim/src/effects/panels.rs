//! Several panels in one frame.

use super::Effect;
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct OtherPanels;

impl Effect for OtherPanels {
    fn name(&self) -> &'static str {
        "panels"
    }

    fn model(&self) -> &'static str {
        "panels other than the first, each by its own projection and brightness, the nearer before the farther"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["[[panel]]"]
    }

    fn cost(&self) -> &'static str {
        "as the first panel, for each"
    }

    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if view.panels.len() > 1 { range.range_grey() } else { 0.0 }
    }

    fn include(&self, _view: &View, formation: &mut Formation) {
        formation.other_panels = true;
    }
}
