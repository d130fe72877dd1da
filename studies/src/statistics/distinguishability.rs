//! Distinguishability of On and Off by their features.

use serde::Serialize;

use super::Moments;

/// Between- and within-class variances of the features of On and Off LEDs (Do & Yoo 2020, Eqs. 5 to 7).
///
/// Both variances are 0 if a class is empty; the ratios are then undefined, as they are if nothing varies. No number here is infinite or
/// NaN.
///
/// ```
/// use studies::statistics::{Distinguishability, Moments};
/// let on = Moments::of(&[[1.2, 30.0], [1.4, 40.0]]);
/// let off = Moments::of(&[[0.8, 10.0], [0.6, 20.0]]);
/// let variances = Distinguishability::of(&on, &off);
/// assert!((variances.wvar - 50.02).abs() < 1e-12);
/// assert!(variances.b2w.is_some_and(|b2w| (b2w - 400.36 / 50.02).abs() < 1e-12));
/// assert_eq!(Distinguishability::of(&on, &Moments::default()).b2w, None);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distinguishability {
    /// |μ_on − μ_off|².
    pub bvar: f64,
    /// E|x_on − μ_on|² + E|x_off − μ_off|².
    pub wvar: f64,
    /// Their ratio; `None` if a class is empty or neither varies.
    pub b2w: Option<f64>,
    /// Fisher's criterion, (μ_on − μ_off)ᵀ·(Σ_on + Σ_off)⁻¹·(μ_on − μ_off): the largest such ratio of any linear combination of the
    /// features, at any scales (Fisher 1936). `None` if a class is empty, a feature separates the classes and never varies within them, or
    /// the features always vary together ([`COLLINEAR`]).
    pub fisher: Option<f64>,
}

/// Features count as always varying together if 1 − ρ² of their correlation ρ is below this: with fewer digits left, Fisher's criterion
/// would be rounding. Above this its relative error is at most 10⁻⁶.
pub const COLLINEAR: f64 = 1e-9;

impl Distinguishability {
    /// From the two classes' moments.
    pub fn of(on: &Moments, off: &Moments) -> Self {
        if on.count == 0 || off.count == 0 {
            return Self::default();
        }
        let apart = [0, 1].map(|i| (on.first[i] - off.first[i]) + (on.mean[i] - off.mean[i]));
        let (on, off) = (on.covariance(), off.covariance());
        let within = |i: usize, j: usize| on[i][j] + off[i][j];
        let bvar = apart[0].powi(2) + apart[1].powi(2);
        let wvar = within(0, 0) + within(1, 1);
        Self {
            bvar,
            wvar,
            b2w: Some(bvar / wvar).filter(|ratio| ratio.is_finite()),
            fisher: fisher(apart, within(0, 0), within(0, 1), within(1, 1)),
        }
    }
}

/// Fisher's criterion of means that are `apart`, under a covariance, in units of each feature's deviation, so that neither their scales nor
/// a determinant of nearly equal products costs digits.
fn fisher([x, y]: [f64; 2], xx: f64, xy: f64, yy: f64) -> Option<f64> {
    let of_one = |apart: f64, variance: f64| apart * (apart / variance);
    let criterion = match (xx > 0.0, yy > 0.0) {
        (true, true) => {
            let (x, y) = (x / xx.sqrt(), y / yy.sqrt());
            let correlation = xy / xx.sqrt() / yy.sqrt();
            let rest = (1.0 - correlation) * (1.0 + correlation);
            (rest >= COLLINEAR).then(|| y * y + (x - correlation * y).powi(2) / rest)
        }
        (true, false) if y == 0.0 => Some(of_one(x, xx)),
        (false, true) if x == 0.0 => Some(of_one(y, yy)),
        _ => None,
    };
    criterion.filter(|ratio| ratio.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn fishers_criterion_ignores_scales(values in prop::collection::vec((-1.0..1.0f64, -1.0..1.0f64), 8..40), scale in 0.01..100.0f64) {
            let of = |scale: f64| {
                let (mut on, mut off) = (Moments::default(), Moments::default());
                for (k, (x, y)) in values.iter().enumerate() {
                    if k % 2 == 0 {
                        on.push([x + y + 1.0, scale * (y + 2.0)]);
                    } else {
                        off.push([x + y, scale * y]);
                    }
                }
                Distinguishability::of(&on, &off)
            };
            let (one, other) = (of(1.0), of(scale));
            let (Some(fisher), Some(rescaled), Some(b2w)) = (one.fisher, other.fisher, one.b2w) else {
                return Err(TestCaseError::reject("features that do not vary"));
            };
            prop_assert!((fisher / rescaled - 1.0).abs() < 1e-6, "{:?} {:?}", one, other);
            // No direction separates better, nor does the sum of both axes.
            prop_assert!(fisher >= b2w * (1.0 - 1e-9));
        }
    }
}
