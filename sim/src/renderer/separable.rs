//! The image of one LED as a few products of a column of values and a row of values.
//!
//! A [`SeparableImage`] fills both for any sub-pixel position of the LED; [`crate::renderer::canvas`] multiplies them. Two kinds:
//!
//! | image | values | choose it |
//! |---|---|---|
//! | [`ChordImage`] | computed from [`Chords`] and a [`Kernel`] each time | for the reference, and if each LED has its own shape |
//! | [`Polyphase`](crate::renderer::polyphase::Polyphase) | read from a table, a vector at a time | if many LEDs share one shape |

use crate::disc::chords::Chords;
use crate::disc::kernel::{Kernel, Real};
use crate::disc::spread::{Column, Spread};

/// The image of an LED of luminance 1, as the sum over terms of (values across)·(values down).
///
/// For an LED centred at c, the first value of either belongs to the pixel ⌊c⌋ − `before`, and `fraction` is c − ⌊c⌋.
pub trait SeparableImage {
    /// The type of the image.
    type Real: Real;
    /// The number of products.
    fn terms(&self) -> usize;
    /// The number of lit pixels left of (above) the centre's.
    fn before(&self) -> [usize; 2];
    /// The length of the values across and down: for light up to r px to either side, from −⌊r⌋ to ⌊r⌋ + 1.
    fn size(&self) -> [usize; 2] {
        self.before().map(|before| 2 * before + 2)
    }
    /// The values across of one term.
    fn across(&self, term: usize, fraction: f64, values: &mut [Self::Real]);
    /// The values down of one term.
    fn down(&self, term: usize, fraction: f64, values: &mut [Self::Real]);
}

impl<S: SeparableImage> SeparableImage for &S {
    type Real = S::Real;

    #[inline(always)]
    fn terms(&self) -> usize {
        (*self).terms()
    }

    #[inline(always)]
    fn before(&self) -> [usize; 2] {
        (*self).before()
    }

    #[inline(always)]
    fn size(&self) -> [usize; 2] {
        (*self).size()
    }

    #[inline(always)]
    fn across(&self, term: usize, fraction: f64, values: &mut [S::Real]) {
        (*self).across(term, fraction, values);
    }

    #[inline(always)]
    fn down(&self, term: usize, fraction: f64, values: &mut [S::Real]) {
        (*self).down(term, fraction, values);
    }
}

/// An image of chords, each for each column of the spread; two chords that are mirror images about the centre make one term.
#[derive(Clone, Copy, Debug)]
pub struct ChordImage<'a, K> {
    kernel: &'a K,
    chords: &'a Chords,
    spread: &'a Spread,
    before: [usize; 2],
    paired: bool,
}

impl<'a, K: Kernel> ChordImage<'a, K> {
    /// The image by `kernel` of the shape of `chords`, spread, and drawn up to `margin_px` beyond its edge.
    pub fn new(kernel: &'a K, chords: &'a Chords, spread: &'a Spread, margin_px: f64) -> Self {
        Self {
            kernel,
            chords,
            spread,
            before: (chords.reach() + margin_px).to_array().map(|reach| reach as usize),
            paired: chords.are_mirrored(),
        }
    }

    /// The chord and the column of a term.
    #[inline(always)]
    fn parts(&self, term: usize) -> (usize, &Column) {
        let columns = &self.spread.columns;
        (term / columns.len(), &columns[term % columns.len()])
    }
}

