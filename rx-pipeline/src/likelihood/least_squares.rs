//! A first guess of light and levels: least squares on the light of the 64 LEDs.

use super::image::Image;
use super::levels::Levels;
use crate::spots::{SpotTable, dot};
use link::panel::LEDS;

/// Rounds, at most (count).
const ROUNDS: usize = 20;
/// Rounds end if no LED's light changes by more (share of the range of all). Lower: slower.
const SETTLED: f32 = 0.01;
/// Addition to the diagonal (share of it), because noise hides the difference of close LEDs. Higher: less contrast; lower: more noise.
const RIDGE: f32 = 0.05;

/// The light of each LED above a common background, times its area, and that background, by least squares with a ridge that
/// draws LEDs towards their mean.
pub(super) struct LeastSquares {
    pub background: f32,
    pub light: [f32; LEDS],
    /// The approximate mean square residual of root light.
    pub left: f32,
}

impl LeastSquares {
    /// Solves for the light in `image`. The image's roots hold the residual light afterwards.
    pub fn solve<const PIXELS: usize>(image: &mut Image<PIXELS>, spots: &SpotTable) -> Self {
        let [width, height] = image.size;
        let background = image.ground();
        image.start_from_light(background);
        let mut found = Self {
            background,
            light: [0.0; LEDS],
            left: 0.0,
        };
        let weight: [f32; LEDS] = core::array::from_fn(|led| {
            let down: f32 = spots.down(led).iter().map(|d| d * d).sum();
            1.0 / (dot(spots.across(led), spots.across(led)) * down * (1.0 + RIDGE))
        });
        for _ in 0..ROUNDS {
            let mut greatest = 0.0f32;
            for (led, weight) in weight.iter().enumerate() {
                greatest = greatest.max(found.improve(image, spots, led, *weight).abs());
            }
            if greatest < SETTLED * found.range() {
                break;
            }
            let rest: f32 = (0..height)
                .map(|row| image.root[row * image.stride..][..width].iter().sum::<f32>())
                .sum();
            found.move_background(image, rest / (width * height) as f32);
        }
        found.left = image.mean_square_of_rest();
        found
    }

    /// Moves one LED's light to its optimum, given the others; returns the change.
    fn improve<const PIXELS: usize>(&mut self, image: &mut Image<PIXELS>, spots: &SpotTable, led: usize, weight: f32) -> f32 {
        let [x, y] = spots.first(led);
        let across = spots.across(led);
        let mut along = 0.0;
        for (row, &down) in (y..).zip(spots.down(led)) {
            along += down * dot(&image.root[row * image.stride + x..][..across.len()], across);
        }
        let mean = self.light.iter().sum::<f32>() / LEDS as f32;
        let change = weight * along - (self.light[led] - mean) * RIDGE / (1.0 + RIDGE);
        self.light[led] += change;
        for (row, &down) in (y..).zip(spots.down(led)) {
            let scale = change * down;
            let rest = &mut image.root[row * image.stride + x..];
            for (rest, &across) in rest.iter_mut().zip(across) {
                *rest -= scale * across;
            }
        }
        change
    }

    /// The difference between the brightest and the darkest LED.
    fn range(&self) -> f32 {
        let (low, high) = self.light.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &light| {
            (low.min(light), high.max(light))
        });
        high - low
    }

    fn move_background<const PIXELS: usize>(&mut self, image: &mut Image<PIXELS>, change: f32) {
        self.background += change;
        let used = image.stride * image.size[1];
        for rest in &mut image.root[..used] {
            *rest -= change;
        }
    }

    /// Sets `levels` to those of the two groups of LEDs on that `ground`.
    pub fn split(&self, ground: &[f32; LEDS], levels: &mut Levels) {
        let [low, high] = two_groups(core::array::from_fn(|led| self.light[led] - ground[led]));
        (levels.background, levels.off, levels.contrast) = (self.background, low, high - low);
    }

    /// The light of each LED in contrasts above Off, by those levels.
    pub fn lit(&self, levels: &Levels) -> [f32; LEDS] {
        self.light.map(|light| (light - levels.off) / levels.contrast)
    }
}

/// The means of the two groups of values that are farthest apart (Otsu 1979); twice the mean of all, if they are equal.
pub(super) fn two_groups(mut values: [f32; LEDS]) -> [f32; 2] {
    values.sort_unstable_by(f32::total_cmp);
    let total: f32 = values.iter().sum();
    let (mut below, mut best) = (0.0, 0.0);
    let mut means = [total / LEDS as f32; 2];
    for (count, &value) in (1u8..LEDS as u8).zip(&values) {
        below += value;
        let count = f32::from(count);
        let (low, high) = (below / count, (total - below) / (LEDS as f32 - count));
        let between = count * (LEDS as f32 - count) * (high - low) * (high - low);
        if between > best {
            (best, means) = (between, [low, high]);
        }
    }
    means
}

#[cfg(test)]
mod tests;
