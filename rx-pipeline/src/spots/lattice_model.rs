//! 64 Gaussian spots of few brightnesses on a lattice, fitted to light.
//!
//! The model of a frame in linear light is b + Σ (α + β·sₖ)·g(p − pₖ), where sₖ is 1 if LED k is On and 0 if it is Off, or the share of the
//! exposure for which it was On. For the difference of two frames α = 0 and sₖ = 1, 0 or −1, because static light cancels. Differences of
//! light are weighed in grey levels.
//!
//! The slope of the sum of squares is exact, and so is its curvature within each spot, where dark rims weigh more than bright or saturated
//! middles. Between neighbours the curvature is that of Gaussians on the plane, scaled to the spots' own. So a step needs one pass over
//! each spot's pixels.

use super::slope::Slope;
use crate::lattice::{Lattice, MIDDLE};
use core::ops::RangeInclusive;
use link::panel::{LEDS, SIDE};
use nalgebra::{SMatrix, SVector};

/// The range of a spot's standard deviation (px). Wider: fits of blurs at which no panel is readable.
pub(crate) const SIGMA_PX: RangeInclusive<f32> = 0.4..=4.8;

/// Closer spots overlap (standard deviations of a spot).
const APART: f32 = 2.2;

/// The model's unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LatticeModel {
    pub lattice: Lattice,
    pub sigma: f32,
    pub background: f32,
    /// α
    pub off: f32,
    /// β
    pub contrast: f32,
    /// sₖ
    pub state: [f32; LEDS],
}

/// Shape unknowns: centre, column step, row step, logarithm of the width.
const SHAPE: usize = 7;

impl LatticeModel {
    /// The squared grey levels of the dimmest of the four outer lines of LEDs, which a lattice off by one line would leave out.
    pub fn dimmest_edge(&self, slope: &Slope) -> f32 {
        let energy = |led: usize| self.amplitude(led) * self.amplitude(led) * slope.led[led].weight;
        let line = |of: fn(usize) -> usize| (0..SIDE).map(|i| energy(of(i))).sum::<f32>();
        let lines = [
            line(|i| i),
            line(|i| SIDE * (SIDE - 1) + i),
            line(|i| SIDE * i),
            line(|i| SIDE * i + SIDE - 1),
        ];
        lines.into_iter().fold(f32::INFINITY, f32::min)
    }

    /// Whether the pitch exceeds `deviations` standard deviations of a spot.
    pub fn stand_apart(&self, deviations: f32) -> bool {
        let [across, down] = self.lattice.pitch();
        across.min(down) > deviations * self.sigma
    }

    /// The separation of the spots: 1 if they are isolated, less if they overlap.
    pub fn apart(&self) -> f32 {
        let [across, down] = self.lattice.pitch();
        (across.min(down) / (APART * self.sigma)).min(1.0)
    }

    pub fn amplitude(&self, led: usize) -> f32 {
        self.off + self.contrast * self.state[led]
    }

    /// Normalised overlaps of two spots `d` apart: of heights, and of derivatives along xx, xy, yy.
    fn overlap(&self, d: [f32; 2]) -> (f32, [f32; 3]) {
        let s2 = self.sigma * self.sigma;
        let e = libm::expf(-(d[0] * d[0] + d[1] * d[1]) / (4.0 * s2));
        let half = 0.5 / s2;
        (
            e,
            [
                half * (1.0 - d[0] * d[0] * half) * e,
                -half * half * d[0] * d[1] * e,
                half * (1.0 - d[1] * d[1] * half) * e,
            ],
        )
    }

    /// Overlaps for differences of columns 0 to 2 and rows −2 to 2.
    fn overlaps(&self) -> [[(f32, [f32; 3]); 5]; 3] {
        core::array::from_fn(|du| {
            core::array::from_fn(|dv| {
                let (du, dv) = (du as f32, dv as f32 - 2.0);
                let l = &self.lattice;
                self.overlap([du * l.column[0] + dv * l.row[0], du * l.column[1] + dv * l.row[1]])
            })
        })
    }

