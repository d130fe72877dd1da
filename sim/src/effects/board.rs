//! A board behind the LEDs.

use super::{About, Effect};
use crate::air::Air;
use crate::formation::Formation;
use crate::view::{LinearRange, PanelView, View};

/// See the [module](self).
pub(super) struct Board;

impl Effect for Board {
    fn about(&self) -> About {
        About {
            name: "board",
            model: "an opaque board of 8 x 8 pitches behind the LEDs, lit by the ambient light",
            keys: &["panel.board_reflectance"],
            cost: "some 100 chords, drawn once for each moment of the exposure",
        }
    }

    /// Against the plain background: the air may attenuate both, veil both, or neither. A photograph or another panel can differ by the
    /// whole range.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        let difference = |(panel, air): (&PanelView, &Air)| {
            let Some(reflectance) = panel.panel.board_reflectance else {
                return 0.0;
            };
            if view.photograph.is_some() || range.layers > 1 {
                return range.peak - range.floor;
            }
            let board = view.exposure.reflected(&view.scene, reflectance);
            let [before, behind] = [*air, view.background_air];
            let without_veil = |air: Air| Air { veil: 0.0, ..air };
            let without_loss = |air: Air| Air { transmission: 1.0, ..air };
            [
                (Air::NONE, Air::NONE),
                (without_veil(before), without_veil(behind)),
                (without_loss(before), without_loss(behind)),
                (before, behind),
            ]
            .map(|(before, behind)| before.through(board) - behind.through(view.background))
            .into_iter()
            .fold(0.0, |most: f64, difference| most.max(difference.abs()))
        };
        let panels = view.panels.iter().zip(&view.air);
        range.change(panels.map(difference).fold(0.0, f64::max))
    }

    fn widen(&self, view: &View, range: &mut LinearRange) {
        for (light, air) in lights(view).zip(&view.air) {
            if let Some(light) = light {
                range.widen(light, *air);
            }
        }
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        formation.boards = lights(view).collect();
    }
}

/// The linear value of each panel's board, if it has one.
fn lights(view: &View) -> impl Iterator<Item = Option<f64>> {
    let reflectances = view.panels.iter().map(|panel| panel.panel.board_reflectance);
    reflectances.map(|board| Some(view.exposure.reflected(&view.scene, board?)))
}
