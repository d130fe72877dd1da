//! 64 Gaussian spots of few brightnesses on a lattice, fitted to light.
//!
//! The model of a frame in linear light is b + Σ (α + β·sₖ)·g(p − pₖ), with sₖ 1 where LED k is On, else 0. For the difference of two
//! frames α = 0 and sₖ = 1, 0 or −1: what stands still cancels. Differences of light count by the grey levels they make.
//!
//! The slope of the sum of squares is exact; its curvature is that of Gaussians on the plane, scaled to each spot's own weight. So a step costs
//! one look at each spot's pixels.

use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use crate::light::Light;
use link::panel::{LEDS, SIDE};
use nalgebra::{SMatrix, SVector};

/// Spots end here, in standard deviations: 1 % of their height is left.
const REACH: f32 = 3.0;
/// Pixels along one side of a spot at most.
const SPOT_PX: usize = 20;
/// Limits of a spot's standard deviation, in pixels.
const SIGMA_PX: (f32, f32) = (0.5, 3.2);

/// Columns and rows within which an LED's light is felt.
const NEAR_LATTICE: core::ops::RangeInclusive<f32> = -1.1..=8.1;
/// Pixels that make a mean square worth having.
const ENOUGH_PIXELS: u32 = 60;

/// The pixels that a model is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

/// What the frame shows.
#[derive(Clone, Copy)]
pub(crate) struct Scenery<'a, 'f> {
    pub frame: &'a Frame<'f>,
    pub earlier: Option<&'a Frame<'f>>,
    pub light: &'a Light,
}

/// The model's unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spots {
    pub lattice: Lattice,
    pub sigma: f32,
    pub background: f32,
    /// α
    pub off: f32,
    /// β
    pub step: f32,
    /// sₖ
    pub state: [i8; LEDS],
}

/// Memory for a window of up to `N` pixels.
pub(crate) struct Canvas<const N: usize> {
    residual: [f32; N],
    weight: [f32; N],
}

/// How well the model fits, and which way is down.
pub(crate) struct Slope {
    pub squares: f32,
    pub total: f32,
    /// Pixels that say how bright they are.
    pub pixels: u32,
    /// Pixels in all.
    pub window_pixels: u32,
    background: [f32; 2],
    led: [Moments; LEDS],
}

impl Slope {
    /// The share of the variance around the background that the model explains.
    pub fn explained(&self) -> f32 {
        1.0 - self.squares / self.total.max(f32::MIN_POSITIVE)
    }
}

/// Sums of one spot times the weighted residual.
#[derive(Clone, Copy, Default)]
struct Moments {
    height: f32,
    along: [f32; 2],
    width: f32,
    weight: f32,
}

struct Profile {
    start: [usize; 2],
    length: [usize; 2],
    value: [[f32; SPOT_PX]; 2],
    offset: [f32; 2],
}

impl Profile {
    /// The spot at `centre` (in the window's pixels), as far as it lies within.
    fn new(centre: [f32; 2], sigma: f32, window: Window) -> Option<Self> {
        let reach = REACH * sigma;
        let end = [window.width, window.height];
        let mut profile = Self {
            start: [0; 2],
            length: [0; 2],
            value: [[0.0; SPOT_PX]; 2],
            offset: [0.0; 2],
        };
        for axis in 0..2 {
            let first = libm::ceilf(centre[axis] - reach).max(0.0);
            let last = libm::floorf(centre[axis] + reach).min(end[axis] as f32 - 1.0);
            if last.is_nan() || last < first {
                return None;
            }
            profile.start[axis] = first as usize;
            profile.length[axis] = ((last - first) as usize + 1).min(SPOT_PX);
            profile.offset[axis] = first - centre[axis];
            let q = 0.5 / (sigma * sigma);
            let offset = profile.offset[axis];
            // exp(−q·(o + i)²) by its ratios: exp(−q·(2o + 1))·exp(−2q)^i.
            let mut value = libm::expf(-q * offset * offset);
            let mut ratio = libm::expf(-q * (2.0 * offset + 1.0));
            let factor = libm::expf(-2.0 * q);
            for slot in &mut profile.value[axis][..profile.length[axis]] {
                *slot = value;
                value *= ratio;
                ratio *= factor;
            }
        }
        Some(profile)
    }
}

impl<const N: usize> Canvas<N> {
    pub const fn new() -> Self {
        Self {
            residual: [0.0; N],
            weight: [0.0; N],
        }
    }

