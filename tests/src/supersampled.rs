//! The renderer that is right by brute force: the [straightforward](crate::straightforward) one on a raster eight times finer.
//!
//! Each pixel is 8 × 8 cells; a cell whose centre is in a disc is lit, the blur acts on cells with its true σ, and a pixel is
//! the mean of its cells. What is left of the error is the discs' ragged rims.

use crate::straightforward::{Panel, blur, encode};

/// Cells along a pixel's side.
const FINER: usize = 8;

/// Draws the panel into a square of `side` pixels, as grey levels.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    encode(&linear(panel, sigma_px, side), gamma)
}

/// The same in linear values.
pub fn linear(panel: &Panel, sigma_px: f64, side: usize) -> Vec<f64> {
    let sharp = cells(panel, side);
    pixels(&blur(&sharp, side * FINER, sigma_px * FINER as f64), side)
}

/// The sharp picture, cell by cell.
pub(crate) fn cells(panel: &Panel, side: usize) -> Vec<f64> {
    let cells = side * FINER;
    let mut sharp = vec![1.0; cells * cells];
    for led in 0..64 {
        let (centre, light) = panel.led(led);
        light_disc(&mut sharp, cells, centre, panel.radius_px, light);
    }
    sharp
}

/// The mean of each pixel's cells.
pub(crate) fn pixels(cells: &[f64], side: usize) -> Vec<f64> {
    let mean = |pixel: usize| {
        let (x, y) = (pixel % side * FINER, pixel / side * FINER);
        let rows = (y..y + FINER).map(|row| &cells[row * side * FINER + x..][..FINER]);
        rows.flatten().sum::<f64>() / (FINER * FINER) as f64
    };
    (0..side * side).map(mean).collect()
}

fn light_disc(sharp: &mut [f64], cells: usize, centre: [f64; 2], radius: f64, light: f64) {
    // The first pixel's centre is at 0, and so is the middle of its cells.
    let cell = |px: f64| (px + 0.5) * FINER as f64 - 0.5;
    let (centre, radius) = (centre.map(cell), radius * FINER as f64);
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
