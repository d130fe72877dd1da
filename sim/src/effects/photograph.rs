//! A photograph as background.

use super::Effect;
use crate::renderer::recipe::Recipe;
use crate::view::{Photograph as Picture, View};

/// See the [module](self).
pub struct Photograph;

impl Effect for Photograph {
    fn name(&self) -> &'static str {
        "photograph"
    }

    fn model(&self) -> &'static str {
        "a photograph behind the panels, its mean at the background reflectance, seen through the air; it has its own blur"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["ambient.background_image"]
    }

    fn cost(&self) -> &'static str {
        "one copy a pixel"
    }

    fn bound_grey(&self, view: &View) -> f64 {
        let range = view.photograph.iter().flat_map(Picture::range);
        let change = range.map(|relative| (relative - 1.0).abs() * view.background);
        view.change(change.fold(0.0, f64::max)).min(255.0)
    }

    fn include(&self, view: &View, recipe: &mut Recipe) {
        recipe.photograph = view.photograph.is_some();
    }
}