impl<K: Kernel> SeparableImage for ChordImage<'_, K> {
    type Real = K::Real;

    fn terms(&self) -> usize {
        let chords = self.chords.0.len();
        let chords = if self.paired { chords.div_ceil(2) } else { chords };
        chords * self.spread.columns.len()
    }

    fn before(&self) -> [usize; 2] {
        self.before
    }

    #[inline(always)]
    fn across(&self, term: usize, fraction: f64, values: &mut [K::Real]) {
        let (index, column) = self.parts(term);
        let chord = &self.chords.0[index];
        let first = -(self.before[0] as f64) - fraction;
        values.fill(K::Real::default());
        for (place, part) in &column.across {
            let (first, weight) = (first - place, K::Real::from_f64(chord.weight * part));
            self.kernel.add_bells(first - chord.u, weight, values);
            // An odd chord in the middle counts once.
            if self.paired && 2 * index + 1 < self.chords.0.len() {
                self.kernel.add_bells(first + chord.u, weight, values);
            }
        }
    }

    #[inline(always)]
    fn down(&self, term: usize, fraction: f64, values: &mut [K::Real]) {
        let (index, column) = self.parts(term);
        let chord = &self.chords.0[index];
        let first = -(self.before[1] as f64) - fraction;
        values.fill(K::Real::default());
        for piece in &column.down {
            for (end, sign) in [(chord.top, 1.0), (chord.bottom, -1.0)] {
                let (first, weight) = (first - piece.place - end, K::Real::from_f64(sign * piece.weight));
                if piece.half == 0.0 {
                    self.kernel.add_steps(first, weight, values);
                } else {
                    self.kernel.add_slopes(first, piece.half, weight, values);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disc::kernel::Exact;
    use crate::disc::outline::Outline;
    use crate::disc::spread::Shape;
    use glam::{DMat2, DVec2};

    /// The light of an image at every pixel around an LED centred at `fraction`.
    fn light_of<S: SeparableImage<Real = f64>>(image: &S, fraction: [f64; 2]) -> Vec<f64> {
        let [width, height] = image.size();
        let mut light = vec![0.0; width * height];
        let (mut across, mut down) = (vec![0.0; width], vec![0.0; height]);
        for term in 0..image.terms() {
            image.across(term, fraction[0], &mut across);
            image.down(term, fraction[1], &mut down);
            for (row, down) in light.chunks_exact_mut(width).zip(&down) {
                for (light, across) in row.iter_mut().zip(&across) {
                    *light += across * down;
                }
            }
        }
        light
    }

    #[test]
    fn an_image_is_the_light_of_its_chords() {
        let kernel = Exact::new(1.5);
        let slanted = DMat2::from_cols_array(&[1.7, 0.3, -0.2, 1.1]);
        for (shape, count) in [(DMat2::IDENTITY, 4), (DMat2::IDENTITY, 5), (slanted, 4)] {
            let chords = Chords::new(shape, count);
            let none = Spread::new(Shape::Point, 1.5, 1e-13);
            let image = ChordImage::new(&kernel, &chords, &none, 4.0);
            let [before_x, before_y] = image.before();
            let [width, _] = image.size();
            for (i, light) in light_of(&image, [0.3, 0.8]).into_iter().enumerate() {
                let x = (i % width) as f64 - before_x as f64 - 0.3;
                let y = (i / width) as f64 - before_y as f64 - 0.8;
                assert!((light - chords.light(&kernel, DVec2::new(x, y))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_spread_image_is_the_mean_of_images_moved() {
        let kernel = Exact::new(0.3);
        let outline = Outline::Ellipse(DMat2::from_diagonal(DVec2::new(1.3, 1.1)));
        let Some(chords) = Chords::within(&outline, 0.3, 1e-13) else {
            panic!("as blurred as it is, chords do");
        };
        for shape in [
            Shape::Disc([3.0, 3.0]),
            Shape::Disc([0.5, 1.7]),
            Shape::Gaussian([1.1, 0.0]),
            Shape::Gaussian([0.0, 0.2]),
        ] {
            let spread = Spread::new(shape, 0.3, 1e-13);
            let image = ChordImage::new(&kernel, &chords, &spread, 3.0 + spread.reach_px);
            let light = light_of(&image, [0.3, 0.8]);
            let [before, [width, height]] = [image.before(), image.size()];
            for (i, j) in [(0, 0), (2, 1), (4, 0), (3, 4), (1, 2)] {
                let (x, y) = (before[0] + i, before[1] + j);
                if x >= width || y >= height {
                    continue;
                }
                let at = DVec2::new(i as f64 - 0.3, j as f64 - 0.8);
                let moved = |&(place, weight): &(DVec2, f64)| weight * outline.light(0.3, at - place);
                let mean: f64 = spread.points.iter().map(moved).sum();
                let drawn = light[y * width + x];
                assert!((drawn - mean).abs() < 1e-11, "{shape:?} at {at}: {drawn} for {mean}");
            }
        }
    }
}
