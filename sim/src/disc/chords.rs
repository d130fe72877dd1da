//! A disc's image as a few chords.
//!
//! Light at pixel (x, y) of an ellipse of luminance 1 is ∫ β(x − u)·[ς(y − v₋(u)) − ς(y − v₊(u))] du over its width: the inner integral has
//! a closed form. With u = A·cos φ the integrand is smooth and periodic in φ, so equal steps of φ converge faster than any power of their
//! number (Gauss–Chebyshev quadrature of the second kind). Each node is a chord of the ellipse, and the image is a sum of separable terms.

use glam::{DMat2, DVec2};

use crate::disc::gauss;
use crate::disc::kernel::Exact;
use crate::disc::outline::Outline;

/// One vertical chord of an ellipse about its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// Its position, in px right of the centre.
    pub u: f64,
    /// Its weight: the width that it represents.
    pub weight: f64,
    /// Its upper end (smaller y).
    pub top: f64,
    /// Its lower end.
    pub bottom: f64,
}

/// The chords of an ellipse, such that the error of every pixel is at most a tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct Chords(pub Vec<Chord>);

/// The greatest number of chords: enough for 1e-13 at a blur of a hundredth of the disc's radius. Beyond, an [`Outline`] is faster pixel by
/// pixel.
const MOST: usize = 512;
/// The same for a polygon, which is drawn once a frame rather than 64 times.
const MOST_OF_POLYGON: usize = 4096;

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

    /// The fewest chords that keep every pixel's error below `tolerance` of the luminance, under a blur of `sigma_px`. `None` without a
    /// blur, or if it is so small that too many chords would be needed: then the [`Outline`] itself is drawn.
    pub fn within(outline: &Outline, sigma_px: f64, tolerance: f64) -> Option<Self> {
        match outline {
            Outline::Ellipse(shape) => Self::of_ellipse(*shape, sigma_px, tolerance),
            Outline::Quadrilateral(corners) => Self::of_polygon(corners, sigma_px, tolerance),
        }
    }

    /// The first even number of chords that differs from twice as many by at most half the tolerance on a grid of positions. Between the
    /// positions the difference may be up to twice as large.
    ///
    /// In the frequency domain `n` chords of a disc of radius a are exact up to about 2n/a, where the blur leaves exp(−2·n²·σ²/a²): the
    /// search starts a little before that has fallen to the tolerance.
    fn of_ellipse(shape: DMat2, sigma_px: f64, tolerance: f64) -> Option<Self> {
        let longest = shape.row(0).length().hypot(shape.row(1).length());
        let expected = longest / sigma_px * (-tolerance.ln() / 2.0).sqrt();
        if expected.is_nan() || expected > 2.0 * MOST as f64 {
            return None;
        }
        let kernel = Exact::new(sigma_px);
        let mut count = (expected / 4.0) as usize * 2 + 2;
        while count < MOST {
            let (few, many) = (Self::new(shape, count), Self::new(shape, 2 * count));
            if few.greatest_difference(&many, &kernel, sigma_px) <= tolerance / 2.0 {
                return Some(few);
            }
            count += (count / 16).max(1) * 2;
        }
        None
    }

    /// A convex polygon about its centre, its vertices in order, by the rule of [`gauss`] on strips within which all edges are short enough
    /// for the rule.
    fn of_polygon(vertices: &[DVec2], sigma_px: f64, tolerance: f64) -> Option<Self> {
        let longest = gauss::longest_panel(tolerance) * sigma_px;
        let mut cuts: Vec<f64> = vertices.iter().map(|v| v.x).collect();
        cuts.sort_by(f64::total_cmp);
        let mut chords = Vec::new();
        for pair in cuts.windows(2).filter(|pair| pair[0] < pair[1]) {
            let (start, end) = (crossing(vertices, pair[0]), crossing(vertices, pair[1]));
            let rise = (end.0 - start.0).abs().max((end.1 - start.1).abs());
            let strips = ((pair[1] - pair[0]).hypot(rise) / longest).ceil().max(1.0);
            if strips * gauss::COUNT as f64 > (MOST_OF_POLYGON - chords.len()) as f64 {
                return None;
            }
            let width = (pair[1] - pair[0]) / strips;
            for strip in 0..strips as usize {
                let left = pair[0] + strip as f64 * width;
                chords.extend(gauss::nodes(left, left + width).map(|(u, weight)| {
                    let (top, bottom) = crossing(vertices, u);
                    Chord { u, weight, top, bottom }
                }));
            }
        }
        Some(Self(chords))
    }

    /// Whether the chords k from either end are mirror images about the centre, between the same heights.
    pub(crate) fn are_mirrored(&self) -> bool {
        let mut pairs = self.0.iter().zip(self.0.iter().rev());
        pairs.all(|(one, other)| {
            // Up to rounding, some 1e-15 px.
            let apart = [one.u + other.u, one.top - other.top, one.bottom - other.bottom];
            apart.iter().all(|distance| distance.abs() < 1e-11) && one.weight - other.weight < 1e-11
        })
    }

    /// The extent of the light from the centre along x, and along y.
    pub fn reach(&self) -> DVec2 {
        self.0.iter().fold(DVec2::ZERO, |reach, c| {
            reach.max(DVec2::new(c.u.abs(), c.top.abs().max(c.bottom.abs())))
        })
    }

    /// The light at a pixel `at` px from the centre.
    pub fn light(&self, kernel: &Exact, at: DVec2) -> f64 {
        let chord = |c: &Chord| c.weight * kernel.bell(at.x - c.u) * kernel.between(at.y - c.bottom, c.bottom - c.top);
        self.0.iter().map(chord).sum()
    }

    /// The greatest difference between two sets of chords over a grid of positions, at which a corner of the pixel passes over the whole
    /// image.
    fn greatest_difference(&self, other: &Self, kernel: &Exact, sigma_px: f64) -> f64 {
        let reach = self.reach().max_element() + 2.0 * sigma_px;
        let places = (-8..=8).map(|i| 0.5 + reach * f64::from(i) / 8.0);
        let difference = |at: DVec2| (self.light(kernel, at) - other.light(kernel, at)).abs();
        places
            .clone()
            .flat_map(|x| places.clone().map(move |y| difference(DVec2::new(x, y))))
            .fold(0.0, f64::max)
    }
}

