//! 64 Gaussian spots of few brightnesses on a lattice, fitted to light.
//!
//! The model of a frame in linear light is b + Σ (α + β·sₖ)·g(p − pₖ), with sₖ 1 where LED k is On, else 0, or the share of the exposure
//! for which it was On. For the difference of two frames α = 0 and sₖ = 1, 0 or −1: what stands still cancels. Differences of light count by the grey levels they make.
//!
//! The slope of the sum of squares is exact, and so is its curvature within each spot, where dark rims count more than bright or saturated middles; between
//! neighbours it is that of Gaussians on the plane, scaled to the spots' own. So a step costs one look at each spot's pixels.

use crate::frame::Frame;
use crate::lattice::{Lattice, MIDDLE};
use crate::light::Light;
use link::panel::{LEDS, SIDE};
use nalgebra::{SMatrix, SVector};

/// Spots end here, in standard deviations: 3 % of their height is left.
const REACH: f32 = 2.65;
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
    pub state: [f32; LEDS],
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
    /// Σ w·g² of an LED's spot g over the pixels' weights w.
    pub fn led_weight(&self, led: usize) -> f32 {
        self.led[led].weight
    }

    /// Σ w·g·r of an LED's spot g and the residuals r.
    pub fn led_agreement(&self, led: usize) -> f32 {
        self.led[led].height
    }

    /// The share of the variance around the background that the model explains.
    pub fn explained(&self) -> f32 {
        1.0 - self.squares / self.total.max(f32::MIN_POSITIVE)
    }
}

/// Sums over pixels, lane by lane.
#[derive(Default)]
struct Sums {
    squares: [f32; LANES],
    total: [f32; LANES],
    pixels: [u32; LANES],
    background: [[f32; LANES]; 2],
}

impl Sums {
    /// Adds pixels of which `residual` holds the model; leaves their weighted residuals and their weights.
    #[inline]
    fn add<const L: usize>(
        &mut self,
        [light, weights]: [[f32; L]; 2],
        background: f32,
        residual: &mut [f32; L],
        weight: &mut [f32; L],
    ) {
        const { assert!(L <= LANES) }
        for i in 0..L {
            let difference = light[i] - residual[i];
            let weighted = weights[i] * difference;
            let step = light[i] - background;
            self.squares[i] += weighted * difference;
            self.total[i] += weights[i] * step * step;
            self.pixels[i] += u32::from(weights[i] > 0.0);
            self.background[0][i] += weighted;
            self.background[1][i] += weights[i];
            residual[i] = weighted;
        }
        *weight = weights;
    }

    /// Adds a row of such pixels.
    fn add_row<const L: usize>(
        &mut self,
        light: &Light,
        (now, earlier): (&[[u8; L]], Option<&[[u8; L]]>),
        background: f32,
        residual: &mut [[f32; L]],
        weight: &mut [[f32; L]],
    ) {
        let pixels = residual.iter_mut().zip(weight).zip(now);
        match earlier {
            None => {
                for ((residual, weight), now) in pixels {
                    let seen = light.single(now, residual);
                    self.add(seen, background, residual, weight);
                }
            }
            Some(earlier) => {
                for (((residual, weight), now), earlier) in pixels.zip(earlier) {
                    let seen = light.pair(now, earlier, residual);
                    self.add(seen, background, residual, weight);
                }
            }
        }
    }
}

/// Sums of one spot g times the weighted residual, and of the weights.
#[derive(Clone, Copy, Default)]
struct Moments {
    height: f32,
    along: [f32; 2],
    width: f32,
    /// Σ w·g², and the same times d² and times d⁴, d the distance from the spot's centre.
    weight: f32,
    spread: f32,
    tails: f32,
}

/// One spot's heights along x and along y, within the window.
struct Profile {
    start: [usize; 2],
    rows: usize,
    /// Pixels along x, made up to a multiple of [`LANES`] by zeros.
    padded: usize,
    /// Along x: exp(−x²/2σ²), and that times x and x².
    across: [[f32; SPOT_PX]; 3],
    down: [f32; SPOT_PX],
    first_y: f32,
}

/// Pixels reckoned with at once.
const LANES: usize = 4;

/// Writes the values of a Gaussian from `offset` on: exp(−q·(o + i)²) by its ratios, exp(−q·(2o + 1))·exp(−2q)^i.
fn bell(values: &mut [f32], offset: f32, sigma: f32) {
    let q = 0.5 / (sigma * sigma);
    let mut value = libm::expf(-q * offset * offset);
    let mut ratio = libm::expf(-q * (2.0 * offset + 1.0));
    let factor = libm::expf(-2.0 * q);
    for slot in values {
        *slot = value;
        value *= ratio;
        ratio *= factor;
    }
}

