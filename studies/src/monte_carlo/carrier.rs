//! A receiver that knows the carrier of a panel.
//!
//! An exposure shows a panel with a carrier at a contrast c, or its complement if c is negative. A receiver that follows the carrier knows
//! c: it inverts complements ([`Renderer::seen`]), and erases readings of less than [`BLIND_CONTRAST`] of the greatest contrast. Over all
//! phases, that is at most this share of the readings, because |c| falls linearly to 0.

use link::panel::{LEDS, PanelFrame};
use rx_pipeline::BLIND_CONTRAST;
use sim::camera::clock::Moment;
use sim::renderer::Renderer;

/// The carrier of the first panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownCarrier {
    /// The least contrast of a reading that counts.
    least: f64,
}

impl KnownCarrier {
    /// The first panel's; `None` for a still panel.
    pub fn of(renderer: &Renderer) -> Option<Self> {
        let view = renderer.view();
        if view.waveform.is_still() {
            return None;
        }
        let symbols = view.exposure.time_s * view.scene.link.symbol_rate_hz;
        // In the middle of a half, an exposure has the greatest contrast.
        let greatest = view.waveform.contrast(1.0 - 0.5 * symbols, 1.0 + 0.5 * symbols).abs();
        Some(Self {
            least: f64::from(BLIND_CONTRAST) * greatest,
        })
    }

    /// The bits as read; those that are erased as shown, so that they do not count as wrong.
    pub fn without_erased(self, renderer: &Renderer, moment: &Moment, read: PanelFrame, shown: PanelFrame) -> PanelFrame {
        let contrasts = renderer.contrasts(0, moment);
        let erased = (0..LEDS).filter(|&led| contrasts[led].abs() < self.least);
        let erased = erased.fold(0, |leds, led| leds | 1 << led);
        PanelFrame::from_bits(read.bits() & !erased | shown.bits() & erased)
    }
}
