//! Sharpening in the camera: an unsharp mask, which overshoots at edges.

use fearless_simd::dispatch;

use super::{About, Effect};
use crate::formation::{Formation, GreyStage};
use crate::view::{LinearRange, View};

/// The mask's radius, in standard deviations.
const REACH_SIGMA: f64 = 3.0;

/// See the [module](self).
pub(super) struct Sharpening;

impl Effect for Sharpening {
    fn about(&self) -> About {
        About {
            name: "sharpening",
            model: "unsharp mask of the encoded frame: g + amount (g - mean of g under a Gaussian of the radius, cut off at 3 radii)",
            keys: &["camera.sharpening", "camera.sharpening_radius_px"],
            cost: "two short filters a pixel of the frame",
        }
    }

    /// A level differs from a mean of levels by at most their range, and the result stays within the levels.
    fn bound_grey(&self, view: &View, _range: &LinearRange) -> f64 {
        255.0 * view.scene.camera.sharpening.min(1.0)
    }

    /// Differences between levels by other effects are amplified, too.
    fn widen(&self, view: &View, range: &mut LinearRange) {
        range.grey_gain *= 1.0 + 2.0 * view.scene.camera.sharpening;
    }

    fn include(&self, view: &View, formation: &mut Formation) {
        let camera = &view.scene.camera;
        if camera.sharpening > 0.0 {
            formation
                .grey_stages
                .push(Box::new(UnsharpMask::new(camera.sharpening, camera.sharpening_radius_px)));
        }
    }
}

struct UnsharpMask {
    amount: f32,
    /// Weights of the mean, from the middle on; all but the first apply to two pixels.
    weights: Vec<f32>,
}

impl UnsharpMask {
    fn new(amount: f64, radius_px: f64) -> Self {
        let reach = (REACH_SIGMA * radius_px).ceil() as i32;
        let weight = |k: i32| (-0.5 * (f64::from(k) / radius_px).powi(2)).exp();
        let sum: f64 = (-reach..=reach).map(weight).sum();
        Self {
            amount: amount as f32,
            weights: (0..=reach).map(|k| (weight(k) / sum) as f32).collect(),
        }
    }

    /// The mean across each pixel of a row, continued beyond its ends by the end pixels.
    #[inline(always)]
    fn across(&self, row: &[u8], padded: &mut Vec<f32>, mean: &mut [f32]) {
        let reach = self.reach_px();
        let (Some(&first), Some(&last)) = (row.first(), row.last()) else {
            return;
        };
        padded.clear();
        padded.resize(reach, first.into());
        padded.extend(row.iter().map(|&level| f32::from(level)));
        padded.resize(row.len() + 2 * reach, last.into());
        mean.fill(0.0);
        for (k, &weight) in self.weights.iter().enumerate() {
            let weight = if k == 0 { weight / 2.0 } else { weight };
            let (left, right) = (&padded[reach - k..], &padded[reach + k..]);
            for ((mean, left), right) in mean.iter_mut().zip(left).zip(right) {
                *mean += weight * (left + right);
            }
        }
    }

    #[inline(always)]
    fn sharpen(&self, width: usize, grey: &mut [u8]) {
        let height = grey.len() / width;
        let (mut padded, mut across) = (Vec::new(), vec![0.0; grey.len()]);
        for (row, mean) in grey.chunks(width).zip(across.chunks_mut(width)) {
            self.across(row, &mut padded, mean);
        }
        let mut mean = vec![0.0; width];
        for (y, row) in grey.chunks_exact_mut(width).enumerate() {
            mean.fill(0.0);
            for (k, &weight) in self.weights.iter().enumerate() {
                let weight = if k == 0 { weight / 2.0 } else { weight };
                let [above, below] = [y.saturating_sub(k), (y + k).min(height - 1)].map(|y| &across[y * width..][..width]);
                for ((mean, above), below) in mean.iter_mut().zip(above).zip(below) {
                    *mean += weight * (above + below);
                }
            }
            for (level, mean) in row.iter_mut().zip(&mean) {
                let own = f32::from(*level);
                *level = (own + self.amount * (own - mean) + 0.5) as u8;
            }
        }
    }
}

impl GreyStage for UnsharpMask {
    fn reach_px(&self) -> usize {
        self.weights.len() - 1
    }

    fn apply(&self, width: usize, grey: &mut [u8]) {
        dispatch!(fearless_simd::Level::new(), _simd => self.sharpen(width, grey));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_overshoots_and_what_is_even_stays() {
        let mask = UnsharpMask::new(0.8, 1.0);
        let (width, height) = (21, 9);
        let edge = |x: usize| if x < 10 { 100 } else { 160 };
        let mut grey: Vec<u8> = (0..width * height).map(|i| edge(i % width)).collect();
        mask.apply(width, &mut grey);
        // The mean on the bright side of the edge lacks (1 - w0)/2 of the step, w0 = 0.3991 being the weight of the middle.
        let overshoot = 0.8 * 60.0 * (1.0 - 0.399_1) / 2.0;
        for row in grey.chunks(width) {
            assert_eq!([row[0], row[6], row[14], row[20]], [100, 100, 160, 160]);
            assert_eq!(row[10], (160.0f64 + overshoot).round() as u8);
            assert_eq!(row[9], (100.0f64 - overshoot).round() as u8);
        }
    }

    #[test]
    fn levels_stop_at_black_and_white() {
        let mask = UnsharpMask::new(5.0, 0.5);
        let mut grey = [0, 250, 0, 0, 5, 250, 255, 5];
        mask.apply(8, &mut grey);
        assert_eq!([grey[0], grey[1], grey[6]], [0, 255, 255]);
    }
}
