//! Several panels in one frame.

use super::Effect;
use crate::renderer::recipe::Recipe;
use crate::view::View;

/// See the [module](self).
pub struct OtherPanels;

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

    fn bound_grey(&self, view: &View) -> f64 {
        if view.panels.len() > 1 {
            view.range_grey()
        } else {
            0.0
        }
    }

    fn include(&self, _view: &View, recipe: &mut Recipe) {
        recipe.neighbours = true;
    }
}
