//! The projection of directions to pixels: focal length, principal point, distortion.

use core::ops::RangeInclusive;

/// A camera's geometry, in the model and order of OpenCV's calibration.
///
/// With x = X/Z and y = Y/Z of a point before the camera (x right, y down, z forward) and ρ² = x² + y², the light falls on the pixel
///
/// ```text
/// (x', y') = (x, y)·(1 + k1·ρ² + k2·ρ⁴ + k3·ρ⁶)/(1 + k4·ρ² + k5·ρ⁴ + k6·ρ⁶) + (2·p1·x·y + p2·(ρ² + 2·x²), p1·(ρ² + 2·y²) + 2·p2·x·y)
/// column = focal_px[0]·x' + principal_px[0],    row = focal_px[1]·y' + principal_px[1]
/// ```
///
/// (Brown 1966; the rational form after Claus & Fitzgibbon 2005).
///
/// ```
/// use rx_pipeline::pose::{Lens, LensError};
/// let lens = Lens { distortion: [-0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..Lens::pinhole(3636.0, [1920, 1080]) };
/// let pixel = lens.pixel([0.1, 0.0]);
/// assert!((pixel[0] - (959.5 + 3636.0 * 0.1 * 0.999)).abs() < 1e-9);
/// assert!((lens.ray(pixel).unwrap()[0] - 0.1).abs() < 1e-12);
/// let wrong = Lens { focal_px: [0.0, 0.0], ..lens };
/// assert!(matches!(wrong.checked(), Err(LensError::Focal { .. })));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal length in pixels along x and along y, 1 to 10⁶.
    pub focal_px: [f64; 2],
    /// The pixel on the optical axis, within ±10⁶.
    pub principal_px: [f64; 2],
    /// k1, k2, p1, p2, k3, k4, k5, k6, each within ±1000; all 0 for a pinhole.
    pub distortion: [f64; 8],
}

/// A camera geometry out of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LensError {
    /// The focal length.
    #[error(
        "a focal length of {focal_px} px is not {} to {:e}: give the camera's, its focal length in mm over its pixels' pitch in mm",
        Lens::FOCAL_PX.start(),
        Lens::FOCAL_PX.end()
    )]
    Focal {
        /// The requested focal length, in pixels.
        focal_px: f64,
    },
    /// The principal point.
    #[error(
        "a principal point at {principal_px} px is not within ±{:e}: give the pixel on the optical axis; half the frame is a start",
        Lens::PRINCIPAL_PX.end()
    )]
    Principal {
        /// The requested coordinate, in pixels.
        principal_px: f64,
    },
    /// A coefficient of the distortion.
    #[error(
        "a distortion coefficient of {coefficient} is not within ±{}: give k1, k2, p1, p2, k3 as OpenCV's calibration does",
        Lens::DISTORTION.end()
    )]
    Distortion {
        /// The requested coefficient.
        coefficient: f64,
    },
}

impl Lens {
    /// The range of `focal_px`.
    pub const FOCAL_PX: RangeInclusive<f64> = 1.0..=1e6;
    /// The range of `principal_px`.
    pub const PRINCIPAL_PX: RangeInclusive<f64> = -1e6..=1e6;
    /// The range of `distortion`.
    pub const DISTORTION: RangeInclusive<f64> = -1000.0..=1000.0;

    /// A camera without distortion, with its axis through the middle of frames of `size` (columns, rows).
    pub fn pinhole(focal_px: f64, size: [usize; 2]) -> Self {
        Self {
            focal_px: [focal_px; 2],
            principal_px: size.map(|length| (length as f64 - 1.0) / 2.0),
            distortion: [0.0; 8],
        }
    }

    /// The geometry, if all of it is in its range.
    ///
    /// # Errors
    /// [`LensError`] for the first value out of its range.
    pub fn checked(self) -> Result<Self, LensError> {
        let wrong = |range: RangeInclusive<f64>| move |value: &f64| !range.contains(value);
        if let Some(focal_px) = self.focal_px.into_iter().find(wrong(Self::FOCAL_PX)) {
            return Err(LensError::Focal { focal_px });
        }
        if let Some(principal_px) = self.principal_px.into_iter().find(wrong(Self::PRINCIPAL_PX)) {
            return Err(LensError::Principal { principal_px });
        }
        if let Some(coefficient) = self.distortion.into_iter().find(wrong(Self::DISTORTION)) {
            return Err(LensError::Distortion { coefficient });
        }
        Ok(self)
    }

