//! The image of each LED: a Gaussian spot, in one factor for the columns and one for the rows.

use link::panel::{LEDS, SIDE};

/// The most pixels of a spot in a row or column; a multiple of [`LANES`].
pub(super) const TAPS: usize = 20;
/// Rows are worked on in groups of so many pixels.
pub(super) const LANES: usize = 4;
/// Spots reach so many standard deviations to either side, as far as [`TAPS`] allows.
const REACH: f32 = 3.3;

/// The images of 64 LEDs of light 1.
pub(super) struct Spots {
    /// The variance of a spot in either direction, in px²: lens blur, LED and pixel together.
    pub variance: f32,
    /// Where the LEDs are, in px of the image.
    pub centre: [[f32; 2]; LEDS],
    /// First column and row of each spot.
    pub first: [[usize; 2]; LEDS],
    /// Columns and rows of each spot: the columns a multiple of [`LANES`].
    pub taps: [usize; 2],
    across: [[f32; TAPS]; LEDS],
    down: [[f32; TAPS]; LEDS],
}

impl Spots {
    pub const fn new() -> Self {
        Self {
            variance: 0.0,
            centre: [[0.0; 2]; LEDS],
            first: [[0; 2]; LEDS],
            taps: [0; 2],
            across: [[0.0; TAPS]; LEDS],
            down: [[0.0; TAPS]; LEDS],
        }
    }

    /// Computes the spots of the given centres and variance in an image of `width` × `height` pixels in rows of
    /// `stride`, a multiple of [`LANES`] and at least that.
    pub fn place(&mut self, variance: f32, [width, height]: [usize; 2], stride: usize) {
        self.variance = variance;
        let reach = libm::ceilf(REACH * libm::sqrtf(variance)).min(TAPS as f32) as usize;
        let wanted = (2 * reach).next_multiple_of(LANES).min(TAPS);
        self.taps = [wanted.min(stride), wanted.min(height)];
        for led in 0..LEDS {
            let [x, y] = self.centre[led];
            self.first[led] = [
                first(x, self.taps[0], stride),
                first(y, self.taps[1], height),
            ];
            let [left, top] = self.first[led];
            profile(
                x - left as f32,
                variance,
                &mut self.across[led][..self.taps[0]],
            );
            profile(
                y - top as f32,
                variance,
                &mut self.down[led][..self.taps[1]],
            );
            // Columns that only fill the row up have no pixel.
            self.across[led][..self.taps[0]]
                .iter_mut()
                .skip(width.saturating_sub(left))
                .for_each(|value| *value = 0.0);
        }
    }

    pub fn across(&self, led: usize) -> &[f32] {
        &self.across[led][..self.taps[0]]
    }

    pub fn down(&self, led: usize) -> &[f32] {
        &self.down[led][..self.taps[1]]
    }

    /// The factor of row `y`, if the spot reaches there.
    pub fn down_at(&self, led: usize, y: usize) -> Option<f32> {
        let row = y.checked_sub(self.first[led][1])?;
        self.down(led).get(row).copied()
    }

    /// The greatest value of a spot.
    pub fn peak(&self) -> f32 {
        1.0 / (2.0 * core::f32::consts::PI * self.variance)
    }

    /// The least part of what flips cost one by one that they cost together, however they make up for one another: the least
    /// eigenvalue of the spots' inner products, along rows and columns without end.
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
            .all(|axis| self.first[a][axis].abs_diff(self.first[b][axis]) < self.taps[axis])
    }

    /// Whether the spots of two LEDs have pixels in common to speak of.
    pub fn overlap(&self, a: usize, b: usize) -> bool {
        let [dx, dy] = [0, 1].map(|axis| self.centre[a][axis] - self.centre[b][axis]);
        dx * dx + dy * dy < OVERLAP * self.variance
    }
}

/// Spots overlap up to a squared distance of so many variances: there the product of two has fallen to exp(−5) = 0.7 %.
const OVERLAP: f32 = 20.0;

/// The first of `taps` pixels around `centre`, all within 0..`end`.
fn first(centre: f32, taps: usize, end: usize) -> usize {
    let first = libm::roundf(centre - (taps as f32 - 1.0) / 2.0);
    // A cast of what is negative is 0.
    (first as usize).min(end - taps)
}

/// A Gaussian density about `centre` at 0, 1, 2…, by recurrence: the ratio of neighbours shrinks by a constant factor.
fn profile(centre: f32, variance: f32, values: &mut [f32]) {
    let half = 0.5 / variance;
    let mut value =
        libm::expf(-centre * centre * half) / libm::sqrtf(2.0 * core::f32::consts::PI * variance);
    let mut ratio = libm::expf((2.0 * centre - 1.0) * half);
    let shrink = libm::expf(-2.0 * half);
    for to in values {
        *to = value;
        value *= ratio;
        ratio *= shrink;
    }
}

/// Σ a·b over the length of `a`, which is a multiple of [`LANES`].
pub(super) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}
