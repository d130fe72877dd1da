//! The contrast of an exposure of a square carrier as a function of the phase.

use link::waveform::Waveform;

/// Number of phase steps in a cycle.
pub(super) const PHASES: usize = 256;
/// For each shape that is tried, the part of a cycle by which the exposure exceeds whole cycles. Beyond a half, the shapes repeat with the
/// opposite sign.
const EXCESS: [f64; 4] = [0.06, 0.2, 0.35, 0.5];
/// Number of shapes that are tried.
pub(super) const SHAPES: usize = EXCESS.len();

/// The contrast by the phase of an exposure's middle: how much longer a 1 is lit than a 0, at most 1.
pub(super) type Shape = [f32; PHASES];

/// All shapes.
pub(super) static WAVEFORMS: [Shape; SHAPES] = {
    let mut shapes = [[0.0; PHASES]; SHAPES];
    let mut shape = 0;
    while shape < SHAPES {
        let mut phase = 0;
        while phase < PHASES {
            let (middle, reach) = (phase as f64 / PHASES as f64, 0.5 * EXCESS[shape]);
            let seen = Waveform::integral(middle + reach) - Waveform::integral(middle - reach);
            shapes[shape][phase] = (seen / EXCESS[shape]) as f32;
            phase += 1;
        }
        shape += 1;
    }
    shapes
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_see_what_a_sum_over_their_moments_sees() {
        for (shape, excess) in WAVEFORMS.iter().zip(EXCESS) {
            for (phase, &seen) in shape.iter().enumerate() {
                let moment = |i: i32| phase as f64 / PHASES as f64 + excess * ((f64::from(i) + 0.5) / 1000.0 - 0.5);
                let sum: f64 = (0..1000).map(|i| libm::cos(core::f64::consts::TAU * moment(i)).signum()).sum();
                assert!((f64::from(seen) - sum / 1000.0).abs() < 0.02, "{excess} {phase}");
            }
        }
    }
}
