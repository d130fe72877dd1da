//! A receiver that knows the carrier of a panel.
//!
//! An exposure shows a panel with a carrier at a contrast c, or its complement if c is negative. A receiver that follows the carrier knows
//! c: it inverts complements, and erases readings of less than [`BLIND_CONTRAST`] of the greatest contrast. Over all phases, that is at
//! most this share of the readings, because |c| falls linearly to 0.

use link::panel::PanelFrame;
use rx_pipeline::BLIND_CONTRAST;
use sim::camera::clock::Moment;
use sim::renderer::Renderer;

/// The carrier of the first panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownCarrier {
    /// The least contrast of a reading that counts.
    least: f64,
}

/// The relation of a panel to what an exposure shows of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Signs {
    /// LEDs that show the complement of their bits.
    inverted: u64,
    /// LEDs that show too little.
    blind: u64,
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

    /// The signs of an exposure.
    pub fn signs(self, renderer: &Renderer, moment: &Moment) -> Signs {
        let contrasts = renderer.contrasts(0, moment);
        let leds = |is_meant: &dyn Fn(f64) -> bool| {
            let meant = contrasts.iter().enumerate().filter(|&(_, &contrast)| is_meant(contrast));
            meant.fold(0, |leds, (led, _)| leds | 1 << led)
        };
        Signs {
            inverted: leds(&|contrast| contrast < 0.0),
            blind: leds(&|contrast| contrast.abs() < self.least),
        }
    }
}

impl Signs {
    /// The bits that an exposure shows of a panel.
    pub fn shown(self, bits: PanelFrame) -> PanelFrame {
        PanelFrame::from_bits(bits.bits() ^ self.inverted)
    }

    /// The bits as read; erased ones as shown, so that they do not count as wrong.
    pub fn without_erased(self, read: PanelFrame, shown: PanelFrame) -> PanelFrame {
        PanelFrame::from_bits(read.bits() & !self.blind | shown.bits() & self.blind)
    }
}
