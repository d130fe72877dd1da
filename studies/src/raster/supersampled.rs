//! The renderer that is right by brute force: the [straightforward](super::straightforward) one on a finer raster.
//!
//! Each pixel is `finer` × `finer` cells; a cell whose centre is in a disc is lit, the blur acts on cells with its true σ, and a pixel is
//! the mean of its cells. What is left of the error is the discs' ragged rims. With one cell a pixel it is point sampling.

use super::straightforward::{Panel, blur, encode};

/// Draws the panel into a square of `side` pixels, as grey levels, with `finer` cells along a pixel's side.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize, finer: usize) -> Vec<u8> {
    encode(&linear(panel, sigma_px, side, finer), gamma)
}

/// The same in linear values.
pub fn linear(panel: &Panel, sigma_px: f64, side: usize, finer: usize) -> Vec<f64> {
    let sharp = cells(panel, side, finer);
    let blurred = blur(&sharp, side * finer, sigma_px * finer as f64);
    pixels(&blurred, side, finer)
}

/// The sharp picture, cell by cell.
pub(super) fn cells(panel: &Panel, side: usize, finer: usize) -> Vec<f64> {
    let cells = side * finer;
    let mut sharp = vec![1.0; cells * cells];
    for led in 0..64 {
        let (centre, light) = panel.led(led);
        light_disc(&mut sharp, cells, finer, centre, panel.radius_px, light);
    }
    sharp
}

/// The mean of each pixel's cells.
pub(super) fn pixels(cells: &[f64], side: usize, finer: usize) -> Vec<f64> {
    let mean = |pixel: usize| {
        let (x, y) = (pixel % side * finer, pixel / side * finer);
        let rows = (y..y + finer).map(|row| &cells[row * side * finer + x..][..finer]);
        rows.flatten().sum::<f64>() / (finer * finer) as f64
    };
    (0..side * side).map(mean).collect()
}

fn light_disc(
    sharp: &mut [f64],
    cells: usize,
    finer: usize,
    centre: [f64; 2],
    radius: f64,
    light: f64,
) {
    // The first pixel's centre is at 0, and so is the middle of its cells.
    let cell = |px: f64| (px + 0.5) * finer as f64 - 0.5;
    let (centre, radius) = (centre.map(cell), radius * finer as f64);
    let span =
        |c: f64| (c - radius).ceil().max(0.0) as usize..((c + radius) as usize + 1).min(cells);
    for y in span(centre[1]) {
        for x in span(centre[0]) {
            if (x as f64 - centre[0]).hypot(y as f64 - centre[1]) <= radius {
                sharp[y * cells + x] = light;
            }
        }
    }
}