    /// Holds the model against the scenery.
    pub fn compare(
        &mut self,
        spots: &Spots,
        scenery: Scenery<'_, '_>,
        window: Window,
    ) -> Option<Slope> {
        let area = window.width * window.height;
        let (residual, weight) = (self.residual.get_mut(..area)?, self.weight.get_mut(..area)?);
        residual.fill(spots.background);
        let origin = [window.x as f32, window.y as f32];
        let place = |led: usize| {
            let [x, y] = spots
                .lattice
                .position((led % SIDE) as f32, (led / SIDE) as f32);
            [x - origin[0], y - origin[1]]
        };
        for led in 0..LEDS {
            let height = spots.off + spots.step * f32::from(spots.state[led]);
            if height == 0.0 {
                continue;
            }
            let Some(profile) = Profile::new(place(led), spots.sigma, window) else {
                continue;
            };
            let across = &profile.value[0][..profile.length[0]];
            for (j, &down) in profile.value[1][..profile.length[1]].iter().enumerate() {
                let start = (profile.start[1] + j) * window.width + profile.start[0];
                for (to, &a) in residual[start..].iter_mut().zip(across) {
                    *to += height * down * a;
                }
            }
        }
        let mut slope = Slope {
            squares: 0.0,
            total: 0.0,
            pixels: 0,
            window_pixels: area as u32,
            background: [0.0; 2],
            led: [Moments::default(); LEDS],
        };
        for y in 0..window.height {
            let row = scenery
                .frame
                .row(window.y + y)?
                .get(window.x..window.x + window.width)?;
            let earlier = match scenery.earlier {
                Some(earlier) => Some(
                    earlier
                        .row(window.y + y)?
                        .get(window.x..window.x + window.width)?,
                ),
                None => None,
            };
            let span = y * window.width..(y + 1) * window.width;
            let (residual, weight) = (&mut residual[span.clone()], &mut weight[span]);
            for x in 0..window.width {
                let model = residual[x];
                let (light, w) = match earlier {
                    None => scenery.light.single(row[x], model),
                    Some(earlier) => scenery.light.pair(row[x], earlier[x], model),
                };
                let difference = light - model;
                let weighted = w * difference;
                slope.squares += weighted * difference;
                slope.total += w * (light - spots.background) * (light - spots.background);
                slope.pixels += u32::from(w > 0.0);
                slope.background[0] += weighted;
                slope.background[1] += w;
                residual[x] = weighted;
                weight[x] = w;
            }
        }
        for led in 0..LEDS {
            let Some(profile) = Profile::new(place(led), spots.sigma, window) else {
                continue;
            };
            slope.led[led] = moments(&profile, residual, weight, window.width);
        }
        Some(slope)
    }

    /// After [`Canvas::compare`]: the mean square that is left unexplained further than a pitch outside the lattice, in grey levels
    /// squared; `None` where there is next to nothing to see.
    pub fn noise_around(&self, spots: &Spots, window: Window) -> Option<f32> {
        let area = window.width * window.height;
        let (residual, weight) = (self.residual.get(..area)?, self.weight.get(..area)?);
        let (mut squares, mut pixels) = (0.0, 0u32);
        for (i, (&residual, &weight)) in residual.iter().zip(weight).enumerate() {
            let at = [
                (window.x + i % window.width) as f32,
                (window.y + i / window.width) as f32,
            ];
            let outside = spots
                .lattice
                .coordinates(at)?
                .into_iter()
                .any(|c| !NEAR_LATTICE.contains(&c));
            if outside && weight > 0.0 {
                squares += residual * residual / weight;
                pixels += 1;
            }
        }
        (pixels >= ENOUGH_PIXELS).then(|| squares / pixels as f32)
    }

    /// After [`Canvas::compare`]: how many of the 36 places around the lattice hold half an LED's light or more.
    pub fn lit_around(&self, spots: &Spots, window: Window) -> u32 {
        let area = window.width * window.height;
        let (Some(residual), Some(weight)) = (self.residual.get(..area), self.weight.get(..area))
        else {
            return 0;
        };
        let mut lit = 0;
        for row in -1..=SIDE as i32 {
            for column in -1..=SIDE as i32 {
                let inside = 0..SIDE as i32;
                if inside.contains(&row) && inside.contains(&column) {
                    continue;
                }
                let [x, y] = spots.lattice.position(column as f32, row as f32);
                let Some(profile) = Profile::new(
                    [x - window.x as f32, y - window.y as f32],
                    spots.sigma,
                    window,
                ) else {
                    continue;
                };
                let sums = moments(&profile, residual, weight, window.width);
                lit += u32::from(
                    sums.height.abs() > 0.5 * spots.step.abs() * sums.weight && sums.weight > 0.0,
                );
            }
        }
        lit
    }
}

fn moments(profile: &Profile, residual: &[f32], weight: &[f32], width: usize) -> Moments {
    let mut sums = Moments::default();
    let across = &profile.value[0][..profile.length[0]];
    for (j, &down) in profile.value[1][..profile.length[1]].iter().enumerate() {
        let start = (profile.start[1] + j) * width + profile.start[0];
        let (residual, weight) = (
            &residual[start..][..across.len()],
            &weight[start..][..across.len()],
        );
        let (mut height, mut along, mut wide, mut squares) = (0.0, 0.0, 0.0, 0.0);
        for (i, &a) in across.iter().enumerate() {
            let dx = profile.offset[0] + i as f32;
            let r = residual[i] * a;
            height += r;
            along += r * dx;
            wide += r * dx * dx;
            squares += weight[i] * a * a;
        }
        let dy = profile.offset[1] + j as f32;
        sums.height += down * height;
        sums.along[0] += down * along;
        sums.along[1] += down * dy * height;
        sums.width += down * (wide + dy * dy * height);
        sums.weight += down * down * squares;
    }
    sums
}

