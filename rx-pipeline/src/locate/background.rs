//! The plain background's grey level and how much it varies.

use crate::frame::Frame;

/// What most of a frame looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Background {
    /// The commonest grey level below 255, which stands for many.
    pub level: u8,
    /// Standard deviation below that level, in grey levels. Panels only add light, so the darker half is free of them.
    pub spread: f32,
}

/// Pixels looked at, about: rows are left out of larger frames.
const SAMPLE: usize = 400_000;
/// Levels on either side that a level's count is added up over.
const SMOOTHING: usize = 2;
/// Greater differences belong to something else that is dark.
const MAX_STEP: f32 = 60.0;
/// The least step that counts as brighter, in grey levels: more than rounding may add to the mean of a flat patch.
const LEAST_STEP: f32 = 1.5;
/// The background's mean may lie this far above its level.
const LEVEL_ROUNDING: f32 = 0.5;
/// A mean of nine pixels counts as brighter from this many of its standard deviations on: once in a few million.
const SIGNIFICANT: f32 = 5.0;

impl Background {
    pub fn of(frame: &Frame<'_>) -> Self {
        let every = (frame.width() * frame.height()).div_ceil(SAMPLE).min(8);
        let mut histogram = [0u32; 256];
        for row in frame.rows().step_by(every) {
            for &grey in row {
                histogram[usize::from(grey)] += 1;
            }
        }
        let level = commonest(&histogram);
        Self {
            level,
            spread: spread_below(&histogram, level),
        }
    }

    /// The least sum of 3×3 pixels that is no background.
    pub fn threshold_of_nine(&self) -> u16 {
        let spread_of_mean = self.spread / 3.0;
        let step = LEAST_STEP.max(LEVEL_ROUNDING + SIGNIFICANT * spread_of_mean);
        9 * u16::from(self.level) + libm::ceilf(9.0 * step) as u16
    }
}

/// The mean of the commonest five neighbouring levels.
fn commonest(histogram: &[u32; 256]) -> u8 {
    let counted = histogram[..255].windows(2 * SMOOTHING + 1).enumerate();
    let sums = counted.map(|(first, window)| {
        let count: u64 = window.iter().map(|&n| u64::from(n)).sum();
        let above_first: u64 = (0..)
            .zip(window)
            .map(|(step, &n)| step * u64::from(n))
            .sum();
        (
            count,
            first as u64 + (above_first + count / 2) / count.max(1),
        )
    });
    sums.max_by_key(|&(count, _)| count)
        .map_or(0, |(_, level)| level as u8)
}

fn spread_below(histogram: &[u32; 256], level: u8) -> f32 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (grey, &n) in histogram.iter().enumerate().take(usize::from(level) + 1) {
        let step = f32::from(level) - grey as f32;
        if step <= MAX_STEP {
            // The level's own pixels lie on both sides of it.
            let n = if step == 0.0 {
                n as f32 / 2.0
            } else {
                n as f32
            };
            squares += n * step * step;
            count += n;
        }
    }
    libm::sqrtf(squares / f32::max(count, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bright_patch_does_not_shift_the_background() {
        let pixels: [u8; 2500] = core::array::from_fn(|i| match i {
            0..800 => 255,
            800..1000 => 130 + (i % 100) as u8,
            _ => 116 + (i % 3) as u8 + (i % 2) as u8,
        });
        let background = Background::of(&Frame::new(&pixels, 50, 50).unwrap());
        assert!((117..=118).contains(&background.level), "{background:?}");
        assert!((0.5..1.3).contains(&background.spread), "{background:?}");
    }

    #[test]
    fn a_frame_without_noise_has_no_spread() {
        let background = Background::of(&Frame::new(&[118; 100], 10, 10).unwrap());
        assert_eq!(
            background,
            Background {
                level: 118,
                spread: 0.0
            }
        );
        assert_eq!(background.threshold_of_nine(), 9 * 118 + 14);
        let white = Background::of(&Frame::new(&[255; 100], 10, 10).unwrap());
        assert!(white.threshold_of_nine() > 0);
    }
}
