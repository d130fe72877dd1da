//! Backgrounds behind a panel.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Background light, relative to white.
pub const GROUND: f64 = 0.18;

/// The background: an image with a margin.
pub struct Ground {
    side: usize,
    margin: f64,
    /// Row by row.
    pub light: Vec<f32>,
}

impl Ground {
    /// Draws walls, windows and lamps, some with fine structure, twice as wide as a frame.
    pub fn draw(random: &mut ChaCha8Rng, frame_side: usize, pitch_px: f64) -> Self {
        let side = 2 * frame_side;
        let mut light = vec![GROUND as f32; side * side];
        for _ in 0..random.random_range(20..80) {
            let size = [0; 2].map(|_| random.random_range(2.0..0.4 * frame_side as f64) as usize);
            let at = size.map(|size| random.random_range(0..side - size));
            let grey = (GROUND * random.random_range(0.1f64..1.0).exp2().powi(2) * 0.5) as f32;
            for y in at[1]..at[1] + size[1] {
                light[y * side + at[0]..y * side + at[0] + size[0]].fill(grey);
            }
        }
        // Lamps of an LED's width.
        for _ in 0..random.random_range(0..12) {
            let radius = (pitch_px * random.random_range(0.2..0.6)).max(1.0);
            let at = [0; 2].map(|_| random.random_range(radius + 1.0..side as f64 - radius - 1.0));
            let reach = radius as isize + 1;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    if (dx * dx + dy * dy) as f64 <= radius * radius {
                        let (x, y) = ((at[0] as isize + dx) as usize, (at[1] as isize + dy) as usize);
                        if x < side && y < side {
                            light[y * side + x] = (4.0 * GROUND) as f32;
                        }
                    }
                }
            }
        }
        Self {
            side,
            margin: side as f64 / 2.0,
            light,
        }
    }

    /// The interpolated light at a point, in px from the centre.
    pub fn at(&self, [x, y]: [f64; 2]) -> f32 {
        let last = (self.side - 2) as f64;
        let (x, y) = ((x + self.margin).clamp(0.0, last), (y + self.margin).clamp(0.0, last));
        let (left, top) = (x as usize, y as usize);
        let (right, down) = ((x - left as f64) as f32, (y - top as f64) as f32);
        let pixel = |dx: usize, dy: usize| self.light[(top + dy) * self.side + left + dx];
        let row = |dy: usize| pixel(0, dy) + right * (pixel(1, dy) - pixel(0, dy));
        row(0) + down * (row(1) - row(0))
    }
}
