//! The symbols of a panel in an exposure.

use link::panel::{LEDS, PanelFrame};
use rand::Rng;

use super::{PanelExposure, Renderer};
use crate::camera::clock::Moment;
use crate::random::{Purpose, stream};

impl Renderer {
    /// The exposures of all panels in frame `frame` of a seed: random bits, unless `bits` gives the first panel's.
    pub fn shown(&self, seed: u64, frame: u64, bits: Option<PanelFrame>) -> Vec<PanelExposure> {
        let mut shown = Vec::new();
        self.show(seed, frame, bits, &mut shown);
        shown
    }

    /// As [`Self::shown`], into the memory of the frame before.
    pub fn show(&self, seed: u64, frame: u64, bits: Option<PanelFrame>, shown: &mut Vec<PanelExposure>) {
        let mut random = stream(seed, frame, Purpose::Bits);
        let of_panel = |panel| {
            let drawn = PanelFrame::from_bits(random.next_u64());
            let given = bits.filter(|_| panel == 0);
            self.steady(panel, given.unwrap_or(drawn))
        };
        shown.clear();
        shown.extend((0..self.view.panels.len()).map(of_panel));
    }

    /// The bits of panel `index` in the middle of the exposure, each LED in the middle of its own.
    pub fn truth(&self, index: usize, moment: &Moment, shown: &PanelExposure) -> PanelFrame {
        if self.formation.row_delay_s == 0.0 {
            return shown.symbols[moment.middle_symbol(0.0)];
        }
        let delay_s = self.delays_s(index);
        let on = (0..LEDS).filter(|&led| shown.symbols[moment.middle_symbol(delay_s[led])].led(led));
        PanelFrame::from_bits(on.fold(0, |bits, led| bits | 1 << led))
    }

    /// The bits that the exposure shows of panel `index`: as [`Self::truth`], but complemented for LEDs whose contrast is below 0.
    pub fn seen(&self, index: usize, moment: &Moment, shown: &PanelExposure) -> PanelFrame {
        let truth = self.truth(index, moment, shown);
        if self.formation.waveform.is_still() {
            return truth;
        }
        let contrasts = self.contrasts(index, moment);
        let inverted = (0..LEDS).filter(|&led| contrasts[led] < 0.0);
        PanelFrame::from_bits(inverted.fold(truth.bits(), |bits, led| bits ^ 1 << led))
    }

    /// The contrast with which an exposure shows the symbol in its middle, for each LED of panel `index`: 1 for a still panel, and below 0
    /// if it shows the complement.
    pub fn contrasts(&self, index: usize, moment: &Moment) -> [f64; LEDS] {
        let waveform = self.formation.waveform;
        self.delays_s(index).map(|delay_s| match self.formation.mix_symbols {
            true => moment.contrasts(delay_s, waveform)[moment.middle_symbol(delay_s)],
            false => moment.contrast(delay_s, waveform),
        })
    }

    /// Whether the exposure of any LED of panel `index` is shared between symbols.
    pub fn straddles(&self, index: usize, moment: &Moment) -> bool {
        if !self.formation.mix_symbols {
            return false;
        }
        let shared = |delay_s: &f64| moment.shares(*delay_s).iter().filter(|&&share| share > 0.0).count() > 1;
        if self.formation.row_delay_s == 0.0 {
            return shared(&0.0);
        }
        self.delays_s(index).iter().any(shared)
    }

    /// The delay of each LED's exposure relative to the sensor's first row.
    pub(super) fn delays_s(&self, index: usize) -> [f64; LEDS] {
        let ellipses = &self.view.panels[index].ellipses;
        std::array::from_fn(|led| self.formation.row_delay_s * ellipses[led].centre.y)
    }
}
