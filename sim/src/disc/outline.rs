//! The exact light of a pixel from an ellipse or a polygon, pixel by pixel and at any blur.
//!
//! By Green's theorem the light at pixel (x, y) of an outline of luminance 1 is ∮ ς(u − x)·β(v − y) dv over its boundary (see
//! [`crate::disc::kernel`]): an integral along a line, of which only the part near the pixel's own sides takes work.
//! [`Chords`](crate::disc::chords::Chords) are faster if the blur is not much smaller than the outline, because all pixels share them. This
//! module covers all other cases, and is the reference in the tests of chords.

use std::f64::consts::PI;

use glam::{DMat2, DVec2};

use crate::disc::gauss;
use crate::disc::kernel::Exact;
use crate::disc::overlap;

/// The boundary of a uniformly bright shape, about its centre, in px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// The points `shape·(cos φ, sin φ)`.
    Ellipse(DMat2),
    /// The corners of a convex quadrilateral in order, in either direction.
    Quadrilateral([DVec2; 4]),
}

/// The distance in σ from a pixel's side beyond which light is ignored: less than 1e-57 of it.
const REACH_SIGMA: f64 = 16.0;
/// The longest panel of bell times step, as a part of a Gaussian's own: 1.5 σ integrate to 1e-13 of an LED and 1e-9 of a tail.
const PART_OF_PANEL: f64 = 0.3;
/// A smaller blur moves light by less than 1e-9 px, and counts as no blur.
const SHARPEST_PX: f64 = 1e-10;

/// A round blur, and the tolerance of its integration.
#[derive(Clone, Copy, Debug)]
pub struct Blur {
    sigma_px: f64,
    reach_px: f64,
    panel_px: f64,
}

impl Blur {
    /// A blur of `sigma_px` to 1e-9 of an outline's light: see [`Outline::light`].
    pub fn exact(sigma_px: f64) -> Self {
        Self::within(sigma_px, REACH_SIGMA * sigma_px, 0.0)
    }

    /// A blur of `sigma_px` that is 0 beyond `reach_px`, integrated to about `tolerance` of an outline's light.
    pub fn within(sigma_px: f64, reach_px: f64, tolerance: f64) -> Self {
        Self {
            sigma_px,
            reach_px,
            panel_px: PART_OF_PANEL * gauss::longest_panel(tolerance) * sigma_px,
        }
    }

    /// Its reach from an edge plus half a pixel, in px.
    pub(crate) fn margin_px(&self) -> f64 {
        0.5 + self.reach_px
    }
}

impl Outline {
    /// Its extent from its centre along x, and along y.
    pub fn reach(&self) -> DVec2 {
        match self {
            Self::Ellipse(shape) => DVec2::new(shape.row(0).length(), shape.row(1).length()),
            Self::Quadrilateral(corners) => corners.iter().fold(DVec2::ZERO, |reach, corner| reach.max(corner.abs())),
        }
    }

    /// The light, under a blur of `sigma_px`, at a pixel `at` px from the centre; without a blur, the covered part of the pixel.
    ///
    /// The error is at most 1e-9 for outlines up to a thousand pixels wide. Under a blur it is also at most 1e-9 of the
    /// light itself, down to a light of 1e-30.
    ///
    /// ```
    /// use glam::{DMat2, DVec2};
    /// use sim::disc::outline::Outline;
    /// let disc = Outline::Ellipse(DMat2::from_diagonal(DVec2::splat(500.0)));
    /// // The rim through the pixel's middle, at a blur that is a ten-thousandth of the disc.
    /// assert!((disc.light(0.05, DVec2::new(500.0, 0.0)) - 0.5).abs() < 1e-3);
    /// assert_eq!(disc.light(0.05, DVec2::ZERO), 1.0);
    /// ```
    pub fn light(&self, sigma_px: f64, at: DVec2) -> f64 {
        self.light_by(&Blur::exact(sigma_px), at)
    }

    /// The same, with the tolerance of `blur`.
    pub(crate) fn light_by(&self, blur: &Blur, at: DVec2) -> f64 {
        if blur.sigma_px < SHARPEST_PX {
            return match self {
                Self::Ellipse(shape) => overlap::ellipse(*shape, -at),
                Self::Quadrilateral(corners) => overlap::polygon(&corners.map(|corner| corner - at)),
            };
        }
        let pixel = Pixel::new(blur);
        if self.surrounds(at, pixel.far) {
            return 1.0;
        }
        // The step acts along the axis on which the pixel is farther out, from its dark side, to avoid cancellation.
        let outside = at.abs() - self.reach();
        let turned = if outside.x >= outside.y {
            DMat2::IDENTITY
        } else {
            DMat2::from_cols(DVec2::Y, DVec2::X)
        };
        let side = (turned * at).x.signum();
        let view = DMat2::from_diagonal(DVec2::new(side, 1.0)) * turned;
        self.around(&pixel, view, view * -at).abs()
    }

