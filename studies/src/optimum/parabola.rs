//! The top of a curve from a few uncertain points.

/// A parabola fitted to points by weighted least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parabola {
    /// The first and the last fitted position.
    ends: [f64; 2],
    centre: f64,
    /// The factors of 1, (x − centre) and (x − centre)².
    coefficients: [f64; 3],
}

impl Parabola {
    /// The fit to points (x, y, weight); `None` for fewer than three different x.
    pub fn fit(points: impl Iterator<Item = (f64, f64, f64)> + Clone) -> Option<Self> {
        let (sum, weight) = points.clone().fold((0.0, 0.0), |(sum, total), (x, _, w)| (sum + w * x, total + w));
        let centre = sum / weight;
        let ends = points
            .clone()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (x, ..)| [low.min(x), high.max(x)]);
        // Moments of x from 0 to 4 and of y·x from 0 to 2.
        let (mut x_moments, mut y_moments) = ([0.0; 5], [0.0; 3]);
        for (x, y, weight) in points {
            let mut term = weight;
            for power in 0..5 {
                x_moments[power] += term;
                if power < 3 {
                    y_moments[power] += term * y;
                }
                term *= x - centre;
            }
        }
        let matrix = std::array::from_fn(|row| std::array::from_fn(|column| x_moments[row + column]));
        let coefficients = solved(matrix, y_moments)?;
        Some(Self {
            ends,
            centre,
            coefficients,
        })
    }

    /// Its value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        let [a, b, c] = self.coefficients;
        let x = x - self.centre;
        a + x * (b + x * c)
    }

    /// Its highest position within a range. Without a top it is the higher end of the points, and for a flat one their middle.
    pub fn top(&self, [low, high]: [f64; 2]) -> f64 {
        let [_, slope, curvature] = self.coefficients;
        let width = high - low;
        if (slope * width).abs().max((curvature * width * width).abs()) < FLAT {
            return self.centre.clamp(low, high);
        }
        if curvature < 0.0 {
            return (self.centre - slope / (2.0 * curvature)).clamp(low, high);
        }
        let [first, last] = self.ends;
        if self.at(first) >= self.at(last) { first } else { last }
    }
}

/// A smaller rise over the range counts as flat.
const FLAT: f64 = 1e-9;

/// The determinant, relative to the diagonal, below which the positions are not three different ones.
const SINGULAR: f64 = 1e-9;

/// The solution of three linear equations by Cramer's rule; `None` if it is not unique.
fn solved(matrix: [[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let determinant = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = determinant(&matrix);
    let size = matrix[0][0] * matrix[1][1] * matrix[2][2];
    if whole.abs() <= SINGULAR * size {
        return None;
    }
    let solution = std::array::from_fn(|column| {
        let mut replaced = matrix;
        for (row, value) in right.iter().enumerate() {
            replaced[row][column] = *value;
        }
        determinant(&replaced) / whole
    });
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use properties::prelude::*;

    properties! {
        #[test]
        fn a_parabola_is_found_again(top in 0.2f64..4.0, height in -5.0f64..5.0, curvature in -50.0f64..-0.01, step in 0.01f64..0.5, count in 3u32..12) {
            let y = |x: f64| height + curvature * (x - top).powi(2);
            let points = (0..count).map(|k| {
                let x = 1.0 + f64::from(k) * step;
                (x, y(x), 1.0 + f64::from(k))
            });
            let fit = Parabola::fit(points).unwrap();
            prop_assert!((fit.top([0.2, 4.0]) - top).abs() < 1e-4, "{:?} for {}", fit, top);
        }
    }

    #[test]
    fn what_has_no_top_has_it_at_the_higher_end_of_what_is_known() {
        let steeper = |x: i32| (f64::from(x), f64::from(x * x), 1.0);
        let rising = Parabola::fit((1..5).map(steeper)).unwrap();
        assert_eq!(rising.top([-10.0, 10.0]), 4.0);
        let falling = Parabola::fit((-4..0).map(steeper)).unwrap();
        assert_eq!(falling.top([-10.0, 10.0]), -4.0);
    }

    #[test]
    fn what_is_flat_has_its_top_in_the_middle() {
        let flat = Parabola::fit((0..5).map(|k| (f64::from(k), 0.1, 1.0))).unwrap();
        assert!((flat.top([-10.0, 10.0]) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn two_places_make_no_parabola() {
        assert_eq!(Parabola::fit([(1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (2.0, 3.0, 1.0)].into_iter()), None);
        assert_eq!(Parabola::fit(std::iter::empty()), None);
        assert_eq!(
            Parabola::fit([(1.0, f64::NAN, 1.0), (2.0, 2.0, 1.0), (3.0, 3.0, 1.0)].into_iter()),
            None
        );
    }
}
