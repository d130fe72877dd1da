//! How well does a lattice of spots of any brightness explain a patch?
//!
//! For a signal s = Σ aₖ·g(p − pₖ) + noise, with Gaussian spots g, brightnesses aₖ of prior variance A and noise of variance n a
//! sample, the logarithm of the evidence of a pose is, but for a constant,
//!
//!   ½·bᵀ·(G + λ)⁻¹·b/n − ½·log det(1 + G/λ),   bₖ = Σ s·g(p − pₖ),   Gₖₗ = Σ g·g,   λ = n/A.
//!
//! b is the patch convolved with g, looked up at the lattice's places: one convolution serves all poses. On a lattice whose rows and
//! columns are at right angles G is the Kronecker product of two 8×8 matrices; λ is shared out between them.

use super::patch::{PATCH_SIDE, Patch};
use crate::lattice::Lattice;
use link::panel::SIDE;

/// A patch made ready for the evidence of many poses.
pub(super) struct Evidence {
    response: [[f32; PATCH_SIDE]; PATCH_SIDE],
    sigma: f32,
    noise: f32,
    /// √λ relative to a spot's energy.
    ridge: f32,
}

type Square = [[f32; SIDE]; SIDE];

impl Evidence {
    /// Of spots of standard deviation `sigma` samples; `own_sigma` is what they have in the patch before any more blur. `noise` is the
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

    /// The patch's agreement with spots at the lattice's places; positions and steps in samples.
    pub fn responses(&self, lattice: &Lattice) -> Option<Square> {
        let mut responses = [[0.0; SIDE]; SIDE];
        let [x0, y0] = lattice.position(0.0, 0.0);
        for (r, row) in responses.iter_mut().enumerate() {
            let (mut x, mut y) = (x0 + r as f32 * lattice.row[0], y0 + r as f32 * lattice.row[1]);
            for response in row {
                *response = self.at(x, y)?;
                x += lattice.column[0];
                y += lattice.column[1];
            }
        }
        Some(responses)
    }

    fn at(&self, x: f32, y: f32) -> Option<f32> {
        let (i, j) = (x as i32, y as i32);
        if i < 0 || j < 0 || i as usize + 1 >= PATCH_SIDE || j as usize + 1 >= PATCH_SIDE {
            return None;
        }
        let (i, j) = (i as usize, j as usize);
        let (u, v) = (x - i as f32, y - j as f32);
        let (upper, lower) = (&self.response[j], &self.response[j + 1]);
        let above = upper[i] + u * (upper[i + 1] - upper[i]);
        let below = lower[i] + u * (lower[i + 1] - lower[i]);
        Some(above + v * (below - above))
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

    /// The same of a lattice of which it is known how its spots overlap.
    pub fn of_overlapping(&self, lattice: &Lattice, overlap: &Overlap) -> Option<f32> {
        let mut whitened = self.responses(lattice)?;
        whitened.iter_mut().for_each(|line| overlap.column.solve(line));
        let mut whitened = transposed(&whitened);
        whitened.iter_mut().for_each(|line| overlap.row.solve(line));
        let energy: f32 = whitened.iter().flatten().map(|value| value * value).sum();
        let spot = core::f32::consts::PI * self.sigma * self.sigma;
        let explained = energy / spot / (self.noise * self.noise);
        Some(0.5 * explained - 0.25 * overlap.complexity)
    }

    /// How spots overlap that are so far apart along rows and along columns, in samples.
    pub fn overlap(&self, pitch: [f32; 2]) -> Overlap {
        let [column, row] = pitch.map(|pitch| Factor::new(pitch / self.sigma, self.ridge));
        Overlap {
            complexity: SIDE as f32 * (column.log_det() + row.log_det()) - 4.0 * (SIDE * SIDE) as f32 * libm::logf(self.ridge),
            column,
            row,
        }
    }
}

/// G + λ of lattices of one pitch, and what it takes off the evidence.
pub(super) struct Overlap {
    column: Factor,
    row: Factor,
    complexity: f32,
}

fn transposed(square: &Square) -> Square {
    core::array::from_fn(|i| core::array::from_fn(|j| square[j][i]))
}

/// The Cholesky factor of the 8×8 matrix exp(−(i − j)²·(pitch/σ)²/4) + ridge.
struct Factor {
    lower: Square,
    inverse_diagonal: [f32; SIDE],
}

impl Factor {
    fn new(pitch_over_sigma: f32, ridge: f32) -> Self {
        let near = libm::expf(-0.25 * pitch_over_sigma * pitch_over_sigma);
        // exp(−d²·q) for d = 0, 1, 2…: the powers near^(d²).
        let mut overlap = [1.0; SIDE];
        let (mut step, squared) = (near, near * near);
        for d in 1..SIDE {
            // Numbers too small to count are slow to reckon with.
            overlap[d] = if overlap[d - 1] > 1e-6 { overlap[d - 1] * step } else { 0.0 };
            step = if step > 1e-12 { step * squared } else { 0.0 };
        }
        overlap[0] += ridge;
        let mut lower = [[0.0; SIDE]; SIDE];
        let mut inverse_diagonal = [0.0; SIDE];
        for i in 0..SIDE {
            for j in 0..=i {
                let dot: f32 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = overlap[i - j] - dot;
                if i == j {
                    lower[i][i] = libm::sqrtf(rest.max(1e-6));
                    inverse_diagonal[i] = 1.0 / lower[i][i];
                } else {
                    lower[i][j] = rest * inverse_diagonal[j];
                }
            }
        }
        Self { lower, inverse_diagonal }
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

    fn log_det(&self) -> f32 {
        -2.0 * self.inverse_diagonal.iter().map(|&d| libm::logf(d)).sum::<f32>()
    }
}
