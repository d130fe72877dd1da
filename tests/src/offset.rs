//! Values with a small spread about a large offset and an exactly known variance.

/// 1000 values with 12 fractional bits above `offset`: exact in a double for offsets up to 2⁴⁰.
pub fn values_about(offset: f64) -> impl Iterator<Item = f64> + Clone {
    fractions().map(move |fraction| offset + f64::from(fraction) / 4096.0)
}

/// Their variance (over n), independent of the offset, in integers.
pub fn variance() -> f64 {
    let (sum, squares) = fractions().fold((0u64, 0u64), |(sum, squares), x| {
        let x = u64::from(x);
        (sum + x, squares + x * x)
    });
    (1000 * squares - sum * sum) as f64 / 1e6 / 4096f64.powi(2)
}

fn fractions() -> impl Iterator<Item = u32> + Clone {
    (0..1000u32).map(|k| k.wrapping_mul(2_654_435_761) >> 20)
}