    /// Whether the whole square of half side `half` px around `at` is inside.
    fn surrounds(&self, at: DVec2, half: f64) -> bool {
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        let mut square = signs.map(|(x, y)| at + half * DVec2::new(x, y)).into_iter();
        match self {
            Self::Ellipse(shape) => {
                let to_disc = shape.inverse();
                square.all(|corner| (to_disc * corner).length_squared() < 1.0)
            }
            Self::Quadrilateral(corners) => square.all(|point| {
                let side = |k: usize| (corners[(k + 1) % 4] - corners[k]).perp_dot(point - corners[k]);
                (0..4).all(|k| side(k) > 0.0) || (0..4).all(|k| side(k) < 0.0)
            }),
        }
    }

    /// ∮ ς(u)·β(v) dv over the boundary, in the axes of `view`, about a `centre` relative to the pixel.
    fn around(&self, pixel: &Pixel, view: DMat2, centre: DVec2) -> f64 {
        match self {
            Self::Ellipse(shape) => {
                let shape = view * *shape;
                let curve = |angle: f64| {
                    let (sin, cos) = angle.sin_cos();
                    let (place, slope) = (DVec2::new(cos, sin), DVec2::new(-sin, cos));
                    (centre + shape * place, (shape * slope).y)
                };
                // Between its extreme points the boundary is monotonic along both axes.
                let outermost = |row: DVec2| row.y.atan2(row.x).rem_euclid(PI);
                let (a, b) = (outermost(shape.row(0)), outermost(shape.row(1)));
                let (a, b) = (a.min(b), a.max(b));
                let quarters = [(a, b), (b, a + PI), (a + PI, b + PI), (b + PI, a + 2.0 * PI)];
                quarters.map(|(from, to)| pixel.along(&curve, from, to)).iter().sum()
            }
            Self::Quadrilateral(corners) => {
                let side = |k: usize| {
                    let (from, to) = (centre + view * corners[k], centre + view * corners[(k + 1) % 4]);
                    pixel.along(&|part: f64| (from + (to - from) * part, (to - from).y), 0.0, 1.0)
                };
                (0..4).map(side).sum()
            }
        }
    }
}

/// The pixel at the origin.
struct Pixel {
    kernel: Exact,
    /// The distance from its centre beyond which it sees nothing.
    far: f64,
    /// The distance from its centre within which bell and step are straight.
    straight: f64,
    /// The longest panel, in px.
    panel: f64,
}

impl Pixel {
    fn new(blur: &Blur) -> Self {
        Self {
            kernel: Exact::new(blur.sigma_px),
            far: 0.5 + blur.reach_px,
            straight: 0.5 - blur.reach_px,
            panel: blur.panel_px,
        }
    }

    /// ∫ ς(u)·β(v) dv on a curve that gives the position and dv for each parameter, and is monotonic along both axes between `from` and
    /// `to`.
    fn along(&self, curve: &impl Fn(f64) -> (DVec2, f64), from: f64, to: f64) -> f64 {
        let (start, end) = (curve(from).0, curve(to).0);
        let (low, high) = (start.min(end), start.max(end));
        if high.x < -self.far || high.y < -self.far || low.y > self.far {
            return 0.0;
        }
        if low.x > self.far {
            return (end.y - start.y).signum() * self.kernel.between(low.y, high.y - low.y);
        }
        let is_straight = low.abs().max(high.abs()).max_element() < self.straight;
        if is_straight || (high - low).max_element() <= self.panel {
            let light = |(at, weight): (f64, f64)| {
                let (place, slope) = curve(at);
                weight * slope * self.kernel.step(place.x) * self.kernel.bell(place.y)
            };
            return gauss::nodes(from, to).map(light).sum();
        }
        let middle = f64::midpoint(from, to);
        self.along(curve, from, middle) + self.along(curve, middle, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::Accuracy;

    #[test]
    fn a_coarser_blur_errs_by_what_it_was_allowed() {
        let outlines = [
            Outline::Ellipse(DMat2::from_cols(DVec2::new(12.0, 3.0), DVec2::new(-2.0, 9.0))),
            Outline::Quadrilateral([
                DVec2::new(-14.0, -9.0),
                DVec2::new(13.0, -11.0),
                DVec2::new(15.0, 8.0),
                DVec2::new(-12.0, 10.0),
            ]),
        ];
        for (sigma_px, tolerance) in [(0.3, 1e-3), (0.8, 1e-5), (1.1, 1e-7), (4.0, 1e-4)] {
            let blur = Accuracy::even(tolerance).blur(sigma_px);
            for outline in outlines {
                let mut worst = 0.0_f64;
                for i in -40..=40 {
                    let at = DVec2::new(0.61 * f64::from(i), 0.37 * f64::from(i * i % 53 - 26));
                    let off = outline.light_by(&blur, at) - outline.light(sigma_px, at);
                    worst = worst.max(off.abs());
                }
                assert!(worst <= tolerance, "σ {sigma_px}: {worst:e}");
                assert!(worst > 0.0, "σ {sigma_px}: drawn as exactly as can be");
            }
        }
    }
}
