//! The simplest renderer: the reference for speed, and for the effect of drawing on whole pixels.
//!
//! Discs are sampled 8 × 8 times a pixel, each within the box around it; the picture of whole pixels is blurred by a separable Gaussian
//! truncated at ±4σ, and every pixel goes through `powf`. Only the panel's surroundings are drawn, and both passes of the blur run along
//! rows of memory, as in any practical version; nothing else is optimised. So the blur acts on averages over pixels, while a lens blurs
//! before that. The order matters, because discs of a few pixels hold detail finer than pixels can represent: it is shifted with the
//! sub-pixel phase (aliasing) and widens the spread of the features.

use super::panel::Panel;
use super::raster::{blur, cells, encode, pixels};

const SAMPLES: usize = 8;

/// Draws the panel into a square of `side` pixels, as grey levels.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    encode(&linear(panel, sigma_px, side), gamma)
}

/// The same picture with the discs drawn on a whole raster eight times finer, the naive way: a pixel is the mean of its cells, and the blur
/// acts on pixels.
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
