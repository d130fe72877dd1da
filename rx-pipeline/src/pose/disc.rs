//! What an LED leaves in the image: a disc of light, blurred by the lens and summed by square pixels.

/// The widest that one LED's image may be along an axis (px).
pub(super) const PATCH: usize = 24;
/// How far from the disc's rim light is reckoned with, in standard deviations of the blur.
const REACH: f64 = 4.2;
/// Discs of a radius less than this share of the blur's standard deviation look alike, but for their variance.
const SMALL: f64 = 1.2;
/// Those of a greater radius than this many standard deviations have a rim that few points would leave notched.
const SHARP: f64 = 3.0;
/// Points that stand for a disc, at most.
const POINTS: usize = 80;
/// Gauss & Legendre's abscissas and weights from 0 to 1: three of them, and five.
const THREE: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];
const FIVE: [(f64, f64); 5] = [
    (0.046_910_077_030_668_02, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 64.0 / 225.0),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// A point of the disc of radius 1, and its share of the light.
pub(super) type Point = ([f64; 2], f64);

/// The points that stand for a disc of radius 1, as many as its rim calls for under such a blur.
pub(super) struct Points {
    all: [Point; POINTS],
    count: usize,
}

impl Points {
    /// Polynomials over the disc are summed exactly: up to degree 5 by seven points (Hammer & Stroud 1958), to degree 11 by three rings of
    /// 12, to degree 15 by five of 16 (Gauss & Legendre in the squared radius).
    pub fn of(radius_px: f64, sigma_px: f64) -> Self {
        let mut points = Self {
            all: [([0.0; 2], 0.0); POINTS],
            count: 0,
        };
        if radius_px < SMALL * sigma_px {
            points.ring(0.0, 0.25, 1, 0.0);
            points.ring(2.0 / 3.0, 0.75, 6, 0.0);
        } else if radius_px < SHARP * sigma_px {
            points.rings(&THREE, 12);
        } else {
            points.rings(&FIVE, 16);
        }
        points
    }

    /// The points.
    pub fn iter(&self) -> impl Iterator<Item = Point> + Clone + '_ {
        self.all[..self.count].iter().copied()
    }

    fn rings(&mut self, rings: &[(f64, f64)], on_each: usize) {
        for (i, &(square, share)) in rings.iter().enumerate() {
            self.ring(square, share, on_each, 0.5 * i as f64);
        }
    }

    /// Points on a ring of such a squared radius and share, the first of them `turn` steps on.
    fn ring(&mut self, square: f64, share: f64, count: usize, turn: f64) {
        let radius = libm::sqrt(square);
        for i in 0..count {
            let angle = (i as f64 + turn) * core::f64::consts::TAU / count as f64;
            let place = [radius * libm::cos(angle), radius * libm::sin(angle)];
            self.all[self.count] = (place, share / count as f64);
            self.count += 1;
        }
    }
}

/// The image of one LED of light 1 per pixel of its area.
pub(super) struct Patch {
    /// First column and row.
    pub first: [i32; 2],
    /// Columns and rows, up to [`PATCH`].
    pub size: [usize; 2],
    /// Light of each pixel, and its slopes when the LED moves along x, along y, and when the blur's standard deviation grows.
    pub light: [[f32; 4]; PATCH * PATCH],
}

impl Patch {
    pub const EMPTY: Self = Self {
        first: [0; 2],
        size: [0; 2],
        light: [[0.0; 4]; PATCH * PATCH],
    };

    /// Draws the disc of which `points` are points, each with its light.
    pub fn draw(&mut self, points: impl Iterator<Item = Point> + Clone, sigma: f64) {
        let reach = REACH * sigma + 0.5;
        for axis in 0..2 {
            let low = points
                .clone()
                .fold(f64::INFINITY, |low, (at, _)| low.min(at[axis]));
            let high = points
                .clone()
                .fold(f64::NEG_INFINITY, |high, (at, _)| high.max(at[axis]));
            let first = libm::ceil(low - reach);
            self.first[axis] = first as i32;
            self.size[axis] = ((libm::floor(high + reach) - first) as usize + 1).min(PATCH);
        }
        let [width, height] = self.size;
        self.light[..width * height].fill([0.0; 4]);
        let (mut along, mut down) = ([[0.0; 3]; PATCH], [[0.0; 3]; PATCH]);
        for ([x, y], light) in points {
            profile(&mut along[..width], f64::from(self.first[0]) - x, sigma);
            profile(&mut down[..height], f64::from(self.first[1]) - y, sigma);
            for (row, [d, dy, ds]) in self.light.chunks_exact_mut(width).zip(&down[..height]) {
                for (pixel, [a, ax, as_]) in row.iter_mut().zip(&along[..width]) {
                    pixel[0] += (light * a * d) as f32;
                    pixel[1] += (light * ax * d) as f32;
                    pixel[2] += (light * a * dy) as f32;
                    pixel[3] += (light * (as_ * d + a * ds)) as f32;
                }
            }
        }
    }

