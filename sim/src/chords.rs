//! A disc's image as a few chords.
//!
//! Light at pixel (x, y) of an ellipse of luminance 1 is ∫ β(x − u)·[ς(y − v₋(u)) − ς(y − v₊(u))] du over its width:
//! the inner integral is closed. With u = A·cos φ the integrand is smooth and periodic in φ, so equal steps of φ converge
//! faster than any power of their number (Gauss–Chebyshev quadrature of the second kind). Each node is a chord of the
//! ellipse, and the image is a sum of separable terms.

use glam::{DMat2, DVec2};

use crate::kernel::{Exact, Kernel};

/// One vertical chord of an ellipse about its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Where it stands, in px right of the centre.
    pub u: f64,
    /// The width it stands for.
    pub weight: f64,
    /// Its upper end (smaller y).
    pub top: f64,
    /// Its lower end.
    pub bottom: f64,
}

/// The chords of an ellipse, such that the error of every pixel is at most a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Chords(pub Vec<Chord>);

/// The most chords that are tried: enough for 1e-13 at a blur of a tenth of the disc's radius.
const MOST: usize = 512;
/// Strips of a disc without blur. Half a strip's sagitta, and so the error of a pixel, is below 1e-4 px for a radius of 3 px.
const STRIPS: usize = 256;

impl Chords {
    /// `count` chords of the ellipse `shape·(cos φ, sin φ)`.
    pub fn new(shape: DMat2, count: usize) -> Self {
        let (first, second) = (shape.row(0), shape.row(1));
        let half_width = first.length();
        let tilt = first.dot(second) / half_width;
        let half_chord = shape.determinant().abs() / half_width;
        let step = std::f64::consts::PI / count as f64;
        let chord = |k: usize| {
            let (sin, cos) = ((k as f64 + 0.5) * step).sin_cos();
            let (middle, half) = (tilt * cos, half_chord * sin);
            Chord {
                u: half_width * cos,
                weight: half_width * sin * step,
                top: middle - half,
                bottom: middle + half,
            }
        };
        Self((0..count).map(chord).collect())
    }

    /// `count` strips that tile the ellipse's width, for an image without blur.
    pub fn strips(shape: DMat2, count: usize) -> Self {
        let (first, second) = (shape.row(0), shape.row(1));
        let half_width = first.length();
        let tilt = first.dot(second) / half_width;
        let half_chord = shape.determinant().abs() / half_width;
        let edge = |k: usize| (k as f64 * std::f64::consts::PI / count as f64).cos();
        let strip = |k: usize| {
            let (right, left) = (edge(k), edge(k + 1));
            let cos = (right + left) / 2.0;
            let (middle, half) = (tilt * cos, half_chord * (1.0 - cos * cos).sqrt());
            Chord {
                u: half_width * cos,
                weight: half_width * (right - left),
                top: middle - half,
                bottom: middle + half,
            }
        };
        Self((0..count).map(strip).collect())
    }

    /// The fewest chords (an even number) that keep every pixel's error below `tolerance` of the luminance, under a blur
    /// of `sigma_px`.
    pub fn within(shape: DMat2, sigma_px: f64, tolerance: f64) -> Self {
        if sigma_px == 0.0 {
            return Self::strips(shape, STRIPS);
        }
        let kernel = Exact::new(sigma_px);
        let mut count = 2;
        while count < MOST {
            let (few, many) = (Self::new(shape, count), Self::new(shape, 2 * count));
            if few.greatest_difference(&many, &kernel, sigma_px) <= tolerance {
                return few;
            }
            count += (count / 4).max(1) * 2;
        }
        Self::new(shape, MOST)
    }

    /// A convex polygon about its centre, its vertices in order, by two Gauss–Legendre nodes in each strip of at most half
    /// the blur's width (at most half a pixel) between vertices.
    pub fn of_polygon(vertices: &[DVec2], sigma_px: f64) -> Self {
        let mut cuts: Vec<f64> = vertices.iter().map(|v| v.x).collect();
        cuts.sort_by(f64::total_cmp);
        let widest = (sigma_px / 2.0).clamp(0.05, 0.5);
        let mut chords = Vec::new();
        for pair in cuts.windows(2) {
            let strips = ((pair[1] - pair[0]) / widest).ceil();
            for strip in 0..strips as usize {
                let width = (pair[1] - pair[0]) / strips;
                for node in [0.5 - 0.5 / 3f64.sqrt(), 0.5 + 0.5 / 3f64.sqrt()] {
                    let u = pair[0] + (strip as f64 + node) * width;
                    let (top, bottom) = crossing(vertices, u);
                    chords.push(Chord {
                        u,
                        weight: width / 2.0,
                        top,
                        bottom,
                    });
                }
            }
        }
        Self(chords)
    }

