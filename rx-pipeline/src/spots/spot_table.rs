//! The spots of 64 LEDs of one width at any positions: one factor for the columns and one for the rows.

use super::window::SPOT_PX;
use super::window::{LANES, gaussian, whole};
use link::panel::{LEDS, SIDE};

/// The end of a spot for reading (standard deviations), as far as [`SPOT_PX`] allows. Nearer: light of an LED counts as its neighbour's.
const REACH_READ: f32 = 3.3;
/// The squared distance from which spots do not overlap (variances of a spot): the product of two has fallen to exp(−5) = 0.7 % there.
/// Farther: slower.
pub(crate) const OVERLAP: f32 = 20.0;

/// The images of 64 LEDs of light 1.
pub(crate) struct SpotTable {
    /// The variance of a spot in either direction, in px²: lens blur, LED and pixel together.
    pub variance: f32,
    /// The positions of the LEDs, in px of the image.
    pub centre: [[f32; 2]; LEDS],
    /// First column and row of each spot.
    first: [[u8; 2]; LEDS],
    /// Columns and rows of each spot: the columns a multiple of [`LANES`].
    pub taps: [usize; 2],
    across: [[f32; SPOT_PX]; LEDS],
    down: [[f32; SPOT_PX]; LEDS],
}

impl SpotTable {
    pub const fn new() -> Self {
        Self {
            variance: 0.0,
            centre: [[0.0; 2]; LEDS],
            first: [[0; 2]; LEDS],
            taps: [0; 2],
            across: [[0.0; SPOT_PX]; LEDS],
            down: [[0.0; SPOT_PX]; LEDS],
        }
    }

    /// Computes the spots of the given centres and variance in an image of `width` × `height` pixels, at most 256 × 256, with rows of
    /// `stride`, a multiple of [`LANES`] and at least the width.
    pub fn place(&mut self, variance: f32, [width, height]: [usize; 2], stride: usize) {
        self.variance = variance;
        let reach = libm::ceilf(REACH_READ * libm::sqrtf(variance)).min(SPOT_PX as f32) as usize;
        let wanted = (2 * reach).next_multiple_of(LANES).min(SPOT_PX);
        self.taps = [wanted.min(stride), wanted.min(height)];
        let half = 0.5 / variance;
        let area = libm::sqrtf(2.0 * core::f32::consts::PI * variance);
        let density = |offset: f32| libm::expf(-offset * offset * half) / area;
        for led in 0..LEDS {
            let [x, y] = self.centre[led];
            let (left, top) = (whole(x, self.taps[0], stride), whole(y, self.taps[1], height));
            self.first[led] = [left, top].map(|first| first as u8);
            let across = &mut self.across[led][..self.taps[0]];
            let down = &mut self.down[led][..self.taps[1]];
            let (dx, dy) = (left as f32 - x, top as f32 - y);
            gaussian(across, density(dx), dx, variance);
            gaussian(down, density(dy), dy, variance);
            // Padding columns have no pixel.
            self.across[led][..self.taps[0]]
                .iter_mut()
                .skip(width.saturating_sub(left))
                .for_each(|value| *value = 0.0);
        }
    }

    /// First column and row of a spot.
    pub fn first(&self, led: usize) -> [usize; 2] {
        self.first[led].map(usize::from)
    }

    pub fn across(&self, led: usize) -> &[f32] {
        &self.across[led][..self.taps[0]]
    }

    pub fn down(&self, led: usize) -> &[f32] {
        &self.down[led][..self.taps[1]]
    }

    /// The factor of row `y`, if the spot reaches there.
    pub fn down_at(&self, led: usize, y: usize) -> Option<f32> {
        let row = y.checked_sub(self.first(led)[1])?;
        self.down(led).get(row).copied()
    }

    /// The greatest value of a spot.
    pub fn peak(&self) -> f32 {
        1.0 / (2.0 * core::f32::consts::PI * self.variance)
    }

    /// The least cost of a set of flips relative to the sum of their single costs: the least eigenvalue of the spots' inner products, along
    /// infinite rows and columns.
    pub fn independence(&self) -> f32 {
        [1, SIDE]
            .map(|next| {
                let distance = [0, 1].map(|axis| self.centre[next][axis] - self.centre[0][axis]);
                let squared = distance[0] * distance[0] + distance[1] * distance[1];
                let beside = libm::expf(-0.25 * squared / self.variance);
                let beside_4 = beside * beside * beside * beside;
                (1.0 - 2.0 * beside + 2.0 * beside_4).max(0.0)
            })
            .iter()
            .product()
    }

    /// Whether the spots of two LEDs have pixels in common.
    pub fn touch(&self, a: usize, b: usize) -> bool {
        [0, 1]
            .into_iter()
            .all(|axis| self.first(a)[axis].abs_diff(self.first(b)[axis]) < self.taps[axis])
    }

    /// Whether the spots of two LEDs overlap significantly.
    pub fn overlap(&self, a: usize, b: usize) -> bool {
        let [dx, dy] = [0, 1].map(|axis| self.centre[a][axis] - self.centre[b][axis]);
        dx * dx + dy * dy < OVERLAP * self.variance
    }
}
