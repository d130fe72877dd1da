//! The result of a detector on one panel.

use super::soft::{limited_to, soft_panel};
use link::orientation::Orientation;
#[cfg(feature = "read-lines")]
use link::panel::SIDE;
use link::panel::{LEDS, PanelFrame, SoftPanel};

/// LEDs are lit if their mean is at least this part of all light there (share).
#[cfg(feature = "carrier")]
const EVEN_MEAN: f32 = 0.1;
/// LEDs are alike if their deviations from their mean are smaller than this (share of the mean, root mean square).
#[cfg(feature = "carrier")]
const EVEN: f32 = 0.1;
/// Minimum probability that the place is the panel's, for its light to be used (probability).
#[cfg(feature = "carrier")]
const SURE_PLACE: f32 = 0.999;

/// The bits of one panel, and how sure they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The detector's decisions on the LEDs.
    pub bits: PanelFrame,
    /// The log-likelihood ratio of each LED, positive for On.
    pub soft: SoftPanel,
    /// The expected share of right bits by the soft values: mean of 1/(1 + exp(−|LLR|)), 0.5 to 1.
    pub confidence: f32,
    /// The difference in light between On and Off LEDs, as a share of their mean light; 0 if the detector does not measure it.
    #[cfg(feature = "carrier")]
    pub modulation: f32,
    /// The light of each LED; `None` if the bits are sure.
    #[cfg(feature = "carrier")]
    pub lights: Option<Lights>,
    /// The two symbols of the exposure, if it seems to show two: no single panel explains the frame as well as panels explained the frames
    /// before it. Only maximum likelihood detects this.
    pub mixed: Option<Mixture>,
}

/// The light of LEDs, independent of their bits, as shares of all light there.
#[cfg(feature = "carrier")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lights {
    /// The difference between each LED and the mean of all.
    pub above_mean: [f32; LEDS],
    /// The mean.
    pub mean: f32,
}

#[cfg(feature = "carrier")]
impl Lights {
    /// Whether LEDs are lit and all alike, as those of a carrier are in an exposure of whole cycles.
    pub fn are_even(&self) -> bool {
        let squares = self.above_mean.iter().map(|light| light * light).sum::<f32>();
        self.mean > EVEN_MEAN && squares < LEDS as f32 * EVEN * EVEN * self.mean * self.mean
    }
}

impl Detection {
    pub(crate) fn new(bits: PanelFrame, llr: [f32; LEDS]) -> Self {
        Self {
            bits,
            soft: soft_panel(&llr),
            confidence: 1.0 - wrong_bits(&llr) / LEDS as f32,
            #[cfg(feature = "carrier")]
            modulation: 0.0,
            #[cfg(feature = "carrier")]
            lights: None,
            mixed: None,
        }
    }

    /// The same reading if its place is the panel's with that probability, 0 to 1, and means nothing otherwise. Unless it is nearly
    /// certain, the light is left out.
    pub fn doubted(&self, probability: f32) -> Self {
        let most = libm::logf((1.0 + probability) / (1.0 - probability).max(f32::MIN_POSITIVE));
        Self {
            #[cfg(feature = "carrier")]
            lights: self.lights.filter(|_| probability >= SURE_PLACE),
            soft: limited_to(&self.soft, most),
            confidence: 0.5 + probability * (self.confidence - 0.5),
            mixed: self.mixed.map(|mixture| Mixture {
                ending: limited_to(&mixture.ending, most),
                beginning: limited_to(&mixture.beginning, most),
                ..mixture
            }),
            ..*self
        }
    }

    /// The same reading with the bits of `other`, which shows the same panel, but no surer than before.
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    pub fn with_bits_of(&self, other: &Self) -> Self {
        let bits = if other.confidence > self.confidence {
            other.doubted((self.confidence - 0.5) / (other.confidence - 0.5))
        } else {
            *other
        };
        Self {
            #[cfg(feature = "carrier")]
            lights: self.lights,
            #[cfg(feature = "carrier")]
            modulation: self.modulation,
            ..bits
        }
    }

    /// The reading with the states of these LEDs inverted.
    #[cfg(feature = "carrier")]
    pub(crate) fn inverted(&self, leds: u64) -> Self {
        Self {
            bits: PanelFrame::from_bits(self.bits.bits() ^ leds),
            soft: self.soft.flipped(leds),
            mixed: self.mixed.map(|mixture| Mixture {
                ending: mixture.ending.flipped(leds),
                beginning: mixture.beginning.flipped(leds),
                ..mixture
            }),
            ..*self
        }
    }

    /// The reading in the panel's own orientation, if this is of a picture that shows the panel in `orientation`.
    pub(crate) fn upright(&self, orientation: Orientation) -> Self {
        Self {
            bits: self.bits.upright(orientation),
            soft: self.soft.upright(orientation),
            #[cfg(feature = "carrier")]
            lights: self.lights.map(|lights| Lights {
                above_mean: core::array::from_fn(|led| lights.above_mean[orientation.place_of(led)]),
                ..lights
            }),
            mixed: self.mixed.map(|mixture| mixture.upright(orientation)),
            ..*self
        }
    }
}

/// The expected number of wrong bits, by their log-likelihood ratios.
pub(crate) fn wrong_bits(llr: &[f32; LEDS]) -> f32 {
    llr.iter().map(|llr| 1.0 / (1.0 + libm::expf(llr.abs()))).sum()
}