    /// The best levels for the current shape.
    pub fn relevelled(&self, slope: &Slope, fixed_off: bool) -> Option<Self> {
        let overlaps = self.overlaps();
        // Unknowns: background, α, β.
        let mut normal = SMatrix::<f32, 3, 3>::zeros();
        let mut gradient = SVector::<f32, 3>::zeros();
        let area = 2.0; // ∫g / ∫g² of a Gaussian
        normal[(0, 0)] = slope.background[1];
        gradient[0] = slope.background[0];
        let weight: [f32; LEDS] = core::array::from_fn(|led| libm::sqrtf(slope.led[led].weight));
        for (du, dv) in neighbourhood() {
            let twice = if (du, dv) == ITSELF { 1.0 } else { 2.0 };
            for (k, l) in pairs(du, dv) {
                let weight = twice * weight[k] * weight[l] * overlaps[du][dv].0;
                let (sk, sl) = (self.state[k], self.state[l]);
                normal[(1, 1)] += weight;
                normal[(1, 2)] += 0.5 * weight * (sk + sl);
                normal[(2, 2)] += weight * sk * sl;
            }
        }
        for led in 0..LEDS {
            let m = &slope.led[led];
            let s = self.state[led];
            normal[(0, 1)] += area * m.weight;
            normal[(0, 2)] += area * m.weight * s;
            gradient[1] += m.height;
            gradient[2] += m.height * s;
        }
        if fixed_off {
            (normal[(0, 1)], normal[(1, 2)], normal[(1, 1)], gradient[1]) = (0.0, 0.0, 1.0, 0.0);
        }
        for i in 0..3 {
            for j in 0..i {
                normal[(i, j)] = normal[(j, i)];
            }
        }
        // If spots overlap much, the approximate curvature may not be positive: then shorter steps.
        let step = [0.02, 0.2, 2.0].into_iter().find_map(|damping| {
            let mut damped = normal;
            for i in 0..3 {
                damped[(i, i)] = normal[(i, i)] * (1.0 + damping) + 1e-9;
            }
            Some(damped.cholesky()?.solve(&gradient))
        })?;
        Some(Self {
            background: self.background + step[0],
            off: self.off + step[1],
            contrast: self.contrast + step[2],
            ..*self
        })
    }

    /// The shape after one step down the slope.
    pub fn reshaped(&self, slope: &Slope, damping: f32) -> Option<Self> {
        let overlaps = self.overlaps();
        let s2 = self.sigma * self.sigma;
        let mut normal = SMatrix::<f32, SHAPE, SHAPE>::zeros();
        let mut gradient = SVector::<f32, SHAPE>::zeros();
        // On the plane, Σ g²·d² is σ² times Σ g².
        let strength: [f32; LEDS] = core::array::from_fn(|led| self.amplitude(led) * libm::sqrtf(slope.led[led].spread / s2));
        for (du, dv) in neighbourhood() {
            let together = together(&strength, du, dv);
            let [xx, xy, yy] = overlaps[du][dv].1;
            for i in 0..3 {
                for j in 0..3 {
                    normal[(2 * i, 2 * j)] += together[i][j] * xx;
                    normal[(2 * i, 2 * j + 1)] += together[i][j] * xy;
                    normal[(2 * i + 1, 2 * j)] += together[i][j] * xy;
                    normal[(2 * i + 1, 2 * j + 1)] += together[i][j] * yy;
                }
            }
        }
        let place = |k: usize| [1.0, (k % SIDE) as f32 - MIDDLE, (k / SIDE) as f32 - MIDDLE];
        normal[(6, 6)] = (0..LEDS)
            .map(|led| self.amplitude(led) * self.amplitude(led) * slope.led[led].tails / (s2 * s2))
            .sum();
        for led in 0..LEDS {
            let m = &slope.led[led];
            let a = self.amplitude(led) / s2;
            let p = place(led);
            for i in 0..3 {
                gradient[2 * i] += a * m.along[0] * p[i];
                gradient[2 * i + 1] += a * m.along[1] * p[i];
            }
            gradient[6] += a * m.width;
        }
        let step = [damping, 0.5 + damping, 5.0 + damping].into_iter().find_map(|damping| {
            let mut damped = normal;
            for i in 0..SHAPE {
                damped[(i, i)] *= 1.0 + damping;
            }
            Some(damped.cholesky()?.solve(&gradient))
        })?;
        let mut next = *self;
        for axis in 0..2 {
            next.lattice.centre[axis] += step[axis];
            next.lattice.column[axis] += step[2 + axis];
            next.lattice.row[axis] += step[4 + axis];
        }
        next.sigma = (self.sigma * libm::expf(step[6].clamp(-0.2, 0.2))).clamp(*SIGMA_PX.start(), *SIGMA_PX.end());
        Some(next)
    }

