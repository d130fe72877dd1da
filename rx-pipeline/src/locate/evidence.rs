//! The evidence of a pose: how well a lattice of spots of any brightness explains a patch.
//!
//! For a signal s = Σ aₖ·g(p − pₖ) + noise, with Gaussian spots g, brightnesses aₖ of prior variance A and noise of variance n a sample,
//! the log evidence of a pose is, up to a constant,
//!
//!   ½·bᵀ·(G + λ)⁻¹·b/n − ½·log det(1 + G/λ),   bₖ = Σ s·g(p − pₖ),   Gₖₗ = Σ g·g,   λ = n/A.
//!
//! b is the patch convolved with g, sampled at the lattice's places: one convolution serves all poses. On a lattice with right angles G is
//! the Kronecker product of two 8×8 matrices, which share λ.

use super::patch::{PATCH_SIDE, Patch};
use crate::lattice::Lattice;
use core::ops::RangeInclusive;
use link::panel::SIDE;

/// A patch prepared for the evidence of many poses.
pub(super) struct Evidence {
    response: [[f32; PATCH_SIDE]; PATCH_SIDE],
    sigma: f32,
    noise: f32,
    /// √λ relative to a spot's energy.
    ridge: f32,
}

type Square = [[f32; SIDE]; SIDE];

/// Columns and rows within a lattice's outline (pitches from the first LED).
const OUTLINE: RangeInclusive<f32> = -0.6..=7.6;

/// Places with samples on all sides (samples).
const WITHIN: RangeInclusive<f32> = 0.0..=PATCH_SIDE as f32 - 1.01;

impl Evidence {
    /// For spots of standard deviation `sigma` samples, with `own_sigma` their deviation in the patch before further blur. `noise` is the
    /// standard deviation of a sample.
    pub fn new(patch: &Patch, own_sigma: f32, sigma: f32, noise: f32, ridge: f32) -> Self {
        let extra = (sigma * sigma - own_sigma * own_sigma).max(0.0);
        let gain = 2.0 * core::f32::consts::PI * sigma * sigma;
        Self {
            response: patch.blurred(libm::sqrtf(extra + sigma * sigma), gain),
            sigma,
            noise,
            ridge,
        }
    }

    /// The patch's correlation with spots at the lattice's places; positions and steps in samples. `None` if one is outside the patch.
    pub fn responses(&self, lattice: &Lattice) -> Option<Square> {
        let [x0, y0] = lattice.position(0.0, 0.0);
        let far = (SIDE - 1) as f32;
        let corners = [[0.0, 0.0], [far, 0.0], [0.0, far], [far, far]];
        let is_within = corners.iter().all(|[column, row]| {
            let place = |axis: usize, first: f32| first + column * lattice.column[axis] + row * lattice.row[axis];
            [place(0, x0), place(1, y0)].iter().all(|c| WITHIN.contains(c))
        });
        if !is_within {
            return None;
        }
        let mut responses = [[0.0; SIDE]; SIDE];
        for (r, row) in responses.iter_mut().enumerate() {
            let (mut x, mut y) = (x0 + r as f32 * lattice.row[0], y0 + r as f32 * lattice.row[1]);
            for response in row {
                *response = self.at(x, y);
                x += lattice.column[0];
                y += lattice.column[1];
            }
        }
        Some(responses)
    }

    /// Interpolates between the samples around a place within the patch.
    fn at(&self, x: f32, y: f32) -> f32 {
        let ((i, u), (j, v)) = (whole_and_rest(x), whole_and_rest(y));
        let (upper, lower) = (&self.response[j], &self.response[(j + 1) % PATCH_SIDE]);
        let next = (i + 1) % PATCH_SIDE;
        let above = upper[i] + u * (upper[next] - upper[i]);
        let below = lower[i] + u * (lower[next] - lower[i]);
        above + v * (below - above)
    }

