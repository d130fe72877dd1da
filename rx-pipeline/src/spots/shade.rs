//! The uneven light of a board: shadows across it, measured between the LEDs.

use super::window::Window;
use crate::frame::bilinear;
use crate::lattice::Lattice;
use core::ops::Range;
use link::panel::{LEDS, SIDE};

/// Whether shadows are taken into account. On microcontrollers this would cost flash and time.
pub(crate) const MEASURES_SHADE: bool = cfg!(feature = "surroundings");
/// The least pitch at which the ground is visible between spots (standard deviations of a spot): in the middle of four On LEDs, and beyond
/// the outer ones, at most 0.2 of one remains. Lower: the LEDs' own light counts as shade; higher: shadows on blurred panels stay.
pub(crate) const SHADE_LEAST_PITCH: f32 = 3.6;
/// The light between LEDs is uneven if it differs from place to place by more (standard deviation, share of the step from Off to On).
/// Lower: each LED is read with the noise of the ground around it; higher: faint shadows stay.
const UNEVEN: f32 = 0.04;
/// Places between LEDs along a side: between neighbours, and one beyond either outer LED.
const PLACES: usize = SIDE + 1;
/// The distance of the outer places from the outer LEDs (pitches). Farther: light beyond the board counts as its shade.
const OUTER: f32 = 0.35;
/// The least variance from place to place (multiple of that of noise and of the LEDs' own light, which differs from one side of a place to
/// the other). Lower: these count as shade; higher: faint shadows stay.
const SIGNIFICANT: f32 = 2.0;
/// The distance of the pixels that are averaged from a place (pitches). Longer: LEDs count as shade; shorter: noise does.
const REACH: f32 = 0.12;

/// The light of a board between the LEDs, bilinear from place to place.
pub(crate) struct Shade {
    lattice: Lattice,
    /// Light by rows and columns of places.
    light: [[f32; PLACES]; PLACES],
    /// The variance by noise and texture, from the light left and right of places.
    noise: f32,
}

impl Shade {
    /// The light between the LEDs of a lattice if it is uneven, given the light at any position and whether it is white.
    pub fn uneven_on(lattice: &Lattice, light_at: impl Fn([f32; 2]) -> Option<(f32, bool)>) -> Option<Self> {
        let below_white = |at| light_at(at).filter(|(_, is_white)| !is_white).map(|(light, _)| light);
        let shade = Self::of(lattice, below_white)?;
        let contrast = shade.contrast(|at| light_at(at).map(|(light, _)| light));
        shade.is_uneven(contrast).then_some(shade)
    }

    /// The light between the LEDs of a lattice, given the light at any position; `None` if there is none at some place.
    fn of(lattice: &Lattice, light_at: impl Fn([f32; 2]) -> Option<f32>) -> Option<Self> {
        let (mut steps, mut pairs) = (0.0, 0.0f32);
        let mut around = |column: f32, row: f32| {
            let points = [[REACH, 0.0], [-REACH, 0.0], [0.0, 0.0], [0.0, REACH], [0.0, -REACH]];
            let lights = points.map(|[u, v]| light_at(lattice.position(column + u, row + v)));
            if let [Some(right), Some(left), ..] = lights {
                (steps, pairs) = (steps + (right - left) * (right - left), pairs + 1.0);
            }
            let (sum, count) = lights
                .iter()
                .flatten()
                .fold((0.0, 0.0f32), |(sum, count), light| (sum + light, count + 1.0));
            (count > 0.0).then_some(sum / count)
        };
        let mut light = [[0.0; PLACES]; PLACES];
        for (row, line) in light.iter_mut().enumerate() {
            for (column, light) in line.iter_mut().enumerate() {
                *light = around(coordinate(column), coordinate(row))?;
            }
        }
        Some(Self {
            lattice: *lattice,
            light,
            noise: 0.5 * steps / pairs.max(1.0),
        })
    }

    /// The same light on a lattice in other pixels.
    #[cfg(all(feature = "maximum-likelihood", feature = "surroundings"))]
    pub fn on(self, lattice: Lattice) -> Self {
        Self { lattice, ..self }
    }

    /// Writes the light of a row of the frame, in the columns of `span`, counted from the window's first one, and adds it to the `model`.
    pub fn add_row(&self, window: Window, y: usize, span: Range<usize>, model: &mut [f32], light: &mut [f32]) {
        for ((x, light), model) in span.zip(light).zip(model) {
            *light = self.at([(window.x + x) as f32, y as f32]);
            *model += *light;
        }
    }

    /// The mean light.
    pub fn mean(&self) -> f32 {
        self.light.iter().flatten().sum::<f32>() / (PLACES * PLACES) as f32
    }

    /// The variance of the light from place to place.
    fn variance(&self) -> f32 {
        let mean = self.mean();
        let squares = self.light.iter().flatten().map(|light| (light - mean) * (light - mean));
        squares.sum::<f32>() / (PLACES * PLACES) as f32
    }

    /// The step from Off to On, if half of the LEDs are On: twice the standard deviation of the LEDs' light above the shade.
    fn contrast(&self, light_at: impl Fn([f32; 2]) -> Option<f32>) -> f32 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for led in 0..LEDS {
            let at = self.lattice.position((led % SIDE) as f32, (led / SIDE) as f32);
            let above = light_at(at).unwrap_or_default() - self.at(at);
            sum += above;
            squares += above * above;
        }
        let mean = sum / LEDS as f32;
        2.0 * libm::sqrtf((squares / LEDS as f32 - mean * mean).max(0.0))
    }

    /// Whether the light differs so much from place to place that it matters for LEDs of that step from Off to On.
    fn is_uneven(&self, contrast: f32) -> bool {
        self.variance() > (UNEVEN * contrast * UNEVEN * contrast).max(SIGNIFICANT * self.noise)
    }

    /// The light at a position.
    pub fn at(&self, position: [f32; 2]) -> f32 {
        let place = self.lattice.coordinates(position).unwrap_or_default();
        let [(column, u), (row, v)] = place.map(|c| {
            let c = (c + 0.5).clamp(0.0, SIDE as f32);
            let first = (c as usize).min(PLACES - 2);
            (first, c - first as f32)
        });
        let [above, below] = [&self.light[row], &self.light[row + 1]];
        bilinear([above[column], above[column + 1], below[column], below[column + 1]], [u, v])
    }
}

/// The column or row of a place.
fn coordinate(place: usize) -> f32 {
    (place as f32 - 0.5).clamp(-OUTER, (SIDE - 1) as f32 + OUTER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_changes_evenly_is_found_at_any_position() {
        let lattice = Lattice::turned([60.0, 50.0], 7.0, 6.0, 0.2);
        let slope = |[x, y]: [f32; 2]| Some(1.0 + 0.02 * x - 0.01 * y);
        let shade = Shade::of(&lattice, slope).unwrap();
        for [column, row] in [[0.0, 0.0], [3.2, 4.9], [6.6, 0.3]] {
            let at = lattice.position(column, row);
            // The outer places count as half a pitch from the outer LEDs, and are a little nearer.
            approx::assert_abs_diff_eq!(shade.at(at), slope(at).unwrap(), epsilon = 0.03);
        }
        assert!(shade.is_uneven(2.0));
        assert!(!Shade::of(&lattice, |_| Some(0.4)).unwrap().is_uneven(2.0));
    }

    #[test]
    fn a_lattice_beyond_the_frame_has_no_shade() {
        let lattice = Lattice::turned([10.0, 50.0], 7.0, 6.0, 0.0);
        assert!(Shade::of(&lattice, |[x, _]| (x >= 0.0).then_some(1.0)).is_none());
    }
}
