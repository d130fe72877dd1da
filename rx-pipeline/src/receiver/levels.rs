//! The frame in larger pixels, in levels, so that panels of any size are found: a panel that is too large on one level is small on the
//! next.
//!
//! A search finds panels of 14 to 110 px. The pixels of each level are four times as wide as those of the one before, so that the ranges
//! overlap. A level has a sixteenth as many pixels, so drawing it costs no more than a survey of the frame. For each frame, the
//! levels are searched before the frame itself, because on the level that suits a panel none of its parts look like a panel.

use super::history::{History, SLOTS};
use crate::coarse::Grid;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::locate::{Effort, LocateError, Location, Locator, SearchMemory, Suspects, Workspace};
use crate::profile::Profile;
use crate::spots::Residuals;
use heapless::Vec;

/// Factor of the pixels' side from one level to the next. Larger: fewer levels, with gaps between their ranges.
const LEVEL_SIDE: usize = 4;

/// Number of levels besides the frame itself.
const LEVELS: usize = 2;

pub(super) struct LevelQuery<'a, const PIXELS: usize> {
    pub effort: Effort,
    pub locator: &'a Locator,
    /// Known panels in the frame.
    pub known: &'a [Corners],
    pub residuals: &'a mut Residuals<PIXELS>,
    pub search: &'a mut SearchMemory,
}

impl<const PIXELS: usize> LevelQuery<'_, PIXELS> {
    /// Converts the panel in `frame`, which shows the camera's frame in the pixels of `grid`, to the camera's frame.
    pub fn at(
        &mut self,
        grid: &Grid,
        effort: Effort,
        frame: &Frame<'_>,
        earlier: &[Frame<'_>],
        suspects: &mut Suspects,
        profile: &mut impl Profile,
    ) -> Result<Location, LocateError> {
        let workspace = Workspace {
            residuals: &mut *self.residuals,
            search: &mut *self.search,
        };
        workspace.search.suspects = core::mem::take(suspects);
        let found = if *grid == Grid::FRAME {
            let known = self.known;
            self.locator.search(frame, earlier, known, effort, workspace, profile)
        } else {
            let known: Vec<Corners, MOST_KNOWN> = self
                .known
                .iter()
                .filter_map(|corners| grid.corners_from_frame(corners).ok())
                .take(MOST_KNOWN)
                .collect();
            let locator = self.locator.seen_in(grid);
            locator
                .search(frame, earlier, &known, effort, workspace, profile)
                .and_then(|location| location.in_frame(grid))
        };
        *suspects = core::mem::take(&mut self.search.suspects);
        found
    }
}

/// Maximum number of known panels on a level.
const MOST_KNOWN: usize = 16;

/// The frame and earlier frames in larger pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Levels {
    level: [Level; LEVELS],
}

#[derive(Clone, Debug, Default)]
struct Level {
    history: History,
    suspects: Suspects,
    /// The size of the latest frame; none if it was too small, or if there is no memory.
    size: Option<(usize, usize)>,
}

impl Levels {
    /// The memory for the levels of frames of that size.
    pub fn bytes(size: (usize, usize)) -> usize {
        sizes(size).map(|(width, height)| SLOTS * width * height).iter().sum()
    }

    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Draws all levels of a frame.
    pub fn draw(&mut self, frame: &Frame<'_>, mut buffer: &mut [u8]) {
        let sizes = sizes((frame.width(), frame.height()));
        let mut finer = *frame;
        for (level, size) in self.level.iter_mut().zip(sizes) {
            level.size = None;
            let bytes = (SLOTS * size.0 * size.1).min(buffer.len());
            let (own, rest) = buffer.split_at_mut(bytes);
            buffer = rest;
            let Some(place) = level.history.next(own, size, SLOTS) else {
                return;
            };
            let grid = Grid::of_side(LEVEL_SIDE);
            let Some(drawn) = grid.draw(&finer, [size.0, size.1], place) else {
                return;
            };
            (finer, level.size) = (drawn, Some(size));
        }
    }

    /// The panel on one level, the coarsest first. If time counts, one level in turn is searched as a whole. The others are searched for
    /// changes, because new symbols may always fall on the turns of the same level.
    pub fn find<const PIXELS: usize>(
        &mut self,
        buffer: &[u8],
        query: &mut LevelQuery<'_, PIXELS>,
        profile: &mut impl Profile,
    ) -> Option<Location> {
        (0..LEVELS).rev().find_map(|level| {
            let (turn, number) = match query.effort {
                Effort::Share(number) => (number % LEVELS as u64, number),
                // In two frames of four, no level has its turn.
                Effort::Spare(number) => (number % (2 * LEVELS as u64), number),
                other => return self.find_on(level, other, buffer, query, profile),
            };
            let effort = match turn as usize + level == LEVELS - 1 {
                true => Effort::Level(number),
                false => Effort::Changes,
            };
            self.find_on(level, effort, buffer, query, profile)
        })
    }

    fn find_on<const PIXELS: usize>(
        &mut self,
        level: usize,
        effort: Effort,
        buffer: &[u8],
        query: &mut LevelQuery<'_, PIXELS>,
        profile: &mut impl Profile,
    ) -> Option<Location> {
        let grid = Grid::of_side(LEVEL_SIDE.pow(level as u32 + 1));
        let before = self.level.iter().take(level);
        let start = before
            .filter_map(|level| level.size)
            .map(|(width, height)| SLOTS * width * height)
            .sum::<usize>();
        let level = self.level.get_mut(level)?;
        let size = level.size?;
        let frames = level.history.frames(buffer.get(start..)?, size, SLOTS);
        let (latest, earlier) = frames.split_first()?;
        let suspects = &mut level.suspects;
        query.at(&grid, effort, latest, earlier, suspects, profile).ok()
    }
}

/// The levels' sizes, the finest first.
fn sizes(frame: (usize, usize)) -> [(usize, usize); LEVELS] {
    let mut finer = frame;
    [(); LEVELS].map(|()| {
        finer = (finer.0 / LEVEL_SIDE, finer.1 / LEVEL_SIDE);
        finer
    })
}
