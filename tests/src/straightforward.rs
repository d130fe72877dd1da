//! The renderer that one writes first: the yardstick of speed, and of what drawing on whole pixels does.
//!
//! Discs are sampled 8 × 8 times a pixel, the picture of whole pixels is blurred by a separable Gaussian cut at ±4σ, and every
//! pixel goes through `powf`. The blur so acts on what the pixels have already averaged. A lens blurs before: the order
//! matters because discs of a few pixels hold detail finer than pixels can carry, which comes out shifted with the
//! sub-pixel phase (aliasing) and widens the spread of the features.

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

/// Draws the panel into a square of `side` pixels.
pub fn render(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    let mut linear = vec![1.0f64; side * side];
    for led in 0..64 {
        let light = if panel.bits >> led & 1 == 1 {
            panel.on
        } else {
            panel.off
        };
        let centre = [
            panel.first_px[0] + (led % 8) as f64 * panel.pitch_px,
            panel.first_px[1] + (led / 8) as f64 * panel.pitch_px,
        ];
        add_disc(&mut linear, side, centre, panel.radius_px, light - 1.0);
    }
    let kernel = gaussian(sigma_px);
    let blurred = transpose(
        &blur_rows(
            &transpose(&blur_rows(&linear, side, &kernel), side),
            side,
            &kernel,
        ),
        side,
    );
    blurred
        .iter()
        .map(|&x| (118.0 * x.powf(1.0 / gamma)).round().clamp(0.0, 255.0) as u8)
        .collect()
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
    let mut blurred = Vec::with_capacity(image.len());
    for row in image.chunks_exact(side) {
        padded[reach..reach + side].copy_from_slice(row);
        blurred.extend(
            padded
                .windows(kernel.len())
                .map(|window| window.iter().zip(kernel).map(|(a, b)| a * b).sum::<f64>()),
        );
    }
    blurred
}

fn transpose(image: &[f64], side: usize) -> Vec<f64> {
    (0..side * side)
        .map(|i| image[(i % side) * side + i / side])
        .collect()
}
