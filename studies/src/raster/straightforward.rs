//! The renderer that one writes first: the yardstick of speed, and of what drawing on whole pixels does.
//!
//! Discs are sampled 8 × 8 times a pixel, each within the box around it; the picture of whole pixels is blurred by a separable Gaussian cut at ±4σ, and every
//! pixel goes through `powf`. Only the panel's surroundings are drawn, and both passes of the blur run along rows of memory, as
//! any version that is meant to be used would have it; nothing else is done for speed. The blur so acts on what the pixels have already averaged. A lens blurs before: the order
//! matters because discs of a few pixels hold detail finer than pixels can carry, which comes out shifted with the
//! sub-pixel phase (aliasing) and widens the spread of the features.

use super::supersampled::{cells, pixels};

/// A parallel panel: centre of its first LED, pitch and LED radius in px, linear values of LEDs before a background of 1.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// 64 bits, LED 8·row + column at that bit.
    pub bits: u64,
    /// Centre of LED 0, in px.
    pub first_px: [f64; 2],
    /// Distance of neighbouring LEDs in px.
    pub pitch_px: f64,
    /// Radius of an LED in px.
    pub radius_px: f64,
    /// Linear value of an Off LED.
    pub off: f64,
    /// Linear value of an On LED.
    pub on: f64,
}

const SAMPLES: usize = 8;

/// Draws the panel into a square of `side` pixels, as grey levels.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    encode(&linear(panel, sigma_px, side), gamma)
}

/// The same picture with the discs drawn on a whole raster eight times finer, as one does who does not care about time: a
/// pixel is the mean of its cells, and the blur acts on pixels.
pub fn render_by_raster(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    let sharp = pixels(&cells(panel, side, SAMPLES), side, SAMPLES);
    encode(&blur(&sharp, side, sigma_px), gamma)
}

/// The linear values of [`render`].
pub fn linear(panel: &Panel, sigma_px: f64, side: usize) -> Vec<f64> {
    let mut sharp = vec![1.0; side * side];
    for led in 0..64 {
        let (centre, light) = panel.led(led);
        add_disc(&mut sharp, side, centre, panel.radius_px, light - 1.0);
    }
    blur(&sharp, side, sigma_px)
}

impl Panel {
    /// Centre and linear value of an LED.
    pub fn led(&self, led: usize) -> ([f64; 2], f64) {
        let centre = [
            self.first_px[0] + (led % 8) as f64 * self.pitch_px,
            self.first_px[1] + (led / 8) as f64 * self.pitch_px,
        ];
        let is_on = self.bits >> led & 1 == 1;
        (centre, if is_on { self.on } else { self.off })
    }
}

/// Grey levels by the formula, pixel by pixel.
pub(super) fn encode(linear: &[f64], gamma: f64) -> Vec<u8> {
    linear
        .iter()
        .map(|&x| (118.0 * x.powf(1.0 / gamma)).round().clamp(0.0, 255.0) as u8)
        .collect()
}

/// A separable Gaussian cut at ±4σ, along the rows and then, the picture transposed, along the columns.
pub(super) fn blur(sharp: &[f64], side: usize, sigma_px: f64) -> Vec<f64> {
    let kernel = gaussian(sigma_px);
    let along_rows = transpose(&blur_rows(sharp, side, &kernel), side);
    transpose(&blur_rows(&along_rows, side, &kernel), side)
}

fn add_disc(linear: &mut [f64], side: usize, centre: [f64; 2], radius: f64, light: f64) {
    let span = |c: f64| {
        (
            (c - radius).round().max(0.0) as usize,
            ((c + radius).round() as usize).min(side - 1),
        )
    };
    let ((left, right), (top, bottom)) = (span(centre[0]), span(centre[1]));
    let offset = |sample: usize| (sample as f64 + 0.5) / SAMPLES as f64 - 0.5;
    for y in top..=bottom {
        for x in left..=right {
            let inside = (0..SAMPLES * SAMPLES).filter(|s| {
                let [dx, dy] = [
                    x as f64 + offset(s % SAMPLES) - centre[0],
                    y as f64 + offset(s / SAMPLES) - centre[1],
                ];
                dx * dx + dy * dy <= radius * radius
            });
            linear[y * side + x] += light * inside.count() as f64 / (SAMPLES * SAMPLES) as f64;
        }
    }
}

fn gaussian(sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as i32;
    let weights: Vec<f64> = (-reach..=reach)
        .map(|i| (-0.5 * (f64::from(i) / sigma).powi(2)).exp())
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

/// Rows blurred, the background of 1 continued beyond the edges.
fn blur_rows(image: &[f64], side: usize, kernel: &[f64]) -> Vec<f64> {
    let reach = kernel.len() / 2;
    let mut padded = vec![1.0; side + 2 * reach];
    let mut blurred = vec![0.0; image.len()];
    for (row, target) in image.chunks_exact(side).zip(blurred.chunks_exact_mut(side)) {
        padded[reach..reach + side].copy_from_slice(row);
        for (weight, shifted) in kernel.iter().zip(padded.windows(side)) {
            for (sum, value) in target.iter_mut().zip(shifted) {
                *sum += weight * value;
            }
        }
    }
    blurred
}

fn transpose(image: &[f64], side: usize) -> Vec<f64> {
    (0..side * side)
        .map(|i| image[(i % side) * side + i / side])
        .collect()
}