    /// Whether it shines on a row at all.
    pub fn has_row(&self, row: usize) -> bool {
        usize::try_from(row as i32 - self.first[1]).is_ok_and(|y| y < self.size[1])
    }

    /// Light and slopes at a pixel.
    pub fn at(&self, column: usize, row: usize) -> Option<[f64; 4]> {
        let x = usize::try_from(column as i32 - self.first[0]).ok()?;
        let y = usize::try_from(row as i32 - self.first[1]).ok()?;
        (x < self.size[0] && y < self.size[1])
            .then(|| self.light[y * self.size[0] + x].map(f64::from))
    }
}

/// A point's light along one axis in pixels from `first` from it on, and its slopes by the point's place and by σ.
fn profile(pixels: &mut [[f64; 3]], first: f64, sigma: f64) {
    let edge = |at: f64| {
        let z = at / sigma;
        let density = libm::exp(-0.5 * z * z) / (sigma * libm::sqrt(core::f64::consts::TAU));
        (
            0.5 * libm::erf(z * core::f64::consts::FRAC_1_SQRT_2),
            density,
            -z * density,
        )
    };
    let mut before = edge(first - 0.5);
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let after = edge(first + i as f64 + 0.5);
        *pixel = [after.0 - before.0, before.1 - after.1, after.2 - before.2];
        before = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The disc by brute force: a hundred thousand points.
    fn summed(centre: [f64; 2], radius: f64, sigma: f64) -> Patch {
        let mut patch = Patch::EMPTY;
        let count = 400;
        let grid = (0..count * count).filter_map(|i| {
            let [x, y] =
                [i % count, i / count].map(|c| (c as f64 + 0.5) * 2.0 / count as f64 - 1.0);
            let share = 4.0 / (count * count) as f64 / core::f64::consts::PI;
            (x * x + y * y < 1.0).then(|| ([centre[0] + radius * x, centre[1] + radius * y], share))
        });
        patch.draw(grid, sigma);
        patch
    }

    #[test]
    fn few_points_stand_for_a_disc() {
        for (radius, sigma, bound) in [
            (0.5, 0.6, 2e-3),
            (1.1, 1.5, 1e-3),
            (1.5, 0.6, 1e-3),
            (2.0, 0.9, 1e-3),
            (1.5, 0.4, 1e-3),
            (1.5, 0.2, 2e-3),
        ] {
            let centre = [0.31, -0.17];
            let points = Points::of(radius, sigma);
            let mut patch = Patch::EMPTY;
            let placed = points
                .iter()
                .map(|([x, y], share)| ([centre[0] + radius * x, centre[1] + radius * y], share));
            patch.draw(placed, sigma);
            let truth = summed(centre, radius, sigma);
            let peak = truth.light.iter().fold(0.0f32, |peak, c| peak.max(c[0]));
            for y in 0..9 {
                for x in 0..9 {
                    let value = |patch: &Patch| {
                        let (column, row) = (x - 4 - patch.first[0], y - 4 - patch.first[1]);
                        let inside = (0..patch.size[0] as i32).contains(&column)
                            && (0..patch.size[1] as i32).contains(&row);
                        if inside {
                            patch.light[row as usize * patch.size[0] + column as usize][0]
                        } else {
                            0.0
                        }
                    };
                    let off = (value(&patch) - value(&truth)).abs() / peak;
                    assert!(off < bound, "radius {radius}, sigma {sigma}: {off}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_light() {
        let draw = |x: f64, sigma: f64| {
            let mut patch = Patch::EMPTY;
            patch.draw([([x, 0.0], 1.0)].into_iter(), sigma);
            patch
        };
        let (here, moved, wider) = (draw(8.0, 1.2), draw(8.0005, 1.2), draw(8.0, 1.2005));
        let centre = here.size[0] / 2 * here.size[0] + here.size[0] / 2 - 1;
        for (other, slope) in [(moved, 1), (wider, 3)] {
            assert_eq!(other.first, here.first);
            let difference = (other.light[centre][0] - here.light[centre][0]) / 5e-4;
            assert!((difference - here.light[centre][slope]).abs() < 1e-3);
        }
    }
}
