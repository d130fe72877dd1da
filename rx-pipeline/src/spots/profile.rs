//! One spot within a window: its image, and its sums with the residual.

use super::window::SPOT_PX;
use super::window::{LANES, Window, clipped, gaussian};

/// The end of a spot in a fit of the lattice (standard deviations): 3 % of its height remains. Farther: slower by the square.
pub(crate) const REACH_FITTED: f32 = 2.65;

/// Sums of one spot g times the weighted residual, and of the weights.
#[derive(Clone, Copy, Default)]
pub(super) struct Moments {
    pub height: f32,
    pub along: [f32; 2],
    pub width: f32,
    /// Σ w·g², and the same times d² and times d⁴, d the distance from the spot's centre.
    pub weight: f32,
    pub spread: f32,
    pub tails: f32,
}

/// One spot's heights along x and along y, within the window.
pub(super) struct Profile {
    start: [usize; 2],
    rows: usize,
    /// Pixels along x, padded to a multiple of [`LANES`] by zeros.
    padded: usize,
    /// Along x: exp(−x²/2σ²), and that times x and x².
    across: [[f32; SPOT_PX]; 3],
    down: [f32; SPOT_PX],
    first_y: f32,
}

impl Profile {
    /// A spot without pixels.
    pub const NONE: Self = Self {
        start: [0; 2],
        rows: 0,
        padded: 0,
        across: [[0.0; SPOT_PX]; 3],
        down: [0.0; SPOT_PX],
        first_y: 0.0,
    };

    /// Turns [`Profile::NONE`] in place into the spot at `centre` (in the window's pixels), as far as it lies within.
    pub fn place(&mut self, centre: [f32; 2], sigma: f32, window: Window) {
        let reach = REACH_FITTED * sigma;
        let (Some((x, columns)), Some((y, rows))) = (clipped(centre[0], reach, window.width), clipped(centre[1], reach, window.height))
        else {
            return;
        };
        (self.start, self.rows) = ([x as usize, y as usize], rows);
        self.padded = columns.next_multiple_of(LANES);
        self.first_y = y - centre[1];
        let first_x = x - centre[0];
        let variance = sigma * sigma;
        let half = 0.5 / variance;
        let height = |offset: f32| libm::expf(-half * offset * offset);
        let [plain, once, twice] = &mut self.across;
        gaussian(&mut plain[..columns], height(first_x), first_x, variance);
        gaussian(&mut self.down[..rows], height(self.first_y), self.first_y, variance);
        for (i, &height) in plain.iter().enumerate().take(columns) {
            let offset = first_x + i as f32;
            once[i] = height * offset;
            twice[i] = once[i] * offset;
        }
    }

    /// Adds the spot to an image with rows of `width`.
    pub fn add_to(&self, image: &mut [f32], width: usize, height: f32) {
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
    pub fn moments(&self, residual: &[f32], weight: &[f32], width: usize) -> Moments {
        let mut sums = [[0.0; LANES]; 7];
        for (j, &down) in self.down.iter().enumerate().take(self.rows) {
            let start = (self.start[1] + j) * width + self.start[0];
            let end = (start + self.padded).min(residual.len());
            let [height, along, wide, squares, spread, tails] = self.dots(&residual[start..end], &weight[start..end]);
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
        let [height, along, across, width, weight, spread, tails] = sums.map(|lanes| lanes.iter().sum());
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

/// The values of a spot's three profiles along x, in one group of lanes.
type Lines<'a> = ((&'a [f32; LANES], &'a [f32; LANES]), &'a [f32; LANES]);
