//! Stub of a panel's surroundings, for programs without that feature; it takes no memory.

use crate::frame::Frame;
use crate::lattice::Lattice;
use link::panel::PanelFrame;

/// A stub that never becomes known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings;

/// A stub of a picture.
pub(crate) struct Tiles;

/// A stub of a place.
#[derive(Clone, Debug)]
pub(crate) struct Placement;

impl Tiles {
    pub const EMPTY: Self = Self;
}

impl Placement {
    pub fn elsewhere(&self, _: &Lattice) -> Option<&Lattice> {
        None
    }

    pub fn confidence(&self, _: &Lattice) -> f32 {
        1.0
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

    pub fn place(&self, _: &Frame<'_>, _: &Lattice, _: &Lattice, _: f32, _: &mut Tiles) -> Placement {
        Placement
    }
}
