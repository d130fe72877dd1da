//! Refinement of an approximate pose to the best fit of the pixels (Levenberg 1944; Marquardt 1963).

use crate::lattice::{Lattice, MIDDLE};
use crate::spots::{LatticeModel, Observation, Residuals, Slope, Window};
use link::panel::{LEDS, SIDE};

/// A step that improves the sum of squares by less is the last one (share). Lower: more steps, and a pose nearer to
/// the best.
const SETTLED: f32 = 3e-3;
/// The damping of the first step (share of the curvature). Higher: shorter steps.
const DAMPING: f32 = 0.05;
/// The least damping (share of the curvature).
const LEAST_DAMPING: f32 = 0.01;
/// Factor on the damping after a step that improves.
const EASED: f32 = 0.3;
/// The damping after a step that does not improve: multiplied (factor), and increased (share of the curvature).
const STIFFENED: (f32, f32) = (4.0, 0.2);
/// The damping at which the search ends (share of the curvature). Higher: more steps before giving up.
const STUCK: f32 = 50.0;
/// Steps that fit the levels alone, which have to settle first (count).
pub(crate) const LEVELLING: usize = 3;
/// Steps for a near panel's tilt, at most (count).
const TILTING: usize = 8;

/// A model fitted to a frame, and its residuals.
pub(crate) struct Fit {
    pub spots: LatticeModel,
    pub slope: Slope,
}

impl Fit {
    /// Root mean square of the residuals, in grey levels.
    pub fn residual_grey(&self) -> f32 {
        libm::sqrtf(self.slope.squares / self.slope.pixels.max(1) as f32)
    }
}

/// Fits levels, states and shape together in at most `steps` steps, the levels first if `start` has none; `None` if there is nothing to
/// fit.
pub(crate) fn levenberg_marquardt<const N: usize>(
    residuals: &mut Residuals<N>,
    observation: Observation<'_, '_>,
    window: Window,
    start: LatticeModel,
    steps: usize,
) -> Option<Fit> {
    let pair = observation.earlier.is_some();
    let mut spots = start;
    let mut slope = residuals.compare(&spots, observation, window)?;
    let levelling = if start.contrast == 0.0 { LEVELLING } else { 0 };
    for _ in 0..levelling {
        spots = spots.relevelled(&slope, pair)?;
        slope = residuals.compare(&spots, observation, window)?;
    }
    let mut damping = DAMPING;
    for _ in 0..steps {
        let mut next = spots.reshaped(&slope, damping)?.relevelled(&slope, pair)?;
        let switched = next.switch(&slope, pair);
        let after = residuals.compare_below(slope.squares, &next, observation, window)?;
        if after.squares < slope.squares {
            let settled = switched == 0 && slope.squares - after.squares < SETTLED * slope.squares;
            (spots, slope) = (next, after);
            damping = (damping * EASED).max(LEAST_DAMPING);
            if settled {
                break;
            }
        } else {
            damping = STIFFENED.0 * damping + STIFFENED.1;
            if damping > STUCK {
                break;
            }
        }
    }
    Some(Fit { spots, slope })
}

/// The fit of a near panel, in perspective: with its tilt too, as long as that reduces the residuals.
pub(crate) fn in_perspective<const N: usize>(
    residuals: &mut Residuals<N>,
    observation: Observation<'_, '_>,
    window: Window,
    mut fit: Fit,
) -> Fit {
    let pair = observation.earlier.is_some();
    for _ in 0..TILTING {
        let Fit { spots, slope } = &fit;
        let shaped = spots.tilted(slope).reshaped(slope, DAMPING);
        let Some(mut next) = shaped.and_then(|shaped| shaped.relevelled(slope, pair)) else {
            break;
        };
        next.switch(slope, pair);
        let Some(slope) = residuals.compare(&next, observation, window) else {
            break;
        };
        if slope.squares.is_nan() || slope.squares > (1.0 - SETTLED) * fit.slope.squares {
            break;
        }
        fit = Fit { spots: next, slope };
    }
    fit
}

/// The same lattice counted from a neighbouring row or column.
pub(crate) fn shifted(spots: &LatticeModel, columns: i32, rows: i32) -> LatticeModel {
    let mut shifted = *spots;
    shifted.lattice.centre = spots.lattice.position(MIDDLE + columns as f32, MIDDLE + rows as f32);
    for led in 0..LEDS {
        let (column, row) = ((led % SIDE) as i32 + columns, (led / SIDE) as i32 + rows);
        let inside = 0..SIDE as i32;
        let known = inside.contains(&column) && inside.contains(&row);
        shifted.state[led] = if known {
            spots.state[row as usize * SIDE + column as usize]
        } else {
            0.0
        };
    }
    shifted
}

/// The pixels around a lattice, up to `rim` pitches beyond its outer LEDs; `None` if it is not in the frame.
pub(crate) fn window(lattice: &Lattice, rim: f32, (width, height): (usize, usize)) -> Option<Window> {
    let far = (SIDE - 1) as f32 + rim;
    let corners = [[-rim, -rim], [far, -rim], [far, far], [-rim, far]].map(|[u, v]| lattice.position(u, v));
    let ends = |axis: usize, limit: usize| {
        let low = corners.iter().fold(f32::INFINITY, |low, corner| low.min(corner[axis]));
        let high = corners.iter().fold(f32::NEG_INFINITY, |high, corner| high.max(corner[axis]));
        let first = libm::floorf(low).max(0.0);
        let last = libm::ceilf(high).min(limit as f32 - 1.0);
        (last > first).then(|| (first as usize, (last - first) as usize + 1))
    };
    let ((x, width), (y, height)) = (ends(0, width)?, ends(1, height)?);
    Some(Window { x, y, width, height })
}
