//! The working memory of a search.

use super::survey::Tiles;
use super::suspects::Suspects;
use crate::spots::Residuals;

/// What a search through frames of any size needs: 131 kB, 8 kB without the feature `large-frames`. A search also takes up to 100 kB of stack.
pub struct SearchMemory {
    pub(super) busy: Tiles,
    pub(super) changed: Tiles,
    pub(crate) suspects: Suspects,
}

impl SearchMemory {
    /// A constant, so that it is not put together on the stack.
    const EMPTY: Self = Self {
        busy: Tiles::new(),
        changed: Tiles::new(),
        suspects: Suspects::NONE,
    };

    /// Memory that holds nothing. On a computer, `Box::default()` makes it where it stays.
    pub const fn new() -> Self {
        Self::EMPTY
    }
}

impl Default for SearchMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// What a [`Locator`](super::Locator) by itself needs, for windows of up to `PIXELS` around a panel: a [`SearchMemory`] and 8 bytes a
/// pixel.
pub struct LocatorMemory<const PIXELS: usize> {
    pub(super) residuals: Residuals<PIXELS>,
    pub(super) search: SearchMemory,
}

impl<const PIXELS: usize> LocatorMemory<PIXELS> {
    /// Memory that holds nothing.
    pub const fn new() -> Self {
        Self {
            residuals: Residuals::new(),
            search: SearchMemory::new(),
        }
    }
}

impl<const PIXELS: usize> Default for LocatorMemory<PIXELS> {
    fn default() -> Self {
        Self::new()
    }
}

/// The parts of the memory that a search works in, wherever they lie.
pub(crate) struct Workspace<'a, const PIXELS: usize> {
    pub residuals: &'a mut Residuals<PIXELS>,
    pub search: &'a mut SearchMemory,
}
