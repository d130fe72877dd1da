//! The colour filters of a raw frame: a coloured lamp is bright at pixels of its colour only.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct Mosaic;

impl Effect for Mosaic {
    fn about(&self) -> About {
        About {
            name: "mosaic",
            model: "red, green and blue pixels by turns (RGGB; Bayer, US patent 3 971 065), each of which sees its part of the LEDs' own light; \
         ambient light is white",
            keys: &["camera.mosaic", "panel.colour"],
            cost: "the image is drawn once for each colour",
        }
    }

    /// The loss of the colour that sees least.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if !view.scene.camera.mosaic {
            return 0.0;
        }
        let colours = view.panels.iter().flat_map(|panel| panel.panel.colour);
        range.change_by_strays(colours.map(|part| 1.0 - part))
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.mosaic = view.scene.camera.mosaic;
    }
}