impl Profile {
    /// No spot: no rows.
    const NONE: Self = Self {
        start: [0; 2],
        rows: 0,
        padded: 0,
        across: [[0.0; SPOT_PX]; 3],
        down: [0.0; SPOT_PX],
        first_y: 0.0,
    };

    /// Makes of [`Profile::NONE`], in its place, the spot at `centre` (in the window's pixels) as far as it lies within.
    fn place(&mut self, centre: [f32; 2], sigma: f32, window: Window) {
        let reach = REACH * sigma;
        let span = |axis: usize, end: usize| {
            let first = libm::ceilf(centre[axis] - reach).max(0.0);
            let last = libm::floorf(centre[axis] + reach).min(end as f32 - 1.0);
            (last >= first).then(|| (first, ((last - first) as usize + 1).min(SPOT_PX)))
        };
        let (Some((x, columns)), Some((y, rows))) = (span(0, window.width), span(1, window.height))
        else {
            return;
        };
        (self.start, self.rows) = ([x as usize, y as usize], rows);
        self.padded = columns.next_multiple_of(LANES);
        self.first_y = y - centre[1];
        let first_x = x - centre[0];
        let [plain, once, twice] = &mut self.across;
        bell(&mut plain[..columns], first_x, sigma);
        bell(&mut self.down[..rows], self.first_y, sigma);
        for (i, &height) in plain.iter().enumerate().take(columns) {
            let offset = first_x + i as f32;
            once[i] = height * offset;
            twice[i] = once[i] * offset;
        }
    }

    /// Adds the spot to an image of rows of `width`.
    fn add_to(&self, image: &mut [f32], width: usize, height: f32) {
        let (across, _) = self.across[0].as_chunks::<LANES>();
        for (j, &down) in self.down.iter().enumerate().take(self.rows) {
            let start = (self.start[1] + j) * width + self.start[0];
            let end = (start + self.padded).min(image.len());
            let scale = height * down;
            let (row, rest) = image[start..end].as_chunks_mut::<LANES>();
            for (to, across) in row.iter_mut().zip(across) {
                for (to, &across) in to.iter_mut().zip(across) {
                    *to += scale * across;
                }
            }
            let across = across.get(row.len()).into_iter().flatten();
            for (to, &across) in rest.iter_mut().zip(across) {
                *to += scale * across;
            }
        }
    }

    /// Its sums with a weighted residual.
    fn moments(&self, residual: &[f32], weight: &[f32], width: usize) -> Moments {
        let mut sums = [[0.0; LANES]; 7];
        for (j, &down) in self.down.iter().enumerate().take(self.rows) {
            let start = (self.start[1] + j) * width + self.start[0];
            let end = (start + self.padded).min(residual.len());
            let [height, along, wide, squares, spread, tails] =
                self.dots(&residual[start..end], &weight[start..end]);
            let dy = self.first_y + j as f32;
            let (dy2, down2) = (dy * dy, down * down);
            for i in 0..LANES {
                sums[0][i] += down * height[i];
                sums[1][i] += down * along[i];
                sums[2][i] += down * dy * height[i];
                sums[3][i] += down * (wide[i] + dy2 * height[i]);
                sums[4][i] += down2 * squares[i];
                sums[5][i] += down2 * (spread[i] + dy2 * squares[i]);
                sums[6][i] += down2 * (tails[i] + dy2 * (2.0 * spread[i] + dy2 * squares[i]));
            }
        }
        let [height, along, across, width, weight, spread, tails] =
            sums.map(|lanes| lanes.iter().sum());
        Moments {
            height,
            along: [along, across],
            width,
            weight,
            spread,
            tails,
        }
    }

    /// Lane by lane, the products of a row's residuals with the three profiles, and of its weights with their squares.
    fn dots(&self, residual: &[f32], weight: &[f32]) -> [[f32; LANES]; 6] {
        let [plain, once, twice] = self.across.each_ref().map(|row| row.as_chunks::<LANES>().0);
        let profiles = plain.iter().zip(once).zip(twice);
        let mut dots = [[0.0; LANES]; 6];
        let mut add = |r: &[f32; LANES], w: &[f32; LANES], ((plain, once), twice): Lines<'_>| {
            for i in 0..LANES {
                dots[0][i] += r[i] * plain[i];
                dots[1][i] += r[i] * once[i];
                dots[2][i] += r[i] * twice[i];
                dots[3][i] += w[i] * plain[i] * plain[i];
                dots[4][i] += w[i] * once[i] * once[i];
                dots[5][i] += w[i] * twice[i] * twice[i];
            }
        };
        let (residual, rest) = residual.as_chunks::<LANES>();
        let (weight, weight_rest) = weight.as_chunks::<LANES>();
        for ((r, w), lines) in residual.iter().zip(weight).zip(profiles.clone()) {
            add(r, w, lines);
        }
        if let (false, Some(lines)) = (rest.is_empty(), profiles.clone().nth(residual.len())) {
            let mut last = [[0.0; LANES]; 2];
            last[0][..rest.len()].copy_from_slice(rest);
            last[1][..weight_rest.len()].copy_from_slice(weight_rest);
            add(&last[0], &last[1], lines);
        }
        dots
    }
}

