//! Student's distribution.

/// Its quantile for 97.5 %, by the first terms of the Cornish–Fisher expansion (Abramowitz & Stegun 26.7.5): 3 % small at a freedom of 2,
/// less than 1 % from 3 on.
pub(crate) fn student_97_5(freedom: f64) -> f64 {
    1.96 + 2.37 / freedom + 2.82 / freedom.powi(2) + 2.56 / freedom.powi(3)
}
