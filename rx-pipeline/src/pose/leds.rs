//! The images of the panel's LEDs.

use link::panel::{LEDS, SIDE};

use super::disc::{Ellipse, Light, Patch};
use super::gauss::Gauss;
use super::pixels::Pixels;
use super::plane::{PLANE, PlaneImage};
use super::{PanelObservation, PoseError};

/// The least error of LED images, as a share of their light: discs are drawn to 0.002 (see the test in `disc`), no lamp is a uniform disc,
/// and neither error averages out over LEDs as noise does.
const UNEVEN: f64 = 0.003;

/// The images of all LEDs at light 1.
pub(super) struct Leds {
    patches: [Patch; LEDS],
    /// Derivatives of the positions of the LEDs' images along x and along y (px) by each of the plane's [units](PlaneImage::units).
    pub slopes: [[[f64; PLANE]; 2]; LEDS],
    /// The relative error of their images.
    pub uneven: f64,
    gauss: Gauss,
}

/// The pixels of a row that an LED lights.
pub(super) struct LedRun<'a> {
    pub led: usize,
    /// The first pixel.
    pub from: usize,
    pub light: &'a [Light],
}

impl Leds {
    pub const EMPTY: Self = Self {
        patches: [const { Patch::EMPTY }; LEDS],
        slopes: [[[0.0; PLANE]; 2]; LEDS],
        uneven: UNEVEN,
        gauss: Gauss::EMPTY,
    };

    /// Draws them at their positions on the plane, under a blur of `sigma` px.
    pub fn draw<const N: usize>(
        &mut self,
        plane: &PlaneImage,
        sigma: f64,
        pixels: &Pixels<N>,
        panel: &PanelObservation<'_>,
    ) -> Result<(), PoseError> {
        self.gauss.prepare();
        self.uneven = 0.0;
        // In half sides of the panel.
        let radius = panel.size.led_diameter_m / 2.0 / panel.size.half_side_m();
        let [width, height] = pixels.size.map(|length| length as f64);
        let unit = plane.units();
        for led in 0..LEDS {
            let half = (SIDE as f64 - 1.0) / 2.0;
            let place = [led % SIDE, led / SIDE].map(|line| line as f64 / half - 1.0);
            let ellipse = self::ellipse(place, radius, |place| pixels.seen_at(panel.lens.pixel(plane.direction(place))));
            let [x, y] = ellipse.centre;
            if !(x > -1.0 && y > -1.0 && x < width && y < height) {
                return Err(PoseError::OutsideFrame);
            }
            // A small disc's light distribution shows only in its variance, added to that of the blur.
            let resolved = ellipse.area() / (4.0 * core::f64::consts::PI * sigma * sigma);
            self.uneven = self.uneven.max(UNEVEN * resolved.min(1.0));
            self.patches[led].draw(&ellipse, sigma, &self.gauss);
            let along = panel.lens.slopes(plane.direction(place));
            let slopes = plane.slopes(place);
            for (axis, of_axis) in self.slopes[led].iter_mut().enumerate() {
                for (number, slope) in of_axis.iter_mut().enumerate() {
                    let [x, y] = slopes.map(|of_direction| of_direction[number]);
                    let moved = along[axis][0] * x + along[axis][1] * y;
                    *slope = moved * unit[number] / pixels.side as f64;
                }
            }
        }
        Ok(())
    }

    /// The LEDs that light pixels `from..to` of a row.
    pub fn on(&self, row: usize, from: usize, to: usize) -> impl Iterator<Item = LedRun<'_>> {
        self.patches.iter().enumerate().filter_map(move |(led, patch)| {
            let (first, light) = patch.row(row)?;
            let skipped = usize::try_from(from as i32 - first).unwrap_or(0);
            let from = usize::try_from(first).unwrap_or(0).max(from);
            let light = light.get(skipped..)?;
            let length = light.len().min(to.saturating_sub(from));
            (length > 0).then(|| LedRun {
                led,
                from,
                light: &light[..length],
            })
        })
    }
}

/// The image of a disc about a place of the panel.
fn ellipse(place: [f64; 2], radius: f64, seen: impl Fn([f64; 2]) -> [f64; 2]) -> Ellipse {
    let middle = seen(place);
    let mut centre = middle;
    let radii = [[radius, 0.0], [0.0, radius]].map(|[du, dv]| {
        let ahead = seen([place[0] + du, place[1] + dv]);
        let behind = seen([place[0] - du, place[1] - dv]);
        // In perspective the farther half looks smaller: the image of the middle is not the middle of the image.
        (0..2).for_each(|i| centre[i] += (ahead[i] + behind[i]) / 2.0 - middle[i]);
        [0, 1].map(|i| (ahead[i] - behind[i]) / 2.0)
    });
    Ellipse { centre, radii }
}
