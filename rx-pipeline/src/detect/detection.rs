//! What a detector says of a panel.

use super::soft::soft_panel;
use link::panel::{LEDS, PanelFrame, SoftPanel};

/// The bits of one panel, and how sure they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The detector's decision on each LED.
    pub bits: PanelFrame,
    /// The log-likelihood ratio of each LED, positive for On.
    pub soft: SoftPanel,
    /// The share of bits that are right if the soft values are: mean of 1/(1 + exp(−|LLR|)), 0.5 to 1.
    pub confidence: f32,
    /// The two symbols that the exposure caught, if it seems to have: no single panel explains the frame as well as panels
    /// explained those before it. Only maximum likelihood can tell.
    pub mixed: Option<Mixture>,
}

impl Detection {
    pub(crate) fn new(bits: PanelFrame, llr: [f32; LEDS]) -> Self {
        Self {
            bits,
            soft: soft_panel(&llr),
            confidence: 1.0 - wrong_bits(&llr) / LEDS as f32,
            mixed: None,
        }
    }
}

/// How many bits are wrong by their log-likelihood ratios.
pub(crate) fn wrong_bits(llr: &[f32; LEDS]) -> f32 {
    llr.iter()
        .map(|llr| 1.0 / (1.0 + libm::expf(llr.abs())))
        .sum()
}

/// What an exposure says that caught the end of one symbol and the beginning of the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// The part of the exposure that is the beginning symbol's, 0 to 1; a half where that is not known.
    pub share: f32,
    /// The log-likelihood ratios of the symbol that ended, by this exposure alone.
    pub ending: SoftPanel,
    /// Those of the symbol that began.
    pub beginning: SoftPanel,
}

impl Mixture {
    /// Two symbols that cannot be told apart.
    pub const INSEPARABLE: Self = Self {
        share: 0.5,
        ending: SoftPanel::ERASED,
        beginning: SoftPanel::ERASED,
    };

    /// The share of the exposure for which each LED was On, if that is known.
    pub(crate) fn lit(&self) -> Option<[f32; LEDS]> {
        let (ended, begun) = (self.ending.hard().shares(), self.beginning.hard().shares());
        (*self != Self::INSEPARABLE)
            .then(|| core::array::from_fn(|led| lit(self.share, ended[led], begun[led])))
    }
}

/// The share of the exposure for which an LED is On, from its shares in the symbol that ended and in the one that began, of which
/// the exposure has a `share`.
pub(crate) fn lit(share: f32, ended: f32, begun: f32) -> f32 {
    (1.0 - share) * ended + share * begun
}

/// The panel of which the LEDs are On for which that holds.
pub(crate) fn bits_where(on: impl Fn(usize) -> bool) -> PanelFrame {
    PanelFrame::from_bits((0..LEDS).fold(0, |bits, cell| bits | u64::from(on(cell)) << cell))
}
