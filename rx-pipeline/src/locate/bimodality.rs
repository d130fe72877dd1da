//! Bayesian comparison of two models: spots of two brightnesses, and spots of any brightness.
//!
//! Overlapping spots can imitate anything smooth, like the dots of a halftone. A panel therefore has to be likelier than spots of any
//! brightness in the same places, whose brightnesses are normal with the same mean μ and variance A. A panel's brightnesses are normal
//! around those of its bits, with a far smaller variance V, because LEDs are not quite equal. If spots overlap, V is 0, because it could
//! imitate anything smooth, too. With d the panel's brightnesses less μ, h the spots' correlation with the residual, G their overlaps and n
//! the residual variance of a pixel,
//!
//!   log odds = ½·(2·dᵀ·h + dᵀ·G·d)/n − 64·log 2 + free(h, V) − free(h + G·d, A),
//!   free(b, A) = ½·bᵀ·(G + n/A)⁻¹·b/n − ½·log det(1 + A·G/n):
//!
//! the gain from the panel's bits, less their description length, against the same for free brightnesses. On a lattice with right angles G
//! is a Kronecker product, so the eigenvectors of two 8×8 matrices suffice.

use crate::spots::{LatticeModel, Slope};
use link::panel::{LEDS, SIDE};
use nalgebra::SMatrix;

/// The spread of LEDs of one state (share of the step from Off to On, standard deviation). Higher: more false positives.
const LED_SPREAD: f32 = 0.12;

type Square = SMatrix<f32, SIDE, SIDE>;

/// The log odds (natural logarithm) of a panel in a single frame against spots of any brightness. `noise` is a lower bound of the variance
/// of a pixel, in grey levels squared.
pub(super) fn log_odds(spots: &LatticeModel, slope: &Slope, noise: f32) -> f32 {
    let noise = noise.max(slope.squares / slope.pixels.max(1) as f32);
    let weight = (0..LEDS).map(|led| slope.led_weight(led)).sum::<f32>() / LEDS as f32;
    // A scrambled bit has a mean of a half and a variance of a quarter.
    let prior = 0.25 * spots.contrast * spots.contrast * weight / noise;
    if !(prior.is_finite() && prior > 0.0) {
        return f32::NEG_INFINITY;
    }
    let root = |led: usize| libm::sqrtf(slope.led_weight(led).max(f32::MIN_POSITIVE));
    let square = |of: &dyn Fn(usize) -> f32| Square::from_fn(|row, column| of(SIDE * row + column));
    let deviation = square(&|led| (spots.state[led] - 0.5) * spots.contrast * root(led));
    let agreement = square(&|led| slope.led_agreement(led) / root(led));
    let [across, down] = spots.lattice.pitch().map(|pitch| overlaps(pitch / spots.sigma));
    let overlapped = down * deviation * across;
    let by_bits = 0.5 * deviation.dot(&(2.0 * agreement + overlapped)) / noise;
    let (rows, columns) = (down.symmetric_eigen(), across.symmetric_eigen());
    let free = |agreement: Square, prior: f32| {
        let mode = rows.eigenvectors.transpose() * agreement * columns.eigenvectors;
        let (mut explained, mut length) = (0.0, 0.0);
        for (i, u) in rows.eigenvalues.iter().enumerate() {
            for (j, v) in columns.eigenvalues.iter().enumerate() {
                let overlap = (u * v).max(0.0);
                explained += mode[(i, j)] * mode[(i, j)] / (overlap + 1.0 / prior) / noise;
                length += libm::log1pf(overlap * prior);
            }
        }
        0.5 * (explained - length)
    };
    // In units of a scrambled bit's standard deviation, a half.
    let spread = if spots.apart() < 1.0 {
        0.0
    } else {
        4.0 * LED_SPREAD * LED_SPREAD * prior
    };
    let panel = by_bits - LEDS as f32 * core::f32::consts::LN_2 + free(agreement, spread);
    panel - free(agreement + overlapped, prior)
}

/// Overlaps of eight spots in a line with this pitch in standard deviations.
fn overlaps(pitch: f32) -> Square {
    Square::from_fn(|i, j| {
        let distance = i.abs_diff(j) as f32 * pitch;
        libm::expf(-0.25 * distance * distance)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit;
    use crate::frame::Frame;
    use crate::lattice::Lattice;
    use crate::spots::{GreyMetric, Observation, Residuals};
    use crate::synthetic::Scene;

    const SCENE: Scene = Scene {
        pitch_px: 2.9,
        noise_grey: 2.0,
        ..Scene::PLAIN
    };

    fn odds_of(pixels: &[u8]) -> f32 {
        let frame = Frame::new(pixels, SCENE.width, SCENE.height).unwrap();
        let metric = GreyMetric::new(&link::camera::Camera::default());
        let observation = Observation {
            frame: &frame,
            earlier: None,
            metric: &metric,
            within: None,
            shade: None,
        };
        let lattice = Lattice::through(&SCENE.corners());
        let start = LatticeModel {
            lattice,
            sigma: 1.58,
            background: 1.0,
            off: 0.0,
            contrast: 0.0,
            state: core::array::from_fn(|led| (SCENE.bits >> led & 1) as f32),
        };
        let window = fit::window(&lattice, 0.6, (SCENE.width, SCENE.height)).unwrap();
        let mut residuals = std::boxed::Box::new(Residuals::<4096>::new());
        let fitted = fit::levenberg_marquardt(&mut residuals, observation, window, start, 20).unwrap();
        log_odds(&fitted.spots, &fitted.slope, 4.0)
    }

    #[test]
    fn two_brightnesses_are_told_from_many() {
        assert!(odds_of(&SCENE.render().pixels) > 40.0);
        // The mean of several panels has one brightness more than there are panels.
        let panels = [1u64, 0x2545_f491_4f6c_dd1d, 0x9e37_79b9_7f4a_7c15, 0xd129_42a8_05b3_6f2e].map(|mask| {
            Scene {
                bits: SCENE.bits ^ mask,
                ..SCENE
            }
            .render()
            .pixels
        });
        let mean: std::vec::Vec<u8> = (0..SCENE.width * SCENE.height)
            .map(|i| (panels.iter().map(|pixels| u32::from(pixels[i])).sum::<u32>() / 4) as u8)
            .collect();
        assert!(odds_of(&mean) < 0.0);
    }
}
