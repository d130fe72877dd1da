//! Comparison with the lattices that start a row or a column beside a lattice.

use crate::fit;
use crate::spots::{LatticeModel, Observation, Residuals, Window};

/// Steps of the compared fits: of the lattice itself, and of one beside it (count).
const STEPS_COMPARED: [usize; 2] = [2, 3];
/// Lattices beside it that are fitted: the most promising ones (count).
const LIKELIEST: usize = 2;

/// The fit of a lattice, and the best fit of one counted from a neighbouring line.
pub(super) struct Lines {
    pub here: f32,
    pub total: f32,
    pub best_beside: f32,
    pub beside: LatticeModel,
}

impl Lines {
    pub fn of<const N: usize>(
        residuals: &mut Residuals<N>,
        observation: Observation<'_, '_>,
        window: Window,
        spots: &LatticeModel,
    ) -> Option<Self> {
        const STEPS: [(i32, i32); 8] = [(-1, 0), (1, 0), (0, -1), (0, 1), (1, 1), (-1, 1), (1, -1), (-1, -1)];
        let pair = observation.earlier.is_some();
        let here = fit::levenberg_marquardt(residuals, observation, window, *spots, STEPS_COMPARED[0])?;
        let mut lines = Self {
            here: here.slope.squares,
            total: here.slope.total,
            best_beside: f32::INFINITY,
            beside: here.spots,
        };
        let mut beside: [(f32, LatticeModel); 8] = STEPS.map(|(columns, rows)| {
            let shifted = fit::shifted(&here.spots, columns, rows);
            let slope = residuals.compare(&shifted, observation, window);
            let expected = slope.map(|slope| shifted.expected_squares(&slope, pair));
            (expected.unwrap_or(f32::INFINITY), shifted)
        });
        beside.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for (_, shifted) in &beside[..LIKELIEST] {
            if let Some(there) = fit::levenberg_marquardt(residuals, observation, window, *shifted, STEPS_COMPARED[1])
                && there.slope.squares < lines.best_beside
            {
                (lines.best_beside, lines.beside) = (there.slope.squares, there.spots);
            }
        }
        Some(lines)
    }
}
