//! The image of an LED: a disc of light in perspective, an ellipse, blurred by the lens and summed by square pixels.
//!
//! The image of a lamp with the same brightness from all sides is uniform. It is cut into chords down the image. Along each chord, blur and
//! pixels are integrated exactly; across them, the Gauss–Chebyshev rule applies, whose weights are those of a disc's chords.

use super::gauss::Gauss;

/// The greatest width of an LED's image along an axis (px).
pub(super) const PATCH: usize = 24;
/// The reach of light beyond the disc's rim, in standard deviations of the blur.
const REACH: f64 = 4.2;
/// Smaller discs, by half width over the blur's standard deviation, differ only in their variance.
const SMALL: f64 = 1.2;
/// Larger discs, by the same ratio, have a rim that few chords would leave notched.
const SHARP: f64 = 3.0;
/// Chords for small discs, for larger ones, and for those with a sharp rim: exact for polynomials of degree 5, 11 and 31.
const CHORDS: [usize; 3] = [3, 6, 16];
/// The shortest chord, in standard deviations of the blur: shorter ones are drawn as points.
const SHORTEST: f64 = 0.02;

/// An ellipse of uniform light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipse {
    /// Its middle (px).
    pub centre: [f64; 2],
    /// The images of a circle's radii of length 1 along two perpendicular axes, from the middle (px).
    pub radii: [[f64; 2]; 2],
}

impl Ellipse {
    /// Its extent along both axes.
    fn reach(&self) -> [f64; 2] {
        let [a, b] = self.radii;
        [0, 1].map(|axis| libm::hypot(a[axis], b[axis]))
    }

    /// Its area (px²).
    pub fn area(&self) -> f64 {
        let [a, b] = self.radii;
        core::f64::consts::PI * (a[0] * b[1] - a[1] * b[0]).abs()
    }
}

/// The image of an LED whose light is 1 per pixel of its area.
pub(super) struct Patch {
    /// First column and row.
    first: [i32; 2],
    /// Columns and rows, up to [`PATCH`].
    size: [usize; 2],
    /// Light of each pixel, and its derivatives by the LED's x, its y, and the blur's standard deviation.
    light: [Light; PATCH * PATCH],
}

/// Light of a pixel and its derivatives.
pub(super) type Light = [f32; 4];

impl Patch {
    pub const EMPTY: Self = Self {
        first: [0; 2],
        size: [0; 2],
        light: [[0.0; 4]; PATCH * PATCH],
    };

    /// Draws an ellipse under a blur of `sigma` px.
    pub fn draw(&mut self, ellipse: &Ellipse, sigma: f64, gauss: &Gauss) {
        let reach = ellipse.reach();
        for (axis, reach) in reach.into_iter().enumerate() {
            let room = reach + REACH * sigma + 0.5;
            let first = libm::ceil(ellipse.centre[axis] - room);
            self.first[axis] = first as i32;
            self.size[axis] = ((libm::floor(ellipse.centre[axis] + room) - first) as usize + 1).min(PATCH);
        }
        let [width, height] = self.size;
        self.light[..width * height].fill([0.0; 4]);
        let across = reach[0].max(SHORTEST * sigma);
        let [a, b] = ellipse.radii;
        // The slope of the line through the chords' middles, and the length of the middle chord.
        let lower = (a[0] * a[1] + b[0] * b[1]) / across;
        let longest = ellipse.area() / core::f64::consts::PI / across;
        let widest = reach[0].max(reach[1]) / sigma;
        let count = CHORDS[usize::from(widest > SMALL) + usize::from(widest > SHARP)];
        let (mut along, mut down) = ([[0.0; 3]; PATCH], [[0.0; 3]; PATCH]);
        for chord in 1..=count {
            let (sin, cos) = libm::sincos(chord as f64 * core::f64::consts::PI / (count + 1) as f64);
            let light = ellipse.area() * 2.0 * sin * sin / (count + 1) as f64;
            let x = ellipse.centre[0] + across * cos - f64::from(self.first[0]);
            let y = ellipse.centre[1] + lower * cos - f64::from(self.first[1]);
            let half = (longest * sin).max(SHORTEST * sigma);
            of_point(&mut along[..width], x, sigma, light, gauss);
            of_chord(&mut down[..height], y, half, sigma, gauss);
            for (row, [d, dy, ds]) in self.light.chunks_exact_mut(width).zip(&down[..height]) {
                for (pixel, [a, ax, as_]) in row.iter_mut().zip(&along[..width]) {
                    pixel[0] += a * d;
                    pixel[1] += ax * d;
                    pixel[2] += a * dy;
                    pixel[3] += as_ * d + a * ds;
                }
            }
        }
    }

    /// The first lit column of a row, and the light of this and the next ones.
    pub fn row(&self, row: usize) -> Option<(i32, &[Light])> {
        let y = usize::try_from(row as i32 - self.first[1]).ok()?;
        let width = self.size[0];
        (y < self.size[1]).then(|| (self.first[0], &self.light[y * width..(y + 1) * width]))
    }
}