/// Shape unknowns: centre, column step, row step, logarithm of the width.
const SHAPE: usize = 7;

impl Spots {
    /// The squared grey levels that the dimmest of the four outer lines of LEDs makes: what a lattice one line off would leave out.
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

    pub fn amplitude(&self, led: usize) -> f32 {
        self.off + self.step * f32::from(self.state[led])
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
                self.overlap([
                    du * l.column[0] + dv * l.row[0],
                    du * l.column[1] + dv * l.row[1],
                ])
            })
        })
    }

    /// The levels that fit best where the spots are.
    pub fn relevelled(&self, slope: &Slope, fixed_off: bool) -> Option<Self> {
        let overlaps = self.overlaps();
        // Unknowns: background, α, β.
        let mut normal = SMatrix::<f32, 3, 3>::zeros();
        let mut gradient = SVector::<f32, 3>::zeros();
        let area = 2.0; // ∫g / ∫g² of a Gaussian
        normal[(0, 0)] = slope.background[1];
        gradient[0] = slope.background[0];
        self.pairs(|k, l, du, dv| {
            let weight =
                libm::sqrtf(slope.led[k].weight * slope.led[l].weight) * overlaps[du][dv].0;
            let (sk, sl) = (f32::from(self.state[k]), f32::from(self.state[l]));
            let twice = if k == l { 1.0 } else { 2.0 };
            normal[(1, 1)] += twice * weight;
            normal[(1, 2)] += 0.5 * twice * weight * (sk + sl);
            normal[(2, 2)] += twice * weight * sk * sl;
        });
        for led in 0..LEDS {
            let m = &slope.led[led];
            let s = f32::from(self.state[led]);
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
        // Where spots overlap much, what is left out of the curvature may make it none: then in shorter steps.
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
            step: self.step + step[2],
            ..*self
        })
    }

    /// The shape one step down the slope.
    pub fn reshaped(&self, slope: &Slope, damping: f32) -> Option<Self> {
        let overlaps = self.overlaps();
        let mut normal = SMatrix::<f32, SHAPE, SHAPE>::zeros();
        let mut gradient = SVector::<f32, SHAPE>::zeros();
        let s2 = self.sigma * self.sigma;
        let place = |k: usize| [1.0, (k % SIDE) as f32 - MIDDLE, (k / SIDE) as f32 - MIDDLE];
        self.pairs(|k, l, du, dv| {
            let weight = libm::sqrtf(slope.led[k].weight * slope.led[l].weight)
                * self.amplitude(k)
                * self.amplitude(l);
            let [xx, xy, yy] = overlaps[du][dv].1.map(|o| o * weight);
            let (pk, pl) = (place(k), place(l));
            for i in 0..3 {
                for j in 0..3 {
                    let both = if k == l {
                        pk[i] * pl[j]
                    } else {
                        pk[i] * pl[j] + pl[i] * pk[j]
                    };
                    normal[(2 * i, 2 * j)] += both * xx;
                    normal[(2 * i, 2 * j + 1)] += both * xy;
                    normal[(2 * i + 1, 2 * j)] += both * xy;
                    normal[(2 * i + 1, 2 * j + 1)] += both * yy;
                }
            }
            if k == l {
                // ∫(g·d²/σ²)² over ∫g² = 2
                normal[(6, 6)] += 2.0 * weight;
            }
        });
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
        // A spot's width is known beforehand to about a fifth.
        let step = [damping, 0.5 + damping, 5.0 + damping]
            .into_iter()
            .find_map(|damping| {
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
        next.sigma =
            (self.sigma * libm::expf(step[6].clamp(-0.2, 0.2))).clamp(SIGMA_PX.0, SIGMA_PX.1);
        Some(next)
    }

    /// Each pair of LEDs that are near enough for their spots to overlap, once; with the differences of their columns and of their rows plus 2.
    fn pairs(&self, mut visit: impl FnMut(usize, usize, usize, usize)) {
        for k in 0..LEDS {
            let (u, v) = (k % SIDE, k / SIDE);
            for du in 0..3 {
                for dv in 0..5 {
                    if (du == 0 && dv < 2) || u + du >= SIDE || v + dv < 2 || v + dv - 2 >= SIDE {
                        continue;
                    }
                    visit(k, (v + dv - 2) * SIDE + u + du, du, dv);
                }
            }
        }
    }

    /// Switches the LEDs that fit better in another state; how many. Only every other one of neighbours at a time: by how much it gains.
    pub fn switch(&mut self, slope: &Slope, least: i8) -> u32 {
        let mut changed = 0;
        let mut gain = [0.0f32; LEDS];
        let mut to = [0i8; LEDS];
        for led in 0..LEDS {
            let m = &slope.led[led];
            for direction in [-1i8, 1] {
                let state = self.state[led] + direction;
                if !(least..=1).contains(&state) {
                    continue;
                }
                let d = self.step * f32::from(direction);
                let g = 2.0 * d * m.height - d * d * m.weight;
                if g > gain[led] {
                    (gain[led], to[led]) = (g, state);
                }
            }
        }
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
