//! The view in which a followed panel is read: the frame itself, or larger pixels around the panel.

use super::outcome::Loss;
use crate::cells::{CellsError, ends};
use crate::coarse::Grid;
use crate::corners::Corners;
use crate::frame::Frame;
use crate::lattice::Lattice;
use crate::track::{RIM, TrackError};

/// The size of pixels changes only if the pitch exceeds the limit by more than this (share). Higher: it changes less often as a panel grows
/// and shrinks.
const HYSTERESIS: f32 = 0.1;
/// Room around the panel that is drawn in larger pixels, and the part of it that must remain before another area is drawn (pitches). More:
/// farther jumps can be followed, but slower.
const ROOM: [f32; 2] = [2.0, 1.0];

/// The whole frame, or part of it in larger pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    pub grid: Grid,
    /// Columns and rows.
    pub size: [usize; 2],
}

impl View {
    /// The whole frame in its own pixels.
    pub const fn whole((width, height): (usize, usize)) -> Self {
        Self {
            grid: Grid::FRAME,
            size: [width, height],
        }
    }

    pub fn is_whole(&self) -> bool {
        self.grid.side == 1
    }

    pub fn frame_size(&self) -> (usize, usize) {
        let [width, height] = self.size;
        (width, height)
    }

    /// The view of a panel that is expected on `lattice`, in pixels of such a size that `capacity` pixels hold it in a frame of that size:
    /// the present view as long as it suffices. `None` if the panel is entirely outside the frame.
    pub fn of(&self, lattice: &Lattice, max_pitch_px: f32, frame_size: (usize, usize), capacity: usize) -> Option<Self> {
        let [across, down] = lattice.pitch();
        let pitch = across.max(down);
        let longest = frame_size.0.max(frame_size.1) as f32;
        let side = (pitch <= longest).then(|| self.side_for(lattice, max_pitch_px, capacity))?;
        if side == 1 {
            return Some(Self::whole(frame_size));
        }
        let needed = part(lattice, ROOM[1], side, frame_size)?;
        if self.grid.side == side && self.holds(&needed) && self.is_near(frame_size) {
            return Some(*self);
        }
        let mut room = ROOM[0];
        loop {
            let around = Self::around(&part(lattice, room, side, frame_size)?, side, self.grid.origin);
            let area = around.size[0] * around.size[1];
            if area > 0 && area <= capacity {
                return Some(around);
            }
            room = (room > RIM).then_some((0.5 * room).max(RIM))?;
        }
    }

    /// The side of the larger pixels.
    fn side_for(&self, lattice: &Lattice, max_pitch_px: f32, capacity: usize) -> usize {
        let [across, down] = lattice.pitch();
        let (pitch, now) = (across.max(down), self.grid.side as f32);
        let widest = max_pitch_px * (1.0 + HYSTERESIS);
        let narrowest = max_pitch_px * (1.0 - HYSTERESIS) * (now - 1.0) / now;
        let mut side = if (narrowest..widest).contains(&(pitch / now)) {
            now
        } else {
            libm::ceilf(pitch / max_pitch_px).max(1.0)
        };
        let [width, height] = lattice.extent(RIM);
        let pixels = |side: f32| (width / side + 3.0) * (height / side + 3.0);
        while pixels(side) > capacity as f32 && side < pitch {
            side += 1.0;
        }
        side as usize
    }

    /// Whole larger pixels that cover a part of the frame, aligned with those of `before`.
    fn around([low, high]: &[[i32; 2]; 2], side: usize, before: [i32; 2]) -> Self {
        let step = side as i32;
        let origin: [i32; 2] = core::array::from_fn(|i| low[i] + before[i].wrapping_sub(low[i]).rem_euclid(step));
        let size = core::array::from_fn(|i| ((high[i] - origin[i]) / step).max(0) as usize);
        Self {
            grid: Grid { side, origin },
            size,
        }
    }

