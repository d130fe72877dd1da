//! Refinement of an approximate pose to the lattice in the pixels, on the right lines.

use super::led_likeness::LEAST_OFF;
use super::led_likeness::LedLikeness;
use super::lines::Lines;
use super::{BEYOND_DOUBT, NARROW, ROUNDING, WIDE};
use super::{LocateError, Scope};
use crate::fit::{self, Fit};
use crate::spots::{LatticeModel, Observation, Outline, Residuals, Slope, Window};
use link::panel::SIDE;

/// Steps of the first fit, at most (count). Higher, here and below: slower, and worse starts are corrected.
const STEPS: usize = 20;
/// Steps of the fit of a lattice moved by a line, at most (count).
const STEPS_MOVED: usize = 12;
/// Steps of the fits that are compared, at most (count). Higher: slower.
const STEPS_COMPARED: usize = 4;
/// Moves of a single frame's lattice to the lines with LEDs, at most (count).
const LINES_MOVED: usize = 2;
/// The least residual of a lattice off by a line, relative to the best (ratio of variances). Higher: more panels with a dark outer line
/// wait for other frames.
const LINES_CLEARLY_WORSE: f32 = 1.6;
/// Lattices whose fits are compared, at most (count).
const LINES_COMPARED: usize = 4;
/// A fit down to the noise is accepted at once if the signal is greater than this (energy ratio, per pixel).
const CLEAR: f32 = 8.0;
/// In a single frame, a fit with a greater residual is not compared with neighbouring lines (share of the signal).
const HALF_EXPLAINED: f32 = 0.5;
/// The residual above which a lattice is rejected even off by a line (share of the signal). Higher: slower.
const NO_LINE_LEFT: f32 = 0.9;
/// The greatest residual of a lattice on a board, even if it is off by a line along rows and along columns (share of the signal): after the
/// first fit, and after the second. Higher: slower.
const MOST_LEFT_A_LINE_OFF: [f32; 2] = [0.5, 0.3];
/// The gain that justifies a move by a line, and the loss that rules one out (energy ratio).
const WORTH_A_MOVE: f32 = 40.0;
/// In a single frame, the least difference to a lattice off by a line; with less, the frame is ambiguous (share of the signal).
const CLEARLY_WORSE: f32 = 0.01;

/// A fit in progress.
pub(super) struct Settling<'r, 'a, 'f, const N: usize> {
    pub residuals: &'r mut Residuals<N>,
    pub observation: Observation<'a, 'f>,
    /// Whether perspective may be visible.
    pub is_near: bool,
}

