//! Interpolation of sampled curves.

/// The value at `x` of a curve sampled at ascending `xs`: linear in between, the nearest value beyond; NaN without samples.
pub fn interpolated(xs: &[f64], values: &[f64], x: f64) -> f64 {
    let at = |k: usize| Some((*xs.get(k)?, *values.get(k)?));
    let after = xs.partition_point(|&known| known < x);
    match (after.checked_sub(1).and_then(at), at(after)) {
        (Some((from, low)), Some((to, high))) => low + (high - low) * (x - from) / (to - from),
        (Some((_, nearest)), None) | (None, Some((_, nearest))) => nearest,
        (None, None) => f64::NAN,
    }
}

/// The first `x` at which a curve reaches a share of its greatest value, linear between its points.
pub fn reaches(xs: &[f64], values: &[f64], share: f64) -> f64 {
    let wanted = share * values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let reached = values.iter().position(|&value| value >= wanted);
    match reached.and_then(|at| Some((at, at.checked_sub(1)?))) {
        None => xs.first().copied().unwrap_or(f64::NAN),
        Some((at, before)) => interpolated(&[values[before], values[at]], &[xs[before], xs[at]], wanted),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_straight_between_points_and_flat_beyond() {
        let (xs, values) = ([0.5, 1.0, 2.0], [1.0, 2.0, 4.0]);
        let at = |x| interpolated(&xs, &values, x);
        assert_eq!([0.3, 0.5, 0.75, 1.5, 2.0, 3.0].map(at), [1.0, 1.0, 1.5, 3.0, 4.0, 4.0]);
        assert!(interpolated(&[], &[], 1.0).is_nan());
    }

    #[test]
    fn a_share_of_the_top_is_found_between_points() {
        let xs = [1.0, 2.0, 3.0, 4.0];
        assert_eq!(reaches(&xs, &[0.0, 4.0, 10.0, 8.0], 0.7), 2.5);
        assert_eq!(reaches(&xs, &[10.0, 4.0, 1.0, 0.0], 0.9), 1.0);
    }
}