    /// The pixel of light from the direction (x, y, 1).
    pub fn pixel(&self, direction: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.distorted(direction);
        [
            self.focal_px[0] * x + self.principal_px[0],
            self.focal_px[1] * y + self.principal_px[1],
        ]
    }

    /// The direction (x, y, 1) of a pixel; `None` if the lens model is not invertible there, for example beyond its fold.
    pub fn ray(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        const STEPS: usize = 30;
        const EXACT: f64 = 1e-13;
        const STEP: f64 = 1e-6;
        let wanted: [f64; 2] = core::array::from_fn(|i| (pixel[i] - self.principal_px[i]) / self.focal_px[i]);
        let mut at = wanted;
        for _ in 0..STEPS {
            let here = self.distorted(at);
            let off = [wanted[0] - here[0], wanted[1] - here[1]];
            if off[0].abs().max(off[1].abs()) < EXACT {
                return Some(at);
            }
            let slope = |dx: f64, dy: f64| {
                let ahead = self.distorted([at[0] + dx, at[1] + dy]);
                let behind = self.distorted([at[0] - dx, at[1] - dy]);
                [0, 1].map(|i| (ahead[i] - behind[i]) / (2.0 * STEP))
            };
            let ([a, c], [b, d]) = (slope(STEP, 0.0), slope(0.0, STEP));
            let determinant = a * d - b * c;
            // If the image folds over, a pixel has no unique direction.
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            at[0] += (d * off[0] - b * off[1]) / determinant;
            at[1] += (a * off[1] - c * off[0]) / determinant;
        }
        None
    }

    /// The derivatives of a pixel by its direction: the column's along x and y, and the row's.
    pub(super) fn slopes(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        const STEP: f64 = 1e-6;
        let along = [[STEP, 0.0], [0.0, STEP]].map(|[dx, dy]| {
            let ahead = self.pixel([x + dx, y + dy]);
            let behind = self.pixel([x - dx, y - dy]);
            [0, 1].map(|axis| (ahead[axis] - behind[axis]) / (2.0 * STEP))
        });
        [0, 1].map(|axis| [along[0][axis], along[1][axis]])
    }

    fn distorted(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3, k4, k5, k6] = self.distortion;
        let square = x * x + y * y;
        let series = |a: f64, b: f64, c: f64| 1.0 + square * (a + square * (b + square * c));
        let radial = series(k1, k2, k3) / series(k4, k5, k6);
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn a_pixel_s_ray_falls_on_it(
            direction in prop::array::uniform2(-0.5f64..0.5),
            k in prop::array::uniform3(-0.1f64..0.1),
            p in prop::array::uniform2(-0.01f64..0.01),
        ) {
            let lens = Lens {
                focal_px: [900.0, 910.0],
                principal_px: [640.0, 350.0],
                distortion: [k[0], k[1], p[0], p[1], k[2], 0.01, 0.0, 0.0],
            };
            let back = lens.ray(lens.pixel(direction)).unwrap();
            prop_assert!((back[0] - direction[0]).abs() < 1e-9 && (back[1] - direction[1]).abs() < 1e-9);
        }

        #[test]
        fn no_lens_panics(numbers in prop::array::uniform12(prop::num::f64::ANY), pixel in prop::array::uniform2(prop::num::f64::ANY)) {
            let [fx, fy, cx, cy, distortion @ ..] = numbers;
            let lens = Lens { focal_px: [fx, fy], principal_px: [cx, cy], distortion };
            if lens.checked().is_ok() {
                let _ = lens.ray(pixel);
            }
        }
    }

    #[test]
    fn beyond_the_fold_there_is_no_ray() {
        let lens = Lens {
            distortion: [-0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            ..Lens::pinhole(1000.0, [2000, 2000])
        };
        assert_eq!(lens.ray([3000.0, 999.5]), None);
    }

    #[test]
    fn nonsense_is_refused() {
        let lens = Lens::pinhole(1000.0, [640, 480]);
        assert_eq!(lens.checked(), Ok(lens));
        let nowhere = Lens {
            principal_px: [f64::NAN, 0.0],
            ..lens
        };
        assert!(matches!(nowhere.checked(), Err(LensError::Principal { .. })));
        let bent = Lens {
            distortion: [0.0, 0.0, 0.0, 0.0, 1e4, 0.0, 0.0, 0.0],
            ..lens
        };
        assert!(matches!(bent.checked(), Err(LensError::Distortion { coefficient }) if coefficient == 1e4));
    }
}
