//! What stands where a panel's surroundings would, in programs that leave them out: nothing, and it takes no room.

use crate::frame::Frame;
use crate::lattice::Lattice;
use link::panel::PanelFrame;

/// No surroundings: they never get known, so that nobody asks them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings;

/// No room for a picture.
pub(crate) struct Tiles;

/// No place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub lattice: Lattice,
    pub rival: Option<(Lattice, f32)>,
}

impl Tiles {
    pub const EMPTY: Self = Self;
}

impl Placement {
    pub fn is_off(&self, _: &Lattice) -> bool {
        false
    }
}

impl Surroundings {
    pub const UNKNOWN: Self = Self;

    pub fn is_known(&self) -> bool {
        false
    }

    pub fn learn(&mut self, _: &Frame<'_>, _: &Lattice, _: PanelFrame) {}

    pub fn agrees(&self, _: &Frame<'_>, _: &Lattice) -> bool {
        false
    }

    pub fn place(&self, _: &Frame<'_>, expected: &Lattice, _: f32, _: &mut Tiles) -> Placement {
        Placement {
            lattice: *expected,
            rival: None,
        }
    }
}