/// The points at which the vertical line at `u` enters and leaves a convex polygon.
fn crossing(vertices: &[DVec2], u: f64) -> (f64, f64) {
    let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
    let hits = edges
        .filter(|(a, b)| a.x != b.x && (a.x - u) * (b.x - u) <= 0.0)
        .map(|(a, b)| a.y + (b.y - a.y) * (u - a.x) / (b.x - a.x));
    hits.fold((f64::INFINITY, f64::NEG_INFINITY), |(top, bottom), y| (top.min(y), bottom.max(y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_the_light_arrives() {
        let shape = DMat2::from_cols(DVec2::new(1.7, 0.3), DVec2::new(-0.2, 1.1));
        let chords = Chords::of_ellipse(shape, 1.5, 1e-13).unwrap();
        let kernel = Exact::new(1.5);
        let sum: f64 = (-25..=25)
            .flat_map(|x| (-25..=25).map(move |y| (x, y)))
            .map(|(x, y)| chords.light(&kernel, DVec2::new(f64::from(x) + 0.3, f64::from(y) - 0.1)))
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
    fn chords_agree_with_the_outline_within_their_tolerance() {
        let corner = |x: f64, y: f64| DVec2::new(x, y);
        let outlines = [
            Outline::Ellipse(DMat2::from_diagonal(DVec2::splat(0.3))),
            Outline::Ellipse(DMat2::from_diagonal(DVec2::new(2.2, 2.1))),
            Outline::Ellipse(DMat2::from_cols(corner(30.0, 12.0), corner(-9.0, 14.0))),
            Outline::Quadrilateral([corner(-20.0, -21.0), corner(20.0, -20.0), corner(19.0, 20.0), corner(-20.3, 20.0)]),
            Outline::Quadrilateral([corner(-20.0, -20.0), corner(20.0, -20.0), corner(20.0, 20.0), corner(-20.0, 20.0)]),
            Outline::Quadrilateral([corner(0.0, -30.0), corner(28.0, 1.0), corner(2.0, 35.0), corner(-30.0, 3.0)]),
        ];
        for outline in outlines {
            for (sigma, tolerance) in [(0.5, 1e-2), (0.5, 1e-4), (1.5, 1e-2), (1.5, 1e-5), (1.5, 1e-7), (3.0, 1e-12)] {
                let chords = Chords::within(&outline, sigma, tolerance).unwrap();
                let kernel = Exact::new(sigma);
                let reach = outline.reach() + sigma;
                let worst = (0..400)
                    .map(|k| {
                        let fraction = |step: f64| (f64::from(k) * step).fract() * 2.0 - 1.0;
                        let at = reach * DVec2::new(fraction(0.618_034), fraction(0.754_878));
                        (chords.light(&kernel, at) - outline.light(sigma, at)).abs()
                    })
                    .fold(0.0, f64::max);
                println!("{outline:?} {sigma} {tolerance:e}: {} chords {worst:e}", chords.0.len());
                assert!(worst <= tolerance, "{outline:?} at {sigma} px: {worst:e} > {tolerance:e}");
            }
        }
    }

    #[test]
    fn fewer_chords_are_taken_where_less_is_asked() {
        let circle = DMat2::from_diagonal(DVec2::splat(1.1));
        let count = |tolerance| Chords::of_ellipse(circle, 1.5, tolerance).unwrap().0.len();
        assert!(count(1e-4) <= 4 && count(1e-4) < count(1e-12), "{} {}", count(1e-4), count(1e-12));
    }
}
