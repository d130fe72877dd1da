//! What a detector has learnt from a panel's frames.

use super::level_prior::LevelPrior;

/// What a detector has learnt from a panel's frames. It can be taken out, kept and given back, to the same detector or to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Experience {
    pub(super) levels: LevelPrior,
    /// Whether what stands around the panel is as plain as what is between its LEDs.
    pub(super) is_plain_around: bool,
}

impl Experience {
    /// That of one who has seen no frame.
    pub const NONE: Self = Self {
        levels: LevelPrior::NONE,
        is_plain_around: false,
    };
}