    /// The likeliest brightnesses of the spots.
    pub fn brightness(&self, lattice: &Lattice) -> Option<[f32; SIDE * SIDE]> {
        let mut solved = self.responses(lattice)?;
        let [across, down] = lattice.pitch();
        let (column, row) = (
            Factor::new(across / self.sigma, self.ridge),
            Factor::new(down / self.sigma, self.ridge),
        );
        solved.iter_mut().for_each(|line| column.solve_fully(line));
        let mut solved = transposed(&solved);
        solved.iter_mut().for_each(|line| row.solve_fully(line));
        let spot = core::f32::consts::PI * self.sigma * self.sigma;
        Some(core::array::from_fn(|led| solved[led % SIDE][led / SIDE] / spot))
    }

    /// The logarithm of the evidence; `None` if the lattice leaves the patch.
    pub fn of(&self, lattice: &Lattice) -> Option<f32> {
        self.of_overlapping(lattice, &self.overlap(lattice.pitch()))
    }

    /// The same for a lattice whose overlap is known.
    pub fn of_overlapping(&self, lattice: &Lattice, overlap: &Overlap) -> Option<f32> {
        let explained = self.energy(lattice, overlap)? / (self.noise * self.noise);
        Some(0.5 * explained - 0.25 * overlap.complexity())
    }

    /// The part of the patch's energy within the lattice's outline that its spots explain.
    pub fn share(&self, patch: &Patch, lattice: &Lattice) -> Option<f32> {
        let explained = self.energy(lattice, &self.overlap(lattice.pitch()))?;
        let mut total = f32::MIN_POSITIVE;
        for (j, row) in patch.sample.iter().enumerate() {
            for (i, sample) in row.iter().enumerate() {
                let place = lattice.coordinates([i as f32, j as f32])?;
                if place.iter().all(|c| OUTLINE.contains(c)) {
                    total += sample * sample;
                }
            }
        }
        Some(explained / total)
    }

    /// The part of the patch's sum of squares that the likeliest spots explain.
    fn energy(&self, lattice: &Lattice, overlap: &Overlap) -> Option<f32> {
        let mut whitened = self.responses(lattice)?;
        overlap.row.solve_columns(&mut whitened);
        let mut whitened = transposed(&whitened);
        overlap.column.solve_columns(&mut whitened);
        let squares = whitened.iter().fold([0.0; SIDE], |mut sums, line| {
            sums.iter_mut().zip(line).for_each(|(sum, value)| *sum += value * value);
            sums
        });
        let spot = core::f32::consts::PI * self.sigma * self.sigma;
        Some(squares.iter().sum::<f32>() / spot)
    }

    /// The overlap of spots with this pitch along rows and along columns, in samples.
    pub fn overlap(&self, pitch: [f32; 2]) -> Overlap {
        let [column, row] = pitch.map(|pitch| Factor::new(pitch / self.sigma, self.ridge));
        Overlap {
            pitch,
            base: -4.0 * (SIDE * SIDE) as f32 * libm::logf(self.ridge),
            column,
            row,
        }
    }

    /// The same, reusing the valid parts of known overlaps.
    pub fn overlap_like(&self, pitch: [f32; 2], known: [&Overlap; 2]) -> Overlap {
        let factor = |axis: usize, of: fn(&Overlap) -> &Factor| {
            let known = known.into_iter().find(|known| known.pitch[axis] == pitch[axis]);
            known.map_or_else(|| Factor::new(pitch[axis] / self.sigma, self.ridge), |known| *of(known))
        };
        Overlap {
            pitch,
            base: known[0].base,
            column: factor(0, |known| &known.column),
            row: factor(1, |known| &known.row),
        }
    }
}

/// The sample before a place within the patch, and the distance of the place beyond it. Between 2²³ and 2²⁴ floats are integers, so the sum
/// is rounded, and its last bits are the number of the sample. No value can lead beyond the patch, so no check is needed.
fn whole_and_rest(c: f32) -> (usize, f32) {
    const NO_PARTS: f32 = (3 << 22) as f32;
    const { assert!(PATCH_SIDE.is_power_of_two()) }
    let rounded = c - 0.5 + NO_PARTS;
    (rounded.to_bits() as usize % PATCH_SIDE, c - (rounded - NO_PARTS))
}

