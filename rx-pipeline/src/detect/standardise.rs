//! Features in units of their own scatter over the panel.

use link::panel::LEDS;

/// The values minus their mean, divided by their standard deviation; all 0 if they are equal.
#[inline(always)]
pub(super) fn standardised(values: &[f32; LEDS]) -> [f32; LEDS] {
    let mean = sum(values) / LEDS as f32;
    let centred = values.map(|value| value - mean);
    let variance = sum(&centred.map(|value| value * value)) / LEDS as f32;
    let scale = if variance > f32::MIN_POSITIVE {
        1.0 / libm::sqrtf(variance)
    } else {
        0.0
    };
    centred.map(|value| value * scale)
}

/// The sum of a panel's values in eight parallel sums: vectorised, and the same on all processors.
#[inline(always)]
pub(super) fn sum(values: &[f32; LEDS]) -> f32 {
    let mut lanes = [0.0; 8];
    for eight in values.chunks_exact(8) {
        for (lane, value) in lanes.iter_mut().zip(eight) {
            *lane += value;
        }
    }
    lanes.iter().sum()
}