/// An exposure that caught the end of one symbol and the beginning of the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// The beginning symbol's part of the exposure, 0 to 1; a half if it is not known. If lines are read out one after another, it is that
    /// of the panel's middle, and may lie outside that range.
    pub share: f32,
    /// The growth of that part from one column of LEDs to the next and from one row to the next, up to 1: 0 if all lines are exposed at
    /// once.
    #[cfg(feature = "read-lines")]
    pub growth: [f32; 2],
    /// The log-likelihood ratios of the symbol that ended, from this exposure alone.
    pub ending: SoftPanel,
    /// The log-likelihood ratios of the symbol that began.
    pub beginning: SoftPanel,
}

impl Mixture {
    /// Two symbols that the detector could not separate.
    pub(crate) const INSEPARABLE: Self = Self {
        share: 0.5,
        #[cfg(feature = "read-lines")]
        growth: [0.0; 2],
        ending: SoftPanel::ERASED,
        beginning: SoftPanel::ERASED,
    };

    /// The mixture in the panel's own orientation, if this is of a picture that shows the panel in `orientation`.
    fn upright(&self, orientation: Orientation) -> Self {
        Self {
            #[cfg(feature = "read-lines")]
            growth: {
                let [across, down] = self.growth;
                match orientation.quarter_turns() {
                    0 => [across, down],
                    1 => [down, -across],
                    2 => [-across, -down],
                    _ => [-down, across],
                }
            },
            ending: self.ending.upright(orientation),
            beginning: self.beginning.upright(orientation),
            ..*self
        }
    }

    /// The share of the exposure for which each LED was On, if that is known.
    pub(crate) fn lit(&self) -> Option<[f32; LEDS]> {
        let (ended, begun) = (self.ending.hard().shares(), self.beginning.hard().shares());
        (*self != Self::INSEPARABLE).then(|| core::array::from_fn(|led| lit(self.share_of(led), ended[led], begun[led])))
    }

    /// The beginning symbol's part of LED `led`'s exposure.
    #[cfg(feature = "read-lines")]
    fn share_of(&self, led: usize) -> f32 {
        let [column, row] = self.growth;
        if self.growth == [0.0; 2] {
            return self.share;
        }
        let middle = 0.5 * (SIDE as f32 - 1.0);
        let [right, below] = [led % SIDE, led / SIDE].map(|at| at as f32 - middle);
        (self.share + column * right + row * below).clamp(0.0, 1.0)
    }

    /// The same if all lines are exposed at once.
    #[cfg(not(feature = "read-lines"))]
    fn share_of(&self, _led: usize) -> f32 {
        self.share
    }
}

/// The share of the exposure for which an LED is On, from its shares in the symbol that ended and in the one that began. The one that began
/// has a `share` of the exposure.
pub(crate) fn lit(share: f32, ended: f32, begun: f32) -> f32 {
    (1.0 - share) * ended + share * begun
}

/// The panel whose LEDs are On if `on` holds.
pub(crate) fn bits_where(on: impl Fn(usize) -> bool) -> PanelFrame {
    PanelFrame::from_bits((0..LEDS).fold(0, |bits, cell| bits | u64::from(on(cell)) << cell))
}

#[cfg(all(test, any(feature = "carrier", feature = "read-lines")))]
mod tests {
    use super::*;

    /// A reading of these bits, all as sure, that has measured the LEDs' light.
    #[cfg(feature = "carrier")]
    fn with_lights(bits: u64, llr: f32) -> Detection {
        Detection {
            lights: Some(Lights {
                above_mean: [0.3; LEDS],
                mean: 0.5,
            }),
            ..Detection::new(PanelFrame::from_bits(bits), [llr; LEDS])
        }
    }

    #[cfg(feature = "carrier")]
    #[test]
    fn a_doubted_reading_says_nothing_of_the_light() {
        let seen = with_lights(7, 9.0);
        assert_eq!(seen.doubted(1.0), seen);
        assert_eq!(seen.doubted(0.9).lights, None);
    }

    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    #[test]
    fn the_bits_of_a_second_reading_are_no_surer_than_those_of_the_first() {
        let reading = |bits: u64, llr: f32| Detection::new(PanelFrame::from_bits(bits), [llr; LEDS]);
        let (first, surer) = (reading(7, 2.0), reading(3, -9.0));
        let both = first.with_bits_of(&surer);
        assert_eq!(both.bits, surer.bits);
        approx::assert_abs_diff_eq!(both.confidence, first.confidence, epsilon = 1e-5);
        // A doubt in its place limits each soft value.
        assert!(both.soft.0[5].unsigned_abs() < surer.soft.0[5].unsigned_abs());
        let less_sure = reading(3, -1.0);
        assert_eq!(first.with_bits_of(&less_sure), less_sure);
    }

    #[cfg(all(feature = "carrier", feature = "maximum-likelihood", feature = "surroundings"))]
    #[test]
    fn a_second_reading_keeps_the_light_of_the_first() {
        let first = with_lights(7, 2.0);
        let second = Detection::new(PanelFrame::from_bits(3), [9.0; LEDS]);
        assert_eq!(first.with_bits_of(&second).lights, first.lights);
    }

    #[cfg(feature = "read-lines")]
    #[test]
    fn what_two_symbols_share_of_an_exposure_is_turned_with_the_panel() {
        let seen = Mixture {
            share: 0.45,
            growth: [0.01, 0.07],
            ..Mixture::INSEPARABLE
        };
        for orientation in (0..4).map(|turns| Orientation::new(turns, false)) {
            let upright = seen.upright(orientation);
            for led in 0..LEDS {
                let there = seen.share_of(orientation.place_of(led));
                assert!((upright.share_of(led) - there).abs() < 1e-6, "{orientation}, LED {led}");
            }
        }
    }
}
