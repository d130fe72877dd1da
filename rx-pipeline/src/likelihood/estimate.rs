//! The state of a search.

use super::crop::Scale;
use super::levels::Levels;
use crate::detect::bits_where;
use crate::spots::OVERLAP;
use link::panel::{LEDS, PanelFrame};

/// LEDs this close to On or Off count as decided (share of the exposure). Higher: faster, and less sure.
const DECIDED: f32 = 0.02;

/// Bits and levels, as far as a search has got.
#[derive(Clone, Copy)]
pub(super) struct Estimate {
    pub levels: Levels,
    /// The share of the exposure for which each LED is On: 0 or 1 once it is decided.
    pub share: [f32; LEDS],
    /// The positions of the LEDs by the corners, in px of the image.
    pub centre: [[f32; 2]; LEDS],
}

impl Estimate {
    pub fn bits(&self) -> PanelFrame {
        bits_where(|led| self.share[led] > 0.5)
    }

    /// Exchanges On and Off if the contrast is negative, because On is the brighter state. The image does not change.
    pub fn turn_upright(&mut self) {
        let levels = &mut self.levels;
        if levels.contrast < 0.0 {
            levels.off += levels.contrast;
            levels.contrast = -levels.contrast;
            self.share = self.share.map(|share| 1.0 - share);
        }
    }

    /// Whether images of neighbouring LEDs overlap.
    pub fn overlaps(&self, scale: &Scale) -> bool {
        scale.pitch * scale.pitch < OVERLAP * self.levels.variance
    }

    /// Whether each LED is close to On or Off.
    pub fn is_decided(&self) -> bool {
        self.share.iter().all(|share| share.min(1.0 - share) < DECIDED)
    }
}

/// On or Off, whichever is nearer.
pub(super) fn hard(share: f32) -> f32 {
    if share > 0.5 { 1.0 } else { 0.0 }
}
