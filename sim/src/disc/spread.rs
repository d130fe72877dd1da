//! Blur beyond its round Gaussian core: a defocused lens spreads each point over a disc, an astigmatic one more along one axis than along
//! the other.
//!
//! A [`Spread`] is a sum of columns, each the product of points across and of pieces of an upright line. So the image of a chord remains a
//! few products of values across and values down, for any spread.

use std::f64::consts::PI;

use glam::DVec2;

use crate::disc::gauss;

/// The shape of a spread; standard deviations and radii in px along x and along y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shape {
    /// No spread beyond the core.
    #[default]
    Point,
    /// A Gaussian.
    Gaussian([f64; 2]),
    /// A uniform ellipse.
    Disc([f64; 2]),
}

/// A spread as a quadrature with weights of sum 1.
#[derive(Clone, Debug)]
pub struct Spread {
    /// The columns.
    pub columns: Vec<Column>,
    /// The spread as points with weights.
    pub points: Vec<(DVec2, f64)>,
    /// Its reach along x or y, in px.
    pub reach_px: f64,
}

/// One product of points and pieces.
#[derive(Clone, Debug)]
pub struct Column {
    /// Positions right of the middle, each with its weight.
    pub across: Vec<(f64, f64)>,
    /// Pieces of an upright line.
    pub down: Vec<Piece>,
}

/// A uniform piece of an upright line.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Its middle, below that of the spread.
    pub place: f64,
    /// Half its length; 0 for a point.
    pub half: f64,
    /// Its light.
    pub weight: f64,
}

impl Spread {
    /// The quadrature of a shape such that an image under a core of `core_px` errs by about `tolerance` of the light at most.
    ///
    /// The core attenuates a frequency ω to exp(−ω²σ²/2), so that frequencies beyond √(2·ln(1/tolerance))/σ are negligible; up to there,
    /// both rules used here are exact to that tolerance.
    pub fn new(shape: Shape, core_px: f64, tolerance: f64) -> Self {
        let cutoff = (2.0 * (2.0 / tolerance).ln()).sqrt();
        let columns = match shape {
            Shape::Point => vec![Column {
                across: vec![(0.0, 1.0)],
                down: vec![Piece::point((0.0, 1.0))],
            }],
            Shape::Gaussian([x, y]) => vec![Column {
                across: gaussian(x, core_px, cutoff),
                down: gaussian(y, core_px, cutoff).into_iter().map(Piece::point).collect(),
            }],
            Shape::Disc(radii) => disc(radii, cutoff / core_px),
        };
        let points: Vec<_> = columns
            .iter()
            .flat_map(|column| column.points(gauss::longest_panel(tolerance) * core_px))
            .collect();
        let far = |(at, _): &(DVec2, f64)| at.abs().max_element();
        let halves = columns.iter().flat_map(|column| &column.down);
        let halves = halves.map(|piece| piece.place.abs() + piece.half);
        Self {
            reach_px: points.iter().map(far).chain(halves).fold(0.0, f64::max),
            columns,
            points,
        }
    }
}

impl Piece {
    fn point((place, weight): (f64, f64)) -> Self {
        Self { place, half: 0.0, weight }
    }
}

impl Column {
    /// As points with weights, by the rule of [`gauss`] on pieces of at most `longest` px.
    fn points(&self, longest: f64) -> Vec<(DVec2, f64)> {
        let down = self.down.iter().flat_map(|piece| {
            if piece.half == 0.0 {
                return vec![(piece.place, piece.weight)];
            }
            let strips = (2.0 * piece.half / longest).ceil();
            let (top, length) = (piece.place - piece.half, 2.0 * piece.half / strips);
            let strip = |k: usize| {
                let start = top + k as f64 * length;
                gauss::nodes(start, start + length).map(|(y, part)| (y, piece.weight * part / (2.0 * piece.half)))
            };
            (0..strips as usize).flat_map(strip).collect()
        });
        let down: Vec<(f64, f64)> = down.collect();
        let across = self
            .across
            .iter()
            .flat_map(|&(x, of_x)| down.iter().map(move |&(y, of_y)| (DVec2::new(x, y), of_x * of_y)));
        across.collect()
    }
}

/// A Gaussian of deviation `sigma` at equal steps, under a core: the product of the two has the deviation σ·c/√(σ² + c²), whose spectrum
/// the steps do not alias.
fn gaussian(sigma: f64, core: f64, cutoff: f64) -> Vec<(f64, f64)> {
    if sigma == 0.0 {
        return vec![(0.0, 1.0)];
    }
    let step = 2.0 * PI * sigma * core / sigma.hypot(core) / cutoff;
    let last = (cutoff * sigma / step).ceil() as i32;
    let at = |k: i32| f64::from(k) * step;
    let weight = |k: i32| (-0.5 * (at(k) / sigma).powi(2)).exp();
    let sum: f64 = (-last..=last).map(weight).sum();
    (-last..=last).map(|k| (at(k), weight(k) / sum)).collect()
}

/// An ellipse by its chords at Chebyshev's nodes, mirror images together.
fn disc([x, y]: [f64; 2], cutoff: f64) -> Vec<Column> {
    let pairs = ((x * cutoff / 2.0 + 3.0) / 2.0).ceil();
    let column = |k: usize| {
        let (sin, cos) = ((k as f64 + 0.5) * PI / (2.0 * pairs)).sin_cos();
        Column {
            across: [cos, -cos].map(|side| (x * side, sin * sin / pairs)).into(),
            down: vec![Piece {
                place: 0.0,
                half: y * sin,
                weight: 1.0,
            }],
        }
    };
    (0..pairs as usize).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_shape() {
        for (shape, deviations) in [
            (Shape::Point, [0.0, 0.0]),
            (Shape::Gaussian([1.3, 0.0]), [1.3, 0.0]),
            (Shape::Gaussian([0.2, 0.9]), [0.2, 0.9]),
            (Shape::Disc([3.0, 3.0]), [1.5, 1.5]),
            (Shape::Disc([1.0, 8.0]), [0.5, 4.0]),
        ] {
            for tolerance in [1e-3, 1e-13] {
                let Spread { points, .. } = Spread::new(shape, 0.3, tolerance);
                let sum = |f: &dyn Fn(DVec2) -> f64| -> f64 { points.iter().map(|&(at, weight)| weight * f(at)).sum() };
                assert!((sum(&|_| 1.0) - 1.0).abs() < 1e-13, "{shape:?}");
                assert!(sum(&|at| at.x).abs() + sum(&|at| at.y).abs() < 1e-13);
                let found = [sum(&|at| at.x * at.x), sum(&|at| at.y * at.y)].map(f64::sqrt);
                let apart = (found[0] - deviations[0]).abs() + (found[1] - deviations[1]).abs();
                assert!(apart < 2.0 * tolerance.max(1e-12), "{shape:?}: {found:?}");
            }
        }
    }
}