/// A point's light along one axis, and its derivatives by its place and by σ.
fn of_point(pixels: &mut [[f32; 3]], at: f64, sigma: f64, light: f64, gauss: &Gauss) {
    let edge = |edge: f64| {
        let t = (edge - at) / sigma;
        let here = gauss.at(t);
        let slope = here.density * light / sigma;
        [here.once * light, -slope, -t * slope]
    };
    between_edges(pixels, edge);
}

/// The same for a chord with half length `half`, along it.
fn of_chord(pixels: &mut [[f32; 3]], at: f64, half: f64, sigma: f64, gauss: &Gauss) {
    let share = 0.5 / half;
    let edge = |edge: f64| {
        let [ahead, behind] = [half, -half].map(|end| gauss.at((edge - at + end) / sigma));
        [
            sigma * share * (ahead.twice - behind.twice),
            share * (behind.once - ahead.once),
            share * (ahead.density - behind.density),
        ]
    };
    between_edges(pixels, edge);
}

/// The integral between each pixel's edges.
fn between_edges(pixels: &mut [[f32; 3]], edge: impl Fn(f64) -> [f64; 3]) {
    let mut before = edge(-0.5);
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let after = edge(i as f64 + 0.5);
        *pixel = core::array::from_fn(|k| (after[k] - before[k]) as f32);
        before = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(ellipse: &Ellipse, sigma: f64) -> Patch {
        let (mut patch, mut gauss) = (Patch::EMPTY, Gauss::EMPTY);
        gauss.prepare();
        patch.draw(ellipse, sigma, &gauss);
        patch
    }

    /// A pixel's light by brute force: a hundred thousand points, by libm.
    fn summed(ellipse: &Ellipse, sigma: f64, pixel: [usize; 2]) -> f64 {
        const COUNT: usize = 400;
        let share = ellipse.area() * 4.0 / (COUNT * COUNT) as f64 / core::f64::consts::PI;
        let inside = |at: f64| 0.5 * libm::erf(at / sigma / core::f64::consts::SQRT_2);
        let place = |c: usize| (c as f64 + 0.5) * 2.0 / COUNT as f64 - 1.0;
        let points = (0..COUNT * COUNT).map(|i| [place(i % COUNT), place(i / COUNT)]);
        let light = points.filter(|[u, v]| u * u + v * v < 1.0).map(|[u, v]| {
            let [x, y] = [0, 1].map(|axis| {
                let [a, b] = ellipse.radii.map(|radius| radius[axis]);
                let off = pixel[axis] as f64 - (ellipse.centre[axis] + u * a + v * b);
                inside(off + 0.5) - inside(off - 0.5)
            });
            share * x * y
        });
        light.sum()
    }

    fn light(patch: &Patch, [column, row]: [usize; 2]) -> Light {
        let of_row = patch.row(row);
        let light = of_row.and_then(|(first, row)| row.get(usize::try_from(column as i32 - first).ok()?));
        light.copied().unwrap_or_default()
    }

    #[test]
    fn few_chords_stand_for_a_disc() {
        for (radius, sigma, bound) in [
            (0.5, 0.6, 1e-3),
            (1.1, 1.5, 1e-3),
            (1.75, 1.5, 1e-3),
            (1.5, 0.6, 1e-3),
            (2.0, 0.9, 1e-3),
            (1.5, 0.4, 1e-3),
            (1.5, 0.2, 2e-3),
        ] {
            for (short, turn) in [(1.0, 0.0), (0.3, 0.7), (0.1, 1.6)] {
                let (sin, cos) = libm::sincos(turn);
                let along = [radius * cos, radius * sin];
                let ellipse = Ellipse {
                    centre: [12.31, 11.83],
                    radii: [along, [-short * along[1], short * along[0]]],
                };
                let patch = draw(&ellipse, sigma);
                let peak = summed(&ellipse, sigma, [12, 12]);
                for pixel in [[12, 12], [13, 11], [10, 13], [12, 14], [13, 12], [15, 15]] {
                    let drawn = f64::from(light(&patch, pixel)[0]);
                    let off = (drawn - summed(&ellipse, sigma, pixel)).abs() / peak;
                    assert!(off < bound, "{off}: radius {radius}, sigma {sigma}, {short}, turned {turn}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_light() {
        let at = |x: f64, y: f64, sigma: f64| {
            let ellipse = Ellipse {
                centre: [x, y],
                radii: [[1.3, 0.4], [-0.2, 0.9]],
            };
            draw(&ellipse, sigma)
        };
        let (x, y, sigma, step) = (8.1, 7.8, 1.2, 2e-3);
        let pairs = [
            (at(x + step, y, sigma), at(x - step, y, sigma)),
            (at(x, y + step, sigma), at(x, y - step, sigma)),
            (at(x, y, sigma + step), at(x, y, sigma - step)),
        ];
        let here = at(x, y, sigma);
        for (number, (ahead, behind)) in pairs.iter().enumerate() {
            assert_eq!((ahead.first, ahead.size), (behind.first, behind.size));
            for pixel in [[7, 5], [8, 8], [9, 6], [5, 9]] {
                let [ahead, behind] = [ahead, behind].map(|patch| light(patch, pixel)[0]);
                let difference = (ahead - behind) / (2.0 * step as f32);
                assert!((difference - light(&here, pixel)[1 + number]).abs() < 2e-3);
            }
        }
    }
}