    /// The decrease of the sum of squares by a switch of each LED alone, and its best state: 0 for an LED in its best state.
    fn gains(&self, slope: &Slope, pair: bool) -> ([f32; LEDS], [f32; LEDS]) {
        let least = if pair { -1.0 } else { 0.0 };
        let (mut gain, mut to) = ([0.0f32; LEDS], self.state);
        for led in 0..LEDS {
            let m = &slope.led[led];
            for direction in [-1.0, 1.0] {
                let state = self.state[led] + direction;
                if !(least..=1.0).contains(&state) {
                    continue;
                }
                let d = self.contrast * direction;
                let g = 2.0 * d * m.height - d * d * m.weight;
                if g > gain[led] {
                    (gain[led], to[led]) = (g, state);
                }
            }
        }
        (gain, to)
    }

    /// The expected sum of squares with all LEDs in their best states.
    pub fn expected_squares(&self, slope: &Slope, pair: bool) -> f32 {
        let (gain, _) = self.gains(slope, pair);
        slope.squares - gain.iter().sum::<f32>()
    }

    /// Switches the LEDs that fit better in another state; returns their number. Of neighbours, only the one that gains most switches at a
    /// time.
    pub fn switch(&mut self, slope: &Slope, pair: bool) -> u32 {
        let (gain, to) = self.gains(slope, pair);
        let mut changed = 0;
        for led in 0..LEDS {
            if gain[led] <= 0.0 {
                continue;
            }
            let (u, v) = (led % SIDE, led / SIDE);
            let near = |c: usize| c.saturating_sub(1)..(c + 2).min(SIDE);
            let greatest = near(v).all(|j| near(u).all(|i| gain[SIDE * j + i] <= gain[led]));
            if greatest {
                self.state[led] = to[led];
                changed += 1;
            }
        }
        changed
    }
}

/// Differences of columns, and of rows plus 2, of LEDs whose spots overlap; each pair of LEDs has one of them.
fn neighbourhood() -> impl Iterator<Item = (usize, usize)> {
    let all = (0..3).flat_map(|du| (0..5).map(move |dv| (du, dv)));
    all.filter(|&(du, dv)| du > 0 || dv >= 2)
}

/// The difference of an LED from itself.
const ITSELF: (usize, usize) = (0, 2);

/// The pairs of LEDs with that difference.
fn pairs(du: usize, dv: usize) -> impl Iterator<Item = (usize, usize)> {
    let rows = 2usize.saturating_sub(dv)..SIDE.min(SIDE + 2 - dv);
    rows.flat_map(move |row| (0..SIDE - du).map(move |column| (SIDE * row + column, SIDE * (row + dv - 2) + column + du)))
}

/// Σ sₖ·sₗ·(pₖ·pₗᵀ + pₗ·pₖᵀ) over the pairs with that difference, p = (1, column, row) from the middle; each LED with itself once.
fn together(strength: &[f32; LEDS], du: usize, dv: usize) -> [[f32; 3]; 3] {
    let (mut m, mut mu, mut mv, mut muu, mut muv, mut mvv) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, l) in pairs(du, dv) {
        let s = strength[k] * strength[l];
        let (u, v) = ((k % SIDE) as f32 - MIDDLE, (k / SIDE) as f32 - MIDDLE);
        m += s;
        mu += s * u;
        mv += s * v;
        muu += s * u * u;
        muv += s * u * v;
        mvv += s * v * v;
    }
    let times = if (du, dv) == ITSELF { 0.5 } else { 1.0 };
    let (du, dv) = (du as f32, dv as f32 - 2.0);
    let (a, b, c) = (2.0 * m, 2.0 * mu + du * m, 2.0 * mv + dv * m);
    let (d, e, f) = (2.0 * (muu + du * mu), 2.0 * muv + dv * mu + du * mv, 2.0 * (mvv + dv * mv));
    [[a, b, c], [b, d, e], [c, e, f]].map(|row| row.map(|value| times * value))
}
