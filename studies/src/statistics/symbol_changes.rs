//! Bit errors of frames that are exposed across a change of symbols. Such a frame shows two symbols at once, so that its reading does not
//! measure how well one is read.

use serde::{Deserialize, Serialize};

use super::FrameErrors;

/// The frames across a change, among others.
///
/// ```
/// use studies::statistics::{FrameErrors, SymbolChanges};
/// let (mut all, mut changes) = (FrameErrors::default(), SymbolChanges::default());
/// for (errors, is_across) in [(0, false), (30, true), (1, false)] {
///     all.push(errors);
///     changes.push(errors, is_across);
/// }
/// let [one_symbol, across] = changes.apart(&all).expect("all were looked at");
/// assert_eq!((one_symbol.frames(), one_symbol.errors()), (2, 1));
/// assert_eq!((across.frames(), across.errors()), (1, 30));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SymbolChanges {
    /// Frames that are known to be across a change or not.
    known: u64,
    across: FrameErrors,
}

impl SymbolChanges {
    /// Adds a frame with its bit errors.
    pub fn push(&mut self, errors: u32, is_across: bool) {
        self.known += 1;
        if is_across {
            self.across.push(errors);
        }
    }

    /// Adds all frames of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.known += other.known;
        self.across.merge(&other.across);
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether they may have at most `frames` frames.
    pub(crate) fn are_within(&self, frames: u64) -> bool {
        self.known <= frames && self.across.frames() <= self.known
    }

    /// Whether they may be among those frames.
    pub(crate) fn are_among(&self, all: &FrameErrors) -> bool {
        self.are_within(all.frames()) && all.without(&self.across).is_some()
    }

    /// The frames of one symbol, and those across a change; `None` if that is not known for each frame, as in files of earlier versions.
    pub fn apart(&self, all: &FrameErrors) -> Option<[FrameErrors; 2]> {
        let rest = all.without(&self.across)?;
        (self.known == all.frames()).then_some([rest, self.across])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_were_not_looked_at_are_neither() {
        let (mut all, mut changes) = (FrameErrors::default(), SymbolChanges::default());
        assert!(changes.is_empty() && changes.apart(&all).is_some());
        all.push(2);
        assert!(changes.are_among(&all) && changes.apart(&all).is_none());
        changes.push(3, true);
        assert!(!changes.are_among(&all), "none has three errors");
        all.push(3);
        let mut both = changes;
        assert!(both.are_among(&all) && both.apart(&all).is_none());
        both.merge(&changes);
        assert!(!both.are_among(&all), "only one has three errors");
    }
}
