//! The working memory of a search.

use super::survey::Tiles;
use super::suspects::Suspects;
use crate::spots::Residuals;

/// Tiles for small bright spots (count): none on microcontrollers, whose searches make do with busy places.
const SPOTTED: usize = if cfg!(feature = "surroundings") { 1 } else { 0 };

/// The memory of a search in frames of any size: 197 kB, 8 kB without the features `large-frames` and `surroundings`. A search also takes
/// up to 100 kB of stack.
pub struct SearchMemory {
    pub(super) busy: Tiles,
    pub(super) spotted: [Tiles; SPOTTED],
    pub(super) changed: Tiles,
    pub(crate) suspects: Suspects,
    /// Number of searches of one changed place.
    pub(super) turns: u64,
}

impl SearchMemory {
    /// A constant, so that it does not pass through the stack.
    const EMPTY: Self = Self {
        busy: Tiles::new(),
        spotted: [const { Tiles::new() }; SPOTTED],
        changed: Tiles::new(),
        suspects: Suspects::NONE,
        turns: 0,
    };

    /// Empty memory. On a computer, `Box::default()` creates it on the heap.
    pub const fn new() -> Self {
        Self::EMPTY
    }
}

impl Default for SearchMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// The memory of a [`Locator`](super::Locator) alone, for windows of up to `PIXELS` around a panel: a [`SearchMemory`] and 8 bytes a pixel.
pub struct LocatorMemory<const PIXELS: usize> {
    pub(super) residuals: Residuals<PIXELS>,
    pub(super) search: SearchMemory,
}

impl<const PIXELS: usize> LocatorMemory<PIXELS> {
    /// Empty memory.
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

/// The parts of a search's memory, which may lie in different places.
pub(crate) struct Workspace<'a, const PIXELS: usize> {
    pub residuals: &'a mut Residuals<PIXELS>,
    pub search: &'a mut SearchMemory,
}
