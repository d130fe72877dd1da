//! The criterion of the best ratio.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::monte_carlo::Evaluation;

/// The quantity to maximise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// The between-class over the within-class variance of (AGR, GRI), of all frames pooled (Do & Yoo 2020, Eqs. 5 to 7).
    /// GRI, in grey levels, swamps AGR.
    #[default]
    B2w,
    /// Fisher's criterion with the full covariance, which does not depend on the features' scales:
    /// (μ_on − μ_off)ᵀ·(Σ_on + Σ_off)⁻¹·(μ_on − μ_off).
    Fisher,
    /// The bit error rate of a detector, to minimise, in frames of one symbol, because errors across a change of symbols do not depend on
    /// brightness.
    Ber,
}

/// The names of the criteria.
const CRITERIA: [(&str, Criterion); 3] = [("b2w", Criterion::B2w), ("fisher", Criterion::Fisher), ("ber", Criterion::Ber)];

impl Criterion {
    /// The objective to maximise: the logarithm of the ratio, or the log-odds of a right bit. `None` if the ratio is undefined or 0.
    ///
    /// Half an error and half a right bit are added to the counts, so that the log-odds are finite without errors (Haldane 1955).
    pub fn objective(self, evaluation: &Evaluation) -> Option<f64> {
        let logarithm = |ratio: Option<f64>| ratio.filter(|&ratio| ratio > 0.0).map(f64::ln);
        match self {
            Self::B2w => logarithm(evaluation.distinguishability().b2w),
            Self::Fisher => logarithm(evaluation.distinguishability().fisher),
            Self::Ber => {
                let errors = evaluation.of_one_symbol();
                let wrong = errors.errors() as f64;
                let right = errors.bits() as f64 - wrong;
                Some(((right + 0.5) / (wrong + 0.5)).ln())
            }
        }
    }

    /// The weight of an objective in a fit: the inverse of its variance, up to a common factor.
    ///
    /// Variances of ratios hardly depend on the ratio. That of log-odds is about 1/(errors + ½).
    pub fn weight(self, evaluation: &Evaluation) -> f64 {
        match self {
            Self::B2w | Self::Fisher => 1.0,
            Self::Ber => evaluation.of_one_symbol().errors() as f64 + 0.5,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        CRITERIA
            .iter()
            .find(|(_, criterion)| *criterion == self)
            .map_or("b2w", |(name, _)| name)
    }
}

impl FromStr for Criterion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        CRITERIA
            .iter()
            .find(|(name, _)| *name == text)
            .map(|&(_, criterion)| criterion)
            .ok_or_else(|| format!("no criterion {text:?}: choose b2w, fisher or ber"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_errors_are_better_than_one_and_finite() {
        let of = |errors: u32| {
            let mut evaluation = Evaluation::default();
            (0..100).for_each(|frame| evaluation.errors.push(if frame == 0 { errors } else { 0 }));
            Criterion::Ber.objective(&evaluation).unwrap()
        };
        assert!(of(0).is_finite() && of(0) > of(1) && of(1) > of(2));
        assert!((of(64) - (6336.5f64 / 64.5).ln()).abs() < 1e-12);
    }

    #[test]
    fn names_are_read_back() {
        for (name, criterion) in CRITERIA {
            assert_eq!(name.parse(), Ok(criterion));
            assert_eq!(criterion.name(), name);
        }
        assert!("bvar".parse::<Criterion>().is_err());
    }
}
