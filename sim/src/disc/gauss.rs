//! Gauss–Legendre quadrature: one rule of sixteen nodes, on panels short enough for it.

/// Positive nodes on −1…1 with their weights.
const HALF: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_54),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_73),
    (0.755_404_408_355_003, 0.124_628_971_255_533_87),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_79),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_894),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_096),
];

/// The number of nodes.
pub const COUNT: usize = 2 * HALF.len();

/// The sixteen nodes between `from` and `to` with their weights. The rule is exact for polynomials of degree 31.
pub fn nodes(from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
    let (middle, half) = (f64::midpoint(from, to), (to - from) / 2.0);
    HALF.into_iter()
        .flat_map(move |(node, weight)| [-node, node].map(|node| (middle + half * node, half * weight)))
}

/// The longest panel, in σ, on which the rule integrates a Gaussian to a tolerance: on 14, 11, 9 and 5 σ its errors are 8e-5, 7e-7, 8e-9
/// and less than 1e-14.
pub(super) fn longest_panel(tolerance: f64) -> f64 {
    match tolerance {
        _ if tolerance >= 1e-3 => 14.0,
        _ if tolerance >= 1e-5 => 11.0,
        _ if tolerance >= 1e-7 => 9.0,
        _ => 5.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_31_are_exact() {
        for degree in 0..=31 {
            let sum: f64 = nodes(0.5, 2.0).map(|(x, weight)| weight * x.powi(degree)).sum();
            let power = degree + 1;
            let exact = (2f64.powi(power) - 0.5f64.powi(power)) / f64::from(power);
            assert!((sum / exact - 1.0).abs() < 1e-14, "degree {degree}: {sum} against {exact}");
        }
    }
}