impl<'a, 'f, const N: usize> Settling<'_, 'a, 'f, N> {
    /// The pixels around a lattice.
    pub fn window(&self, spots: &LatticeModel, rim: f32) -> Result<Window, LocateError> {
        let frame = self.observation.frame;
        fit::window(&spots.lattice, rim, (frame.width(), frame.height())).ok_or(LocateError::NoLattice)
    }

    fn fit(&mut self, observation: Observation<'a, 'f>, start: LatticeModel, rim: f32, steps: usize) -> Result<Fit, LocateError> {
        let window = self.window(&start, rim)?;
        let fitted = fit::levenberg_marquardt(self.residuals, observation, window, start, steps).ok_or(LocateError::NoLattice)?;
        Ok(if self.is_near {
            fit::in_perspective(self.residuals, observation, window, fitted)
        } else {
            fitted
        })
    }

    /// The fit, or that of the lattice counted from a neighbouring line if that is the right one; an error if the pixels do not decide
    /// between them.
    pub fn on_its_line(&mut self, scope: Scope, start: LatticeModel, noise: f32) -> Result<Fit, LocateError> {
        let fitted = self.fit(self.observation, start, scope.rim(), STEPS)?;
        let Slope {
            squares, total, pixels, ..
        } = fitted.slope;
        let noise_squares = noise * pixels as f32;
        let explains_all = squares < BEYOND_DOUBT * BEYOND_DOUBT * noise_squares && total > CLEAR * noise_squares;
        if explains_all || scope.is_single() && !explains_half(&fitted.slope) {
            return Ok(fitted);
        }
        if squares - noise_squares > NO_LINE_LEFT * (total - noise_squares) {
            return Err(LocateError::NoLattice);
        }
        let wide = self.window(&fitted.spots, WIDE)?;
        let lines = Lines::of(self.residuals, self.observation, wide, &fitted.spots).ok_or(LocateError::NoLattice)?;
        let doubt = lines.here - lines.best_beside;
        // The background of the panel, or noise, may compensate for a line.
        let enough = if scope.is_single() {
            CLEARLY_WORSE * lines.total
        } else {
            WORTH_A_MOVE * noise
        };
        let unsure = scope.is_single() && !ends_show(&fitted.spots);
        if doubt.abs() < enough || unsure {
            return Err(LocateError::EdgeUnseen {
                signal_to_noise: libm::sqrtf(doubt.abs() / noise),
            });
        }
        if doubt <= WORTH_A_MOVE * noise {
            return Ok(fitted);
        }
        let moved = lines.beside;
        let window = self.window(&moved, scope.rim())?;
        fit::levenberg_marquardt(self.residuals, self.observation, window, moved, STEPS_MOVED).ok_or(LocateError::NoLattice)
    }

    /// The fit within the lattice's own outline, on the lines of its LEDs; and the observation within that outline.
    pub fn within_a_board(&mut self, start: LatticeModel) -> Result<(Fit, Observation<'a, 'f>), LocateError> {
        let leaves_more = |fit: &Fit, share: f32| fit.slope.squares > share * fit.slope.total;
        let (first, _) = self.within(start, STEPS)?;
        if leaves_more(&first, MOST_LEFT_A_LINE_OFF[0]) {
            return Err(LocateError::NoLattice);
        }
        let mut settled = self.within(first.spots, STEPS_MOVED)?;
        if leaves_more(&settled.0, MOST_LEFT_A_LINE_OFF[1]) {
            return Err(LocateError::NoLattice);
        }
        for _ in 0..LINES_MOVED {
            let spots = settled.0.spots;
            let lines = LedLikeness::of(self.observation, &spots).best_lines();
            match lines[..] {
                [(0, 0)] => return Ok(settled),
                [(columns, rows)] => {
                    settled = self.within(fit::shifted(&spots, columns, rows), STEPS_MOVED)?;
                }
                _ => return self.best_of(&lines, settled),
            }
        }
        match LedLikeness::of(self.observation, &settled.0.spots).best_lines()[..] {
            [(0, 0)] => Ok(settled),
            _ => Err(LocateError::NoLattice),
        }
    }

    /// The best fit among lattices shifted by those columns and rows, if it is the best by far: their LEDs do not decide between them, but
    /// their surroundings may.
    fn best_of(&mut self, lines: &[(i32, i32)], settled: (Fit, Observation<'a, 'f>)) -> Result<(Fit, Observation<'a, 'f>), LocateError> {
        let variance = |fit: &Fit| fit.residual_grey() * fit.residual_grey() + ROUNDING;
        let spots = settled.0.spots;
        let mut here = Some(settled);
        let (mut best, mut next) = (f32::INFINITY, f32::INFINITY);
        let mut nearest = None;
        for &(columns, rows) in lines.iter().take(LINES_COMPARED) {
            let there = match (columns, rows) {
                (0, 0) => here.take(),
                _ => self.within(fit::shifted(&spots, columns, rows), STEPS_COMPARED).ok(),
            };
            let Some(there) = there else { continue };
            let left = variance(&there.0);
            if left < best {
                (next, best, nearest) = (best, left, Some(there));
            } else {
                next = next.min(left);
            }
        }
        match nearest {
            Some((fit, _)) if next.is_finite() && next >= LINES_CLEARLY_WORSE * best => self.within(fit.spots, STEPS_MOVED),
            _ => Err(LocateError::EdgeUnseen {
                signal_to_noise: libm::sqrtf(((next - best) / best).clamp(0.0, 1.0)),
            }),
        }
    }

    fn within(&mut self, start: LatticeModel, steps: usize) -> Result<(Fit, Observation<'a, 'f>), LocateError> {
        let observation = Observation {
            within: Some(Outline::of(&start)),
            ..self.observation
        };
        let fitted = self.fit(observation, start, NARROW, steps)?;
        Ok((fitted, observation))
    }
}

/// Whether each of the four outer lines has an On LED, or Off LEDs are visible too; otherwise the lattice may be off by a line on either
/// side.
fn ends_show(spots: &LatticeModel) -> bool {
    let lit = |column: usize, row: usize| spots.state[row * SIDE + column] > 0.5;
    let last = SIDE - 1;
    let off_shows = spots.off.abs() > LEAST_OFF * spots.contrast;
    off_shows
        || [0, last]
            .iter()
            .all(|&end| (0..SIDE).any(|place| lit(end, place)) && (0..SIDE).any(|place| lit(place, end)))
}

fn explains_half(slope: &Slope) -> bool {
    slope.squares <= HALF_EXPLAINED * slope.total
}
