//! A change of symbol inside the exposure, because the clocks are not synchronised.

use super::{About, Effect};
use crate::formation::Formation;
use crate::view::{LinearRange, View};

/// See the [module](self).
pub(super) struct SymbolChange;

impl Effect for SymbolChange {
    fn about(&self) -> About {
        About {
            name: "symbol_change",
            model: "an exposure across a symbol change receives each symbol for its share of the time",
            keys: &["link.symbol_rate_hz", "link.phase", "link.clock_ppm", "camera.frame_rate_hz"],
            cost: "one addition an LED",
        }
    }

    /// The whole range if some frame's exposure can hold a change; otherwise 0.
    fn bound_grey(&self, view: &View, range: &LinearRange) -> f64 {
        if straddles(view) { range.range_grey() } else { 0.0 }
    }

    fn include(&self, _view: &View, formation: &mut Formation) {
        formation.mix_symbols = true;
    }
}

/// Whether any frame's exposure can hold a symbol change.
pub(super) fn straddles(view: &View) -> bool {
    let scene = &view.scene;
    let ratio = scene.link.symbol_rate_hz * (1.0 + scene.link.clock_ppm * 1e-6) / scene.camera.frame_rate_hz;
    // The phase is constant only if a frame lasts whole symbols.
    if (ratio - ratio.round()).abs() > 1e-12 {
        return true;
    }
    let moment = crate::camera::clock::Moment::of(scene, &view.exposure, 0, 0);
    moment.since_change_s + moment.exposure_s + scene.camera.readout_s > moment.symbol_s
}
