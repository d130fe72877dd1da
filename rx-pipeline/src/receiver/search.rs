//! The search of a receiver for panels that it does not follow yet.

use core::borrow::BorrowMut;

use super::history::History;
use super::levels::{LevelQuery, Levels};
use super::outcome::Loss;
use crate::coarse::Grid;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::locate::{Effort, LocateError, Location, Locator, SearchMemory, Suspects};
use crate::profile::{Profile, Stage};
use crate::spots::Residuals;

/// Failed searches after which each search covers less (count). More: panels are found in fewer frames, and frames without panels stay
/// expensive for longer.
const PATIENCE_SEARCHES: u32 = 30;
/// Number of earlier frames that show blinking.
const KEPT_FRAMES: usize = 2;

/// The source of panels: [`FrameSearch`] searches for them, [`NoSearch`] waits for a place.
///
/// Other crates cannot implement it, because they cannot name the query.
pub trait Search<const PIXELS: usize> {
    /// Finds a panel other than the known ones.
    ///
    /// # Errors
    /// The reason why there is none.
    fn find(&mut self, query: Query<'_, '_, PIXELS>, profile: &mut impl Profile) -> Result<Location, Loss>;

    /// Forgets earlier frames.
    fn forget(&mut self);
}

/// The query to a search, and its working memory.
pub struct Query<'a, 'f, const PIXELS: usize> {
    pub(super) number: u64,
    pub(super) frame: &'a Frame<'f>,
    pub(super) locator: &'a Locator,
    pub(super) known: &'a [Corners],
    pub(super) residuals: &'a mut Residuals<PIXELS>,
}

/// No search: panels are read at the place that [`Receiver::place`](super::Receiver::place) sets.
///
/// On a microcontroller, this leaves out the locator's memory and most of its program.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSearch;

impl<const PIXELS: usize> Search<PIXELS> for NoSearch {
    fn find(&mut self, _: Query<'_, '_, PIXELS>, _: &mut impl Profile) -> Result<Location, Loss> {
        Err(Loss::NoPlace)
    }

    fn forget(&mut self) {}
}

/// Searches whole frames while fewer panels are followed than there may be, or while the place of one is in doubt.
///
/// `L` is the location of its [memory](SearchMemory): `SearchMemory` itself, `&mut SearchMemory`, or a `Box` of it. `H` stores the last
/// frames, so that a panel that does not stand out is found by its blinking; it is anything that lends a slice of bytes. If it also has
/// room for them in [larger pixels](Self::bytes), panels larger than 110 px are found too.
pub struct FrameSearch<L, H = [u8; 0]> {
    memory: L,
    kept: H,
    history: History,
    levels: Levels,
    suspects: Suspects,
    is_thorough: bool,
    /// Failed searches since the last panel.
    in_vain: u32,
}

impl<L: BorrowMut<SearchMemory>> FrameSearch<L> {
    /// A search for panels of at most 110 px that stand out in a single frame.
    pub fn new(memory: L) -> Self {
        Self::with_history(memory, [])
    }
}

impl<L, H> FrameSearch<L, H> {
    /// The size of `history` for panels of any size, which are also found by their blinking, in frames of that size: 2.2 bytes a pixel.
    pub fn bytes(width: usize, height: usize) -> usize {
        let frames = width.saturating_mul(height).saturating_mul(KEPT_FRAMES);
        frames.saturating_add(Levels::bytes((width, height)))
    }
}

impl<L: BorrowMut<SearchMemory>, H: BorrowMut<[u8]>> FrameSearch<L, H> {
    /// A search that also finds panels by their blinking, in frames of up to half as many pixels as `history` has bytes, and less reliably
    /// in frames of up to as many. With [`FrameSearch::bytes`], it also finds panels larger than 110 px.
    pub fn with_history(memory: L, history: H) -> Self {
        Self {
            memory,
            kept: history,
            history: History::default(),
            levels: Levels::default(),
            suspects: Suspects::default(),
            is_thorough: false,
            in_vain: 0,
        }
    }

    /// The same search, but it examines all candidates in each frame and not only a share of them: for single frames, and if time does not
    /// count.
    pub fn thorough(self) -> Self {
        Self { is_thorough: true, ..self }
    }
}

impl<const PIXELS: usize, L: BorrowMut<SearchMemory>, H: BorrowMut<[u8]>> Search<PIXELS> for FrameSearch<L, H> {
    fn find(&mut self, query: Query<'_, '_, PIXELS>, profile: &mut impl Profile) -> Result<Location, Loss> {
        let Query {
            number,
            frame,
            locator,
            known,
            residuals,
        } = query;
        let size = (frame.width(), frame.height());
        let buffer = self.kept.borrow_mut();
        let for_levels = if buffer.len() >= Self::bytes(size.0, size.1) {
            Levels::bytes(size)
        } else {
            0
        };
        let (for_levels, for_frames) = buffer.split_at_mut(for_levels);
        let first = match self.in_vain {
            _ if self.is_thorough => Effort::Spots,
            PATIENCE_SEARCHES.. => Effort::Spare(number),
            _ => Effort::Share(number),
        };
        let mut query = LevelQuery {
            effort: first,
            locator,
            known,
            residuals,
            search: self.memory.borrow_mut(),
        };
        profile.begins(Stage::Survey);
        self.levels.draw(frame, for_levels);
        profile.ends(Stage::Survey);
        let mut look = |effort| {
            query.effort = effort;
            self.levels.find(for_levels, &mut query, profile).map_or_else(
                || {
                    let earlier = self.history.frames(for_frames, size, KEPT_FRAMES);
                    query.at(&Grid::FRAME, effort, frame, &earlier, &mut self.suspects, profile)
                },
                Ok,
            )
        };
        let found = match look(first) {
            Err(_) if first == Effort::Spots => look(Effort::Full),
            found => found,
        };
        self.history.keep(for_frames, frame, KEPT_FRAMES);
        self.in_vain = match found {
            Ok(_) => 0,
            // A search that costs nothing need not be reduced.
            Err(LocateError::NothingStandsOut) => self.in_vain,
            Err(_) => self.in_vain.saturating_add(1),
        };
        Ok(found?)
    }

    fn forget(&mut self) {
        self.history.forget();
        self.levels.forget();
        self.suspects = Suspects::default();
        self.in_vain = 0;
    }
}