    /// Whether the chord k from either end stands mirrored about the centre, between the same heights.
    pub fn are_mirrored(&self) -> bool {
        let mut pairs = self.0.iter().zip(self.0.iter().rev());
        pairs.all(|(one, other)| {
            // Rounding apart, which is some 1e-15 px.
            let apart = [
                one.u + other.u,
                one.top - other.top,
                one.bottom - other.bottom,
            ];
            apart.iter().all(|distance| distance.abs() < 1e-11) && one.weight - other.weight < 1e-11
        })
    }

    /// How far the outermost light is from the centre along x, and along y.
    pub fn reach(&self) -> DVec2 {
        self.0.iter().fold(DVec2::ZERO, |reach, c| {
            reach.max(DVec2::new(c.u.abs(), c.top.abs().max(c.bottom.abs())))
        })
    }

    /// The light at (x, y) px from the centre.
    pub fn light(&self, kernel: &Exact, x: f64, y: f64) -> f64 {
        let chord = |c: &Chord| {
            c.weight
                * kernel.bell(x - c.u, c.weight)
                * (kernel.step(y - c.top) - kernel.step(y - c.bottom))
        };
        self.0.iter().map(chord).sum()
    }

    /// The greatest difference between two sets of chords over a grid of places.
    fn greatest_difference(&self, other: &Self, kernel: &Exact, sigma_px: f64) -> f64 {
        let reach = self.reach().max_element() + 2.0 * sigma_px;
        let places = (-8..=8).map(|i| reach * f64::from(i) / 8.0);
        let difference =
            |x: f64, y: f64| (self.light(kernel, x, y) - other.light(kernel, x, y)).abs();
        places
            .clone()
            .flat_map(|x| places.clone().map(move |y| difference(x, y)))
            .fold(0.0, f64::max)
    }
}

/// Where the vertical line at `u` enters and leaves a convex polygon.
fn crossing(vertices: &[DVec2], u: f64) -> (f64, f64) {
    let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
    let hits = edges
        .filter(|(a, b)| (a.x - u) * (b.x - u) < 0.0)
        .map(|(a, b)| a.y + (b.y - a.y) * (u - a.x) / (b.x - a.x));
    hits.fold((f64::INFINITY, f64::NEG_INFINITY), |(top, bottom), y| {
        (top.min(y), bottom.max(y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_the_light_arrives() {
        let shape = DMat2::from_cols(DVec2::new(1.7, 0.3), DVec2::new(-0.2, 1.1));
        let chords = Chords::within(shape, 1.5, 1e-13);
        let kernel = Exact::new(1.5);
        let sum: f64 = (-25..=25)
            .flat_map(|x| (-25..=25).map(move |y| (x, y)))
            .map(|(x, y)| chords.light(&kernel, f64::from(x) + 0.3, f64::from(y) - 0.1))
            .sum();
        let area = std::f64::consts::PI * shape.determinant();
        assert!((sum - area).abs() < 1e-11, "{sum} against {area}");
    }

    #[test]
    fn chords_lie_on_the_ellipse() {
        let shape = DMat2::from_cols(DVec2::new(1.7, 0.3), DVec2::new(-0.2, 1.1));
        for chord in Chords::new(shape, 9).0 {
            for v in [chord.top, chord.bottom] {
                assert!(((shape.inverse() * DVec2::new(chord.u, v)).length() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn fewer_chords_are_taken_where_less_is_asked() {
        let circle = DMat2::from_diagonal(DVec2::splat(1.1));
        let count = |tolerance| Chords::within(circle, 1.5, tolerance).0.len();
        assert!(
            count(1e-4) <= 4 && count(1e-4) < count(1e-12),
            "{} {}",
            count(1e-4),
            count(1e-12)
        );
    }
}
