//! Confirmation: the panel that a single frame shows near a given place.

use super::pose_candidates::{Ground, View};
use super::survey::noise;
use super::verification::VerifiedLattice;
use super::{Attempt, LocateError, Location, Locator, LocatorMemory};
use crate::coarse::Grid;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::lattice::Lattice;

/// The side of a panel above which it is examined in larger pixels (px). Higher: slower, and more memory for residuals.
const LARGEST_PX: f32 = 90.0;
/// Room around the outer LEDs in larger pixels, for lines beyond the lattice (pitches).
const ROOM: f32 = 5.0;
/// Grounds to remove, one after another: the likeliest first.
const GROUNDS: [Ground; 4] = [Ground::Around, Ground::Edges, Ground::Smooth, Ground::Holes];

impl Locator {
    /// The panel that a single frame shows at `corners` or up to about a pitch away, by the criteria of a search, and numbered from the same
    /// corner. Panels larger than 90 px are drawn into `pixels` in larger pixels: as many bytes as the frame has pixels suffice.
    ///
    /// ```
    /// use link::camera::Camera;
    /// use rx_pipeline::{corners::Corners, frame::Frame, locate::{Locator, LocatorMemory}};
    /// let mut memory = Box::new(LocatorMemory::<25_600>::new());
    /// let plain = [118; 64 * 64];
    /// let corners = Corners::new([[10.0, 10.0], [45.0, 10.0], [45.0, 45.0], [10.0, 45.0]])?;
    /// let frame = Frame::new(&plain, 64, 64)?;
    /// assert!(Locator::new(Camera::default())?.locate_at(&frame, &corners, &mut memory, &mut []).is_err());
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The first [`LocateError`] of the grounds that it was tried with; [`LocateError::NoLattice`] if `pixels` is too small.
    pub fn locate_at<const N: usize>(
        &self,
        frame: &Frame<'_>,
        corners: &Corners,
        memory: &mut LocatorMemory<N>,
        pixels: &mut [u8],
    ) -> Result<Location, LocateError> {
        let lattice = Lattice::through(corners);
        let [width, height] = lattice.extent(0.0);
        let side = libm::ceilf(width.max(height) / LARGEST_PX).max(1.0) as usize;
        if side == 1 {
            return self.best_near(frame, &lattice, memory);
        }
        let extent = lattice.extent(ROOM);
        let origin = [0, 1].map(|axis| (lattice.centre[axis] - 0.5 * extent[axis]).max(0.0) as i32);
        let limit = [frame.width(), frame.height()];
        let size = [0, 1].map(|axis| limit[axis].saturating_sub(origin[axis] as usize).min(extent[axis] as usize) / side);
        let grid = Grid { side, origin };
        let drawn = grid.draw(frame, size, pixels).ok_or(LocateError::NoLattice)?;
        let found = self.seen_in(&grid).best_near(&drawn, &grid.lattice_from_frame(&lattice), memory)?;
        found.in_frame(&grid)
    }

    /// The best panel near a lattice, over all grounds.
    fn best_near<const N: usize>(
        &self,
        frame: &Frame<'_>,
        lattice: &Lattice,
        memory: &mut LocatorMemory<N>,
    ) -> Result<Location, LocateError> {
        let noise_grey = noise(frame);
        let mut attempt = Attempt::single(self, &mut memory.residuals);
        let mut best: Option<VerifiedLattice> = None;
        for ground in GROUNDS {
            let view = View {
                ground,
                ..self.view(frame, None, noise_grey)
            };
            for trial in view.trials(lattice) {
                let pose = view.sharpened(lattice, &trial.widths_px, 0.0).ok_or(LocateError::NoLattice);
                match pose.and_then(|pose| attempt.verified(&view, trial.scope, &pose)) {
                    Ok(verified) if verified.is_clear() => return Ok(verified.location()),
                    Ok(verified) if best.as_ref().is_none_or(|best| verified.is_better_than(best)) => best = Some(verified),
                    Ok(_) => {}
                    Err(why) => {
                        attempt.failure.get_or_insert(why);
                    }
                }
            }
        }
        best.map(|verified| verified.location()).ok_or_else(|| attempt.failure())
    }
}
