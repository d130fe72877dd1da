//! The pixels of an LED's spot, and its height in them.

/// The most pixels of a spot in a row or column (px); a multiple of 4. More: wider spots, and more memory.
pub(crate) const SPOT_PX: usize = 20;

/// Part of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Window {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
}

/// Pixels of a row per group.
pub(crate) const LANES: usize = 4;
const _: () = assert!(SPOT_PX.is_multiple_of(LANES));

/// The first of the pixels 0..`end` within `reach` of `centre`, and their number; `None` if there is no such pixel.
pub(super) fn clipped(centre: f32, reach: f32, end: usize) -> Option<(f32, usize)> {
    let first = libm::ceilf(centre - reach).max(0.0);
    let last = libm::floorf(centre + reach).min(end as f32 - 1.0);
    (last >= first).then(|| (first, ((last - first) as usize + 1).min(SPOT_PX)))
}

/// The first of `taps` pixels around `centre`, all within 0..`end`.
pub(super) fn whole(centre: f32, taps: usize, end: usize) -> usize {
    let first = libm::roundf(centre - (taps as f32 - 1.0) / 2.0);
    // A cast of a negative number is 0.
    (first as usize).min(end - taps)
}

/// A Gaussian of the given variance in successive pixels: `first` at `offset` from its centre, and so on. By recurrence: the ratio of
/// neighbours shrinks by a constant factor.
pub(super) fn gaussian(values: &mut [f32], first: f32, offset: f32, variance: f32) {
    let half = 0.5 / variance;
    let mut value = first;
    let mut ratio = libm::expf(-(2.0 * offset + 1.0) * half);
    let shrink = libm::expf(-2.0 * half);
    for to in values {
        *to = value;
        value *= ratio;
        ratio *= shrink;
    }
}

/// Σ a·b over the length of `a`, a multiple of [`LANES`].
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}