    /// The ends of the visible part of the frame, in the frame's pixels.
    fn ends(&self) -> [[i32; 2]; 2] {
        let Grid { side, origin } = self.grid;
        let high = core::array::from_fn(|i| origin[i].saturating_add((self.size[i] * side) as i32));
        [origin, high]
    }

    /// Whether the view exceeds a frame of that size by no more than it may.
    fn is_near(&self, (width, height): (usize, usize)) -> bool {
        let ([low, high], beyond) = (self.ends(), beyond(self.grid.side));
        let limit = [width, height].map(|limit| limit as i32 + beyond);
        (0..2).all(|i| low[i] >= -beyond && high[i] <= limit[i])
    }

    /// Whether the view includes all larger pixels that lie entirely within a part of the frame.
    fn holds(&self, [low, high]: &[[i32; 2]; 2]) -> bool {
        let slack = self.grid.side as i32;
        let [from, to] = self.ends();
        (0..2).all(|i| from[i] < low[i] + slack && to[i] > high[i] - slack)
    }

    /// The shift to another view with pixels of the same size; `None` if it is not a whole number of pixels.
    pub fn shift_to(&self, other: &Self) -> Option<[i32; 2]> {
        let side = self.grid.side as i32;
        let px = [0, 1].map(|i| self.grid.origin[i].saturating_sub(other.grid.origin[i]));
        let aligned = self.grid.side == other.grid.side && px.iter().all(|px| px % side == 0);
        aligned.then(|| px.map(|px| px / side))
    }

    /// Converts a loss in this view to pixels of the frame.
    pub fn loss_in_frame(&self, loss: Loss, frame_size: (usize, usize)) -> Loss {
        let side = self.grid.side as f32;
        let in_frame = |why: TrackError| match why {
            TrackError::OffCourse { off_px } => TrackError::OffCourse { off_px: off_px * side },
            other => other,
        };
        match loss {
            Loss::Cells(error) => Loss::Cells(self.error_in_frame(error, frame_size)),
            Loss::Coasting { missed, patience, why } => Loss::Coasting {
                missed,
                patience,
                why: in_frame(why),
            },
            Loss::Lost(why) => Loss::Lost(in_frame(why)),
            other => other,
        }
    }

    /// Converts an error of cells in this view to pixels of the frame.
    pub fn error_in_frame(&self, error: CellsError, (width, height): (usize, usize)) -> CellsError {
        match error {
            CellsError::OutsideFrame {
                left, right, top, bottom, ..
            } => {
                let to_frame = |x: f64, y: f64| self.grid.place_in_frame([x as f32, y as f32]).map(f64::from);
                let ([left, top], [right, bottom]) = (to_frame(left, top), to_frame(right, bottom));
                CellsError::outside_frame([[left, right], [top, bottom]], [width, height])
            }
            other => other,
        }
    }

    /// Checks that all cells of a panel in this view are within a frame of that size.
    pub fn check_cells(&self, corners: &Corners, (width, height): (usize, usize)) -> Result<(), CellsError> {
        let last = [width as f64 - 1.0, height as f64 - 1.0];
        let outline = corners.homography().outline();
        let inside = outline.iter().all(|&[x, y]| {
            let at = self.grid.place_in_frame([x as f32, y as f32]);
            (0..2).all(|i| (0.0..=last[i]).contains(&f64::from(at[i])))
        });
        if inside {
            return Ok(());
        }
        Err(self.outside_frame(corners))
    }

    /// The error that not all cells of a panel in this view are in the frame.
    pub fn outside_frame(&self, corners: &Corners) -> CellsError {
        CellsError::outside_frame(ends(corners), self.size)
    }

    /// The visible part of a frame, drawn in `buffer` if necessary.
    pub fn draw<'a>(&self, frame: &'a Frame<'a>, buffer: &'a mut [u8]) -> Option<Frame<'a>> {
        if self.is_whole() {
            return Some(*frame);
        }
        self.grid.draw(frame, self.size, buffer)
    }
}

/// Number of frame pixels by which larger pixels may extend beyond the frame, repeating its edge: as many as a panel at the edge needs.
fn beyond(side: usize) -> i32 {
    2 * side as i32
}

