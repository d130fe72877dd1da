//! The log-likelihood ratio of two Gaussian classes of one covariance, which is linear in the features.

use super::error::DetectError;
use link::panel::{LEDS, PanelFrame};
use nalgebra::{RealField, SMatrix, SVector};

/// Addition to each standardised feature's variance within a class (share of its variance in the panel). Higher: all soft values are less
/// sure; none: those of a frame without noise are infinite.
const VARIANCE_FLOOR: f32 = 0.01;

/// LLR = `weights`ᵀ·x + `offset`.
pub(super) struct Discriminant<T, const N: usize> {
    pub weights: SVector<T, N>,
    pub offset: T,
}

impl<T: RealField + Copy, const N: usize> Discriminant<T, N> {
    /// Between classes of means `on` and `off`; `None` if `covariance` is not positive definite.
    pub fn between(on: SVector<T, N>, off: SVector<T, N>, covariance: SMatrix<T, N, N>) -> Option<Self> {
        let weights = covariance.cholesky()?.solve(&(on - off));
        let half = T::one() / (T::one() + T::one());
        Some(Self {
            weights,
            offset: -weights.dot(&(on + off)) * half,
        })
    }

    pub fn llr(&self, sample: SVector<T, N>) -> T {
        self.weights.dot(&sample) + self.offset
    }
}

/// The log-likelihood ratio of each cell if the cells of `bits` are a sample of the class On and the others one of Off.
pub(super) fn llr_by_split<const N: usize>(samples: &[[f32; N]; LEDS], bits: PanelFrame) -> Result<[f32; LEDS], DetectError> {
    let one_class = DetectError::OneClass { on: bits.count_on() };
    let samples = samples.map(SVector::from);
    let mean = |want: bool| {
        let group = samples.iter().enumerate().filter(|&(cell, _)| bits.led(cell) == want);
        let (sum, count) = group.fold((SVector::zeros(), 0u8), |(sum, n), (_, sample)| (sum + sample, n + 1));
        sum / f32::from(count)
    };
    let (on, off) = (mean(true), mean(false));
    let mut scatter = SMatrix::<f32, N, N>::zeros();
    for (cell, sample) in samples.iter().enumerate() {
        let deviation = sample - if bits.led(cell) { on } else { off };
        scatter += deviation * deviation.transpose();
    }
    // Both means were estimated from the same cells.
    let covariance = scatter / (LEDS - 2) as f32 + SMatrix::identity() * VARIANCE_FLOOR;
    let discriminant = Discriminant::between(on, off, covariance).ok_or(one_class)?;
    Ok(samples.map(|sample| discriminant.llr(sample)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn the_ratio_is_that_of_the_gaussian_densities() {
        let (on, off) = (Vector2::new(2.0, 1.0), Vector2::new(-1.0, 0.5));
        let covariance = Matrix2::new(2.0, 0.6, 0.6, 1.0);
        let precision = covariance.try_inverse().unwrap();
        let discriminant = Discriminant::between(on, off, covariance).unwrap();
        for sample in [Vector2::new(0.0, 0.0), Vector2::new(3.0, -2.0), Vector2::new(0.5, 0.75)] {
            let exponent = |mean: SVector<f64, 2>| -0.5 * ((sample - mean).transpose() * precision * (sample - mean))[0];
            approx::assert_abs_diff_eq!(discriminant.llr(sample), exponent(on) - exponent(off), epsilon = 1e-12);
        }
        assert!(Discriminant::between(on, off, Matrix2::new(1.0, 2.0, 2.0, 1.0)).is_none());
    }
}