/// G + λ of lattices of one pitch along rows and along columns.
#[derive(Clone, Copy)]
pub(super) struct Overlap {
    pitch: [f32; 2],
    /// The complexity without any spots.
    base: f32,
    column: Factor,
    row: Factor,
}

impl Overlap {
    /// Four times the complexity's part of the evidence.
    fn complexity(&self) -> f32 {
        SIDE as f32 * (self.column.log_det + self.row.log_det) + self.base
    }
}

fn transposed(square: &Square) -> Square {
    core::array::from_fn(|i| core::array::from_fn(|j| square[j][i]))
}

/// The Cholesky factor of the 8×8 matrix exp(−(i − j)²·(pitch/σ)²/4) + ridge.
#[derive(Clone, Copy)]
struct Factor {
    lower: Square,
    /// Non-zero diagonals below the main one (count).
    band: usize,
    inverse_diagonal: [f32; SIDE],
    log_det: f32,
}

impl Factor {
    fn new(pitch_over_sigma: f32, ridge: f32) -> Self {
        let near = libm::expf(-0.25 * pitch_over_sigma * pitch_over_sigma);
        // exp(−d²·q) for d = 0, 1, 2…: the powers near^(d²).
        let mut overlap = [1.0; SIDE];
        let (mut step, squared) = (near, near * near);
        for d in 1..SIDE {
            // Negligible numbers become 0, because denormals are slow.
            overlap[d] = if overlap[d - 1] > 1e-6 { overlap[d - 1] * step } else { 0.0 };
            step = if step > 1e-12 { step * squared } else { 0.0 };
        }
        let band = (1..SIDE).take_while(|&d| overlap[d] > 0.0).count();
        overlap[0] += ridge;
        let mut lower = [[0.0; SIDE]; SIDE];
        let mut inverse_diagonal = [0.0; SIDE];
        for i in 0..SIDE {
            let first = i.saturating_sub(band);
            for j in first..=i {
                let dot: f32 = (first..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = overlap[i - j] - dot;
                if i == j {
                    lower[i][i] = libm::sqrtf(rest.max(1e-6));
                    inverse_diagonal[i] = 1.0 / lower[i][i];
                } else {
                    lower[i][j] = rest * inverse_diagonal[j];
                }
            }
        }
        Self {
            lower,
            band,
            inverse_diagonal,
            log_det: -2.0 * libm::logf(inverse_diagonal.iter().product()),
        }
    }

    /// Solves for all columns of a square at once.
    fn solve_columns(&self, square: &mut Square) {
        for i in 0..SIDE {
            let (solved, rest) = square.split_at_mut(i);
            let [line, ..] = rest else { return };
            let first = i.saturating_sub(self.band);
            for (before, &lower) in solved.iter().zip(&self.lower[i]).skip(first) {
                line.iter_mut().zip(before).for_each(|(value, before)| *value -= lower * before);
            }
            line.iter_mut().for_each(|value| *value *= self.inverse_diagonal[i]);
        }
    }

    fn solve(&self, line: &mut [f32; SIDE]) {
        for i in 0..SIDE {
            let dot: f32 = (0..i).map(|k| self.lower[i][k] * line[k]).sum();
            line[i] = (line[i] - dot) * self.inverse_diagonal[i];
        }
    }

    fn solve_fully(&self, line: &mut [f32; SIDE]) {
        self.solve(line);
        for i in (0..SIDE).rev() {
            let dot: f32 = (i + 1..SIDE).map(|k| self.lower[k][i] * line[k]).sum();
            line[i] = (line[i] - dot) * self.inverse_diagonal[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_between_their_sample_and_the_next() {
        for quarter in 0..=4 * (PATCH_SIDE as u16 - 2) {
            for beyond in [0.0, 0.1, 0.249] {
                let place = f32::from(quarter) / 4.0 + beyond;
                let (sample, rest) = whole_and_rest(place);
                assert!((0.0..=1.0).contains(&rest) && sample < PATCH_SIDE, "{place}: {sample} and {rest}");
                assert_eq!(sample as f32 + rest, place);
            }
        }
    }
}
