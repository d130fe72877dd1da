//! The brute-force renderer: the [straightforward](super::straightforward) one on a finer raster.
//!
//! Each pixel is `finer` × `finer` cells; a cell whose centre is in a disc is lit, the blur acts on cells with its true σ, and a pixel is
//! the mean of its cells. The remaining error is at the discs' ragged rims. With one cell a pixel it is point sampling.

use super::panel::Panel;
use super::raster::{blur, cells, encode, pixels};

/// Draws the panel into a square of `side` pixels, as grey levels, with `finer` cells along a pixel's side.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize, finer: usize) -> Vec<u8> {
    encode(&linear(panel, sigma_px, side, finer), gamma)
}

/// As [`render`], in linear values.
pub fn linear(panel: &Panel, sigma_px: f64, side: usize, finer: usize) -> Vec<f64> {
    let sharp = cells(panel, side, finer);
    let blurred = blur(&sharp, side * finer, sigma_px * finer as f64);
    pixels(&blurred, side, finer)
}
