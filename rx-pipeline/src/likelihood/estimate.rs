//! What a search has come to.

use super::crop::Scale;
use super::levels::Levels;
use crate::detect::bits_where;
use crate::spots::OVERLAP;
use link::panel::{LEDS, PanelFrame};

/// LEDs so close to On or Off are decided on (share of the exposure). Higher: faster, and less sure.
const DECIDED: f32 = 0.02;

/// Bits and levels, as far as a search has come.
#[derive(Clone, Copy)]
pub(super) struct Estimate {
    pub levels: Levels,
    /// For which share of the exposure each LED is On: 0 or 1 once it is decided.
    pub share: [f32; LEDS],
    /// Where the corners put the LEDs, in px of the image.
    pub centre: [[f32; 2]; LEDS],
}

impl Estimate {
    pub fn bits(&self) -> PanelFrame {
        bits_where(|led| self.share[led] > 0.5)
    }

    /// On is what is brighter: where the contrast is negative, exchanges On and Off, which changes nothing of the image.
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

    /// Whether each LED is as good as On or Off.
    pub fn is_decided(&self) -> bool {
        self.share.iter().all(|share| share.min(1.0 - share) < DECIDED)
    }
}

/// On or Off, whichever is nearer.
pub(super) fn hard(share: f32) -> f32 {
    if share > 0.5 { 1.0 } else { 0.0 }
}
