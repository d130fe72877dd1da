//! The threshold on grey alone that leaves the greatest variance between the classes (Otsu 1979).

use super::detection::bits_where;
use super::error::{DetectError, two_classes};
use link::panel::{LEDS, PanelFrame};

/// The cells above the threshold.
pub(super) fn split(grey: &[f32; LEDS]) -> Result<PanelFrame, DetectError> {
    let mut sorted = *grey;
    sorted.sort_unstable_by(f32::total_cmp);
    let mean = sorted.iter().sum::<f32>() / LEDS as f32;
    let (mut below, mut best, mut threshold) = (0.0, 0.0, f32::INFINITY);
    for (count, pair) in (1u8..).zip(sorted.windows(2)) {
        below += pair[0] - mean;
        // With q of the 64 cells below the threshold, and s the sum of their greys relative to the mean: variance s²/(q·(64 − q)).
        let count = f32::from(count);
        let variance = below * below / (count * (LEDS as f32 - count));
        if variance > best && pair[0] < pair[1] {
            (best, threshold) = (variance, pair[1]);
        }
    }
    two_classes(bits_where(|cell| grey[cell] >= threshold))
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    fn variance_between(grey: &[f32; LEDS], on: PanelFrame) -> f64 {
        let mean = |want: bool| {
            let group = (0..LEDS).filter(|&cell| on.led(cell) == want).map(|cell| f64::from(grey[cell]));
            group.clone().sum::<f64>() / group.count() as f64
        };
        let share = f64::from(on.count_on()) / 64.0;
        share * (1.0 - share) * (mean(true) - mean(false)) * (mean(true) - mean(false))
    }

    properties! {
        #[test]
        fn no_other_threshold_separates_better(grey in prop::collection::vec(0.0f32..255.0, LEDS)) {
            let grey = <[f32; LEDS]>::try_from(grey).unwrap();
            let best = variance_between(&grey, split(&grey).unwrap());
            for &threshold in &grey {
                let other = bits_where(|cell| grey[cell] >= threshold);
                if other.count_on() < 64 {
                    prop_assert!(variance_between(&grey, other) <= best * (1.0 + 1e-4));
                }
            }
        }
    }
}
