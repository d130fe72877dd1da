//! A share that was sampled.

/// The 95 % interval of a share, of which `hits` of `count` were seen (Wilson 1927).
pub fn wilson_95(hits: f64, count: f64) -> [f64; 2] {
    const Z: f64 = 1.96;
    let (share, squared) = (hits / count, Z * Z / count);
    let middle = share + squared / 2.0;
    let reach = Z * ((share * (1.0 - share) + squared / 4.0) / count).sqrt();
    [-1.0, 1.0].map(|sign| ((middle + sign * reach) / (1.0 + squared)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_a_share_is_that_of_the_textbook() {
        // 10 of 100: 0.0552 to 0.1744.
        let [low, high] = wilson_95(10.0, 100.0);
        assert!((low - 0.0552).abs() < 1e-4 && (high - 0.1744).abs() < 1e-4, "{low} {high}");
    }
}