/// So many values of a spot's three profiles along x.
type Lines<'a> = ((&'a [f32; LANES], &'a [f32; LANES]), &'a [f32; LANES]);

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
        let mut profiles = [Profile::NONE; LEDS];
        for (led, profile) in profiles.iter_mut().enumerate() {
            let [x, y] = spots
                .lattice
                .position((led % SIDE) as f32, (led / SIDE) as f32);
            profile.place([x - origin[0], y - origin[1]], spots.sigma, window);
            let height = spots.amplitude(led);
            if height != 0.0 {
                profile.add_to(residual, window.width, height);
            }
        }
        let mut sums = Sums::default();
        let columns = window.x..window.x + window.width;
        let rows = residual
            .chunks_exact_mut(window.width.max(1))
            .zip(weight.chunks_exact_mut(window.width.max(1)));
        for (y, (residual, weight)) in (window.y..).zip(rows) {
            let now = scenery.frame.row(y)?.get(columns.clone())?;
            let earlier = match scenery.earlier {
                Some(earlier) => Some(earlier.row(y)?.get(columns.clone())?),
                None => None,
            };
            let (now, earlier) = (now.as_chunks(), earlier.map(|row| row.as_chunks()));
            let (residual, weight) = (residual.as_chunks_mut(), weight.as_chunks_mut());
            let (light, background) = (scenery.light, spots.background);
            let most = (now.0, earlier.map(|row| row.0));
            sums.add_row::<LANES>(light, most, background, residual.0, weight.0);
            let rest = (now.1.as_chunks().0, earlier.map(|row| row.1.as_chunks().0));
            let (residual, weight) = (residual.1.as_chunks_mut(), weight.1.as_chunks_mut());
            sums.add_row::<1>(light, rest, background, residual.0, weight.0);
        }
        let sum = |lanes: [f32; LANES]| lanes.iter().sum::<f32>();
        Some(Slope {
            squares: sum(sums.squares),
            total: sum(sums.total),
            pixels: sums.pixels.iter().sum(),
            window_pixels: area as u32,
            background: sums.background.map(sum),
            led: core::array::from_fn(|led| profiles[led].moments(residual, weight, window.width)),
        })
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
                let mut profile = Profile::NONE;
                let at = [x - window.x as f32, y - window.y as f32];
                profile.place(at, spots.sigma, window);
                let sums = profile.moments(residual, weight, window.width);
                lit += u32::from(
                    sums.height.abs() > 0.5 * spots.step.abs() * sums.weight && sums.weight > 0.0,
                );
            }
        }
        lit
    }
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
        self.off + self.step * self.state[led]
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
        let s2 = self.sigma * self.sigma;
        let mut normal = SMatrix::<f32, SHAPE, SHAPE>::zeros();
        let mut gradient = SVector::<f32, SHAPE>::zeros();
        // On the plane Σ g²·d² is σ² times Σ g².
        let strength: [f32; LEDS] = core::array::from_fn(|led| {
            self.amplitude(led) * libm::sqrtf(slope.led[led].spread / s2)
        });
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

    /// By how much the sum of squares falls where each LED alone is switched, and to which state: 0 where it fits best as it is.
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
                let d = self.step * direction;
                let g = 2.0 * d * m.height - d * d * m.weight;
                if g > gain[led] {
                    (gain[led], to[led]) = (g, state);
                }
            }
        }
        (gain, to)
    }

    /// The sum of squares to expect with all LEDs in their best states.
    pub fn expected_squares(&self, slope: &Slope, pair: bool) -> f32 {
        let (gain, _) = self.gains(slope, pair);
        slope.squares - gain.iter().sum::<f32>()
    }

    /// Switches the LEDs that fit better in another state; how many. Only every other one of neighbours at a time: by how much it gains.
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

/// The pairs of LEDs that are so far apart.
fn pairs(du: usize, dv: usize) -> impl Iterator<Item = (usize, usize)> {
    let rows = 2usize.saturating_sub(dv)..SIDE.min(SIDE + 2 - dv);
    rows.flat_map(move |row| {
        (0..SIDE - du).map(move |column| (SIDE * row + column, SIDE * (row + dv - 2) + column + du))
    })
}

/// Σ sₖ·sₗ·(pₖ·pₗᵀ + pₗ·pₖᵀ) over the pairs that are so far apart, p = (1, column, row) from the middle; each LED with itself once.
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
    let (d, e, f) = (
        2.0 * (muu + du * mu),
        2.0 * muv + dv * mu + du * mv,
        2.0 * (mvv + dv * mv),
    );
    [[a, b, c], [b, d, e], [c, e, f]].map(|row| row.map(|value| times * value))
}
