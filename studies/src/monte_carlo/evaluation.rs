//! The results of an evaluation's frames.

use link::panel::{LEDS, PanelFrame};
use rx_pipeline::features::Features;
use serde::{Deserialize, Serialize};

use crate::statistics::{Distinguishability, FrameErrors, Moments, RareErrors, SWARM, SymbolChanges};

/// Frames that one thread processes before their results are merged.
pub const CHUNK: u64 = 256;

/// The number of chunks for a number of frames: the unit of shards and of the saved work of an interrupted run.
pub fn chunks(frames: u64) -> u64 {
    frames.div_ceil(CHUNK)
}

/// The results so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// Features (AGR, GRI) of On LEDs.
    pub on: Moments,
    /// Features (AGR, GRI) of Off LEDs.
    pub off: Moments,
    /// Bit errors by frame.
    pub errors: FrameErrors,
    /// Bit errors of frames across a change of symbols.
    #[serde(default, skip_serializing_if = "SymbolChanges::is_empty")]
    pub symbol_changes: SymbolChanges,
    /// Rare bit errors, reached by splitting: see [`crate::splitting`].
    #[serde(default, skip_serializing_if = "RareErrors::is_empty")]
    pub rare: RareErrors,
}

impl Evaluation {
    /// Adds a frame that shows `bits` and is read as `read`; `is_across`: across a change of symbols. Without features only errors count.
    pub(super) fn push(&mut self, features: Option<&Features>, bits: PanelFrame, read: PanelFrame, is_across: bool) {
        if let Some(features) = features {
            self.on.merge(&class(features, bits));
            self.off.merge(&class(features, PanelFrame::from_bits(!bits.bits())));
        }
        let errors = read.distance(bits);
        self.errors.push(errors);
        self.symbol_changes.push(errors, is_across);
    }

    /// Adds another evaluation of the same setting.
    pub fn merge(&mut self, other: &Self) {
        self.on.merge(&other.on);
        self.off.merge(&other.off);
        self.errors.merge(&other.errors);
        self.symbol_changes.merge(&other.symbol_changes);
        self.rare.merge(&other.rare);
    }

    /// Whether it may have at most `frames` frames, at most 2⁵⁰.
    pub(crate) fn is_within(&self, frames: u64) -> bool {
        self.errors.frames() <= frames
            && self.symbol_changes.are_within(frames)
            && self.on.count() + self.off.count() <= LEDS as u64 * frames
            && self.rare.swarms() <= frames / SWARM as u64
    }

    /// Whether it has exactly `frames` frames: counted ones, or initial ones of swarms.
    pub(crate) fn is_of(&self, frames: u64, rare: bool) -> bool {
        let pairs = self.on.count() + self.off.count();
        if rare {
            let swarms = frames.div_ceil(SWARM as u64);
            self.rare.swarms() == swarms && self.errors.frames() == 0 && pairs == 0
        } else {
            self.rare.is_empty()
                && self.errors.frames() == frames
                && self.symbol_changes.are_among(&self.errors)
                && pairs == LEDS as u64 * frames
        }
    }

    /// Bit errors of the frames that show one symbol; of all frames if that is not known of each.
    pub fn of_one_symbol(&self) -> FrameErrors {
        self.symbol_changes
            .apart(&self.errors)
            .map_or(self.errors, |[of_one_symbol, _]| of_one_symbol)
    }

    /// Bits read wrongly, or brought there by splitting.
    pub fn bit_errors(&self) -> u64 {
        self.errors.errors() + self.rare.errors()
    }

    /// Between- and within-class variance and their ratio.
    pub fn distinguishability(&self) -> Distinguishability {
        Distinguishability::of(&self.on, &self.off)
    }
}

/// The moments of (AGR, GRI) of the cells that are On in `members`.
fn class(features: &Features, members: PanelFrame) -> Moments {
    let mut pairs = [[0.0; 2]; LEDS];
    let mut count = 0;
    for led in (0..LEDS).filter(|&led| members.led(led)) {
        pairs[count] = [features.agr[led].into(), features.gri[led].into()];
        count += 1;
    }
    Moments::of(&pairs[..count])
}