/// The part of the frame around a lattice with that room, in pitches: its first pixel and the one after the last; `None` outside the frame.
fn part(lattice: &Lattice, room: f32, side: usize, (width, height): (usize, usize)) -> Option<[[i32; 2]; 2]> {
    let (extent, beyond) = (lattice.extent(room), beyond(side));
    let limit = [width, height].map(|limit| limit as i32);
    let (low, high) = (
        core::array::from_fn(|i| ((lattice.centre[i] - 0.5 * extent[i]) as i32).max(-beyond)),
        core::array::from_fn(|i| {
            let last = (lattice.centre[i] + 0.5 * extent[i]) as i32;
            last.saturating_add(1).min(limit[i] + beyond)
        }),
    );
    let in_frame = (0..2).all(|i| low[i] < limit[i] && high[i] > 0);
    in_frame.then_some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::TrackingSettings;
    use properties::prelude::*;

    const PITCH_MAX: f32 = TrackingSettings::DEFAULT.max_pitch_px;
    const CAPACITY: usize = 96 * 96;

    #[test]
    fn pixels_change_their_size_with_some_hesitation() {
        let frame_size = (4000, 4000);
        let mut view = View::whole(frame_size);
        let mut sides = std::vec::Vec::new();
        for step in (0..200).chain((0..200).rev()) {
            let pitch = 4.0 * 1.02f32.powi(step);
            let lattice = Lattice::turned([2000.0; 2], pitch, pitch, 0.0);
            view = view.of(&lattice, PITCH_MAX, frame_size, CAPACITY).unwrap();
            sides.push(view.grid.side);
        }
        let changes = sides.windows(2).filter(|pair| pair[0] != pair[1]).count();
        // Once per side while the panel grows, and once while it shrinks.
        assert_eq!(sides.iter().max(), Some(&sides[199]));
        assert!(changes <= 2 * sides[199], "{changes}");
    }

    properties! {
        #[test]
        fn a_panel_of_any_size_is_seen_in_as_many_pixels_as_there_are(
            pitch in 1.5f32..400.0, roll in -0.4f32..0.4, at in prop::array::uniform2(-500.0f32..4500.0), capacity in 2000usize..20_000,
        ) {
            let frame_size = (4000, 3000);
            let lattice = Lattice::turned(at, pitch, pitch, roll);
            if let Some(view) = View::whole(frame_size).of(&lattice, PITCH_MAX, frame_size, capacity) {
                prop_assert!(view.is_whole() || view.size[0] * view.size[1] <= capacity);
                prop_assert!(pitch / view.grid.side as f32 <= PITCH_MAX * (1.0 + HYSTERESIS));
                // The view contains all of the panel that is in the frame.
                for corner in lattice.corners() {
                    let [x, y] = view.grid.place_of_frame(corner);
                    // The last pixel's centre is at the number of pixels minus one, its edge half a pixel further.
                    let in_frame = (0.0..3999.5).contains(&corner[0]) && (0.0..2999.5).contains(&corner[1]);
                    let seen = x > -0.5 && y > -0.5 && x < view.size[0] as f32 - 0.5 && y < view.size[1] as f32 - 0.5;
                    prop_assert!(seen || !in_frame, "{corner:?} in {view:?}");
                }
                let [x, y] = lattice.centre;
                if (0.0..4000.0).contains(&x) && (0.0..3000.0).contains(&y) {
                    prop_assert_eq!(view.of(&lattice, PITCH_MAX, frame_size, capacity), Some(view));
                }
            }
        }

        #[test]
        fn no_lattice_panics(centre in prop::array::uniform2(prop::num::f32::ANY), steps in prop::array::uniform4(prop::num::f32::ANY)) {
            let [a, b, c, d] = steps;
            let lattice = Lattice { centre, column: [a, b], row: [c, d], tilt: [a, d] };
            let _ = View::whole((640, 480)).of(&lattice, PITCH_MAX, (640, 480), CAPACITY);
        }
    }
}
