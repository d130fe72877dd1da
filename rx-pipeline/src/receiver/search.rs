//! How a receiver comes by a panel that it does not follow yet.

use core::borrow::BorrowMut;

use super::history::History;
use super::outcome::Loss;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::locate::{Effort, Location, Locator, SearchMemory, Workspace};
use crate::profile::Profile;
use crate::spots::Residuals;

/// Where panels come from: [`FrameSearch`] looks for them, [`NoSearch`] waits to be told of one.
///
/// There are no others, as nobody else can name what is asked.
pub trait Search<const PIXELS: usize> {
    /// A panel other than those that are known.
    ///
    /// # Errors
    /// Why there is none.
    fn find(
        &mut self,
        query: Query<'_, '_, PIXELS>,
        profile: &mut impl Profile,
    ) -> Result<Location, Loss>;

    /// Forgets earlier frames.
    fn forget(&mut self);
}

/// What is asked of a search, and the room to work in.
pub struct Query<'a, 'f, const PIXELS: usize> {
    pub(super) number: u64,
    pub(super) frame: &'a Frame<'f>,
    pub(super) locator: &'a Locator,
    pub(super) known: &'a [Corners],
    pub(super) residuals: &'a mut Residuals<PIXELS>,
}

/// No search: panels are read where [`Receiver::place`](super::Receiver::place) says.
///
/// On a microcontroller this leaves the locator's memory and most of its program out.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSearch;

impl<const PIXELS: usize> Search<PIXELS> for NoSearch {
    fn find(&mut self, _: Query<'_, '_, PIXELS>, _: &mut impl Profile) -> Result<Location, Loss> {
        Err(Loss::NoPlace)
    }

    fn forget(&mut self) {}
}

/// Looks through whole frames, as long as fewer panels are followed than there may be.
///
/// `L` is where its [memory](SearchMemory) is: `SearchMemory` itself, `&mut SearchMemory`, or a `Box` of it. `H` keeps the last frames,
/// so that a panel that does not stand out is found by its blinking: anything that lends a slice of bytes.
pub struct FrameSearch<L, H = [u8; 0]> {
    memory: L,
    history: History<H>,
}

impl<L: BorrowMut<SearchMemory>> FrameSearch<L> {
    /// A search that finds panels that stand out in a single frame.
    pub fn new(memory: L) -> Self {
        Self::with_history(memory, [])
    }
}

impl<L: BorrowMut<SearchMemory>, H: BorrowMut<[u8]>> FrameSearch<L, H> {
    /// A search that finds panels by their blinking too, in frames of up to half as many pixels as `history` has bytes; with less
    /// certainty in frames of up to as many.
    pub fn with_history(memory: L, history: H) -> Self {
        Self {
            memory,
            history: History::new(history),
        }
    }
}

impl<const PIXELS: usize, L: BorrowMut<SearchMemory>, H: BorrowMut<[u8]>> Search<PIXELS>
    for FrameSearch<L, H>
{
    fn find(
        &mut self,
        query: Query<'_, '_, PIXELS>,
        profile: &mut impl Profile,
    ) -> Result<Location, Loss> {
        let Query {
            number,
            frame,
            locator,
            known,
            residuals,
        } = query;
        let search = self.memory.borrow_mut();
        let workspace = Workspace { residuals, search };
        let found = self.history.with_earlier(frame, |earlier| {
            locator.search(
                frame,
                earlier,
                known,
                Effort::Share(number),
                workspace,
                profile,
            )
        });
        self.history.keep(frame);
        Ok(found?)
    }

    fn forget(&mut self) {
        self.history.forget();
    }
}
