//! The threshold on grey alone that leaves the greatest variance between the classes (Otsu 1979).

use super::detection::bits_where;
use super::error::{DetectError, two_classes};
use link::panel::{LEDS, PanelFrame};

/// The cells above the threshold.
pub(super) fn split(grey: &[f32; LEDS]) -> Result<PanelFrame, DetectError> {
    let mut sorted = *grey;
    sorted.sort_unstable_by(f32::total_cmp);
    let threshold = otsu_threshold(&sorted).map_or(f32::INFINITY, |[_, above]| above);
    two_classes(bits_where(|cell| grey[cell] >= threshold))
}

/// The values next to the threshold that leaves the greatest variance between its two sides (Otsu 1979), of values in ascending order; none
/// if no two of them differ.
///
/// ```
/// # use rx_pipeline::detect::otsu_threshold;
/// assert_eq!(otsu_threshold(&[1.0, 2.0, 8.0, 9.0]), Some([2.0, 8.0]));
/// assert_eq!(otsu_threshold(&[3.0, 3.0]), None);
/// ```
pub fn otsu_threshold(sorted: &[f32]) -> Option<[f32; 2]> {
    let all = sorted.len() as f32;
    let mean = sorted.iter().sum::<f32>() / all;
    let (mut below, mut best, mut threshold) = (0.0, 0.0, None);
    for (count, pair) in (1..).zip(sorted.windows(2)) {
        below += pair[0] - mean;
        // With q of the n values below the threshold, and s their sum relative to the mean: variance s²/(q·(n − q)).
        let count = count as f32;
        let variance = below * below / (count * (all - count));
        if variance > best && pair[0] < pair[1] {
            (best, threshold) = (variance, Some([pair[0], pair[1]]));
        }
    }
    threshold
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
