//! Textbook formulas, to show where they fail.

/// Mean and variance (over n) from the sums of values and of squares, E x² − (E x)².
pub fn variance_by_squares(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for x in values {
        count += 1.0;
        sum += x;
        squares += x * x;
    }
    let mean = sum / count;
    (mean, squares / count - mean * mean)
}

/// Mean and variance by Welford's updates (Welford 1962) of the unshifted values.
pub fn variance_unshifted(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (mut count, mut mean, mut scatter) = (0.0, 0.0, 0.0);
    for x in values {
        count += 1.0;
        let before = x - mean;
        mean += before / count;
        scatter += before * (x - mean);
    }
    (mean, scatter / count)
}
