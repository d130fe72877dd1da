//! The ratio of two error counts on the same frames.

use rand::RngExt;
use sim::random::{Purpose, stream};

/// Number of resamples.
const RESAMPLED: usize = 1000;

/// The 95 % interval of the ratio of two sums over the same frames (bootstrap); infinite or NaN if the lower sum is often 0.
///
/// ```
/// let [low, high] = studies::statistics::ratio_95(&[2, 4, 2, 4], &[1, 2, 1, 2]);
/// assert_eq!([low, high], [2.0, 2.0]);
/// ```
pub fn ratio_95(above: &[u64], below: &[u64]) -> [f64; 2] {
    let mut random = stream(0, 0, Purpose::Resampling);
    let frames = above.len().min(below.len());
    let mut ratios: Vec<f64> = (0..RESAMPLED)
        .map(|_| {
            let (mut a, mut b) = (0, 0);
            for _ in 0..frames {
                let frame = random.random_range(0..frames);
                a += above[frame];
                b += below[frame];
            }
            a as f64 / b as f64
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    [RESAMPLED / 40, RESAMPLED - 1 - RESAMPLED / 40].map(|at| ratios[at])
}
