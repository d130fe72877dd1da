//! Discs, blur and grey levels on a raster.

use super::panel::Panel;

/// Grey levels by the formula, pixel by pixel.
pub(super) fn encode(linear: &[f64], gamma: f64) -> Vec<u8> {
    linear
        .iter()
        .map(|&x| (118.0 * x.powf(1.0 / gamma)).round().clamp(0.0, 255.0) as u8)
        .collect()
}

/// A separable Gaussian truncated at ±4σ, along the rows and then, in the transposed picture, along the columns.
pub(super) fn blur(sharp: &[f64], side: usize, sigma_px: f64) -> Vec<f64> {
    let kernel = gaussian(sigma_px);
    let along_rows = transpose(&blur_rows(sharp, side, &kernel), side);
    transpose(&blur_rows(&along_rows, side, &kernel), side)
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

fn light_disc(sharp: &mut [f64], cells: usize, finer: usize, centre: [f64; 2], radius: f64, light: f64) {
    // The first pixel's centre is at 0, and so is the middle of its cells.
    let cell = |px: f64| (px + 0.5) * finer as f64 - 0.5;
    let (centre, radius) = (centre.map(cell), radius * finer as f64);
    let span = |c: f64| (c - radius).ceil().max(0.0) as usize..((c + radius) as usize + 1).min(cells);
    for y in span(centre[1]) {
        for x in span(centre[0]) {
            if (x as f64 - centre[0]).hypot(y as f64 - centre[1]) <= radius {
                sharp[y * cells + x] = light;
            }
        }
    }
}

fn gaussian(sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as i32;
    let weights: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (f64::from(i) / sigma).powi(2)).exp()).collect();
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
    (0..side * side).map(|i| image[(i % side) * side + i / side]).collect()
}
