//! What the receiver sees, as pictures: the panel's surroundings enlarged, its outline, its cells, and each LED's bit.

use std::path::Path;

use image::{ExtendedColorType, Rgb, RgbImage};
use link::panel::{LEDS, SIDE};
use rx_pipeline::corners::Homography;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::Reading;

use crate::pictures::write_encoded;

/// The enlarged panel's side, about, in pixels.
const SIDE_PX: f64 = 640.0;
/// Room around the panel, in pitches.
const RIM: f64 = 1.5;
/// Soft values from here on are drawn in full colour.
const SURE: f32 = 60.0;
const OUTLINE: Rgb<u8> = Rgb([255, 200, 0]);
const CELLS: Rgb<u8> = Rgb([90, 90, 160]);
const ON: [f32; 3] = [40.0, 255.0, 40.0];
const OFF: [f32; 3] = [255.0, 60.0, 60.0];

/// Draws a reading: cells in blue, the outline in yellow, and on each LED a mark that is green for On and red for Off,
/// the brighter the surer.
pub fn reading(path: &Path, frame: &Frame, reading: &Reading) -> anyhow::Result<()> {
    let homography = reading.corners.homography();
    let far = (SIDE - 1) as f64 + RIM;
    let ends = [[-RIM, -RIM], [far, -RIM], [far, far], [-RIM, far]]
        .map(|corner| homography.to_image(corner));
    let end = |axis: usize, limit: usize| {
        let low = ends
            .iter()
            .fold(f64::INFINITY, |low, e| low.min(e[axis]))
            .floor()
            .max(0.0) as usize;
        let high = ends
            .iter()
            .fold(0.0, |high: f64, e| high.max(e[axis]))
            .ceil()
            .min(limit as f64 - 1.0) as usize;
        (low.min(high), high - low.min(high) + 1)
    };
    let ((x, width), (y, height)) = (end(0, frame.width()), end(1, frame.height()));
    let scale = (SIDE_PX / width.max(height) as f64)
        .round()
        .clamp(1.0, 24.0) as usize;
    let mut canvas = Canvas {
        picture: RgbImage::new((width * scale) as u32, (height * scale) as u32),
        origin: [x, y],
        scale,
    };
    for (column, row, pixel) in canvas.picture.enumerate_pixels_mut() {
        let (column, row) = (x + column as usize / scale, y + row as usize / scale);
        let grey = frame.pixel(column, row).unwrap_or_default();
        *pixel = Rgb([grey; 3]);
    }
    for line in 0..=SIDE {
        let (at, end) = (line as f64 - 0.5, SIDE as f64 - 0.5);
        let colour = if line == 0 || line == SIDE {
            OUTLINE
        } else {
            CELLS
        };
        canvas.line(&homography, [at, -0.5], [at, end], colour);
        canvas.line(&homography, [-0.5, at], [end, at], colour);
    }
    for led in 0..LEDS {
        let soft = reading.detection.soft.0[led];
        let full = if reading.detection.bits.led(led) {
            ON
        } else {
            OFF
        };
        let sure = 0.35 + 0.65 * (f32::from(soft).abs() / SURE).min(1.0);
        let colour = Rgb(full.map(|c| (c * sure) as u8));
        canvas.mark(
            homography.to_image([(led % SIDE) as f64, (led / SIDE) as f64]),
            colour,
        );
    }
    let size = [canvas.picture.width(), canvas.picture.height()];
    write_encoded(path, &canvas.picture, size, ExtendedColorType::Rgb8)
}

struct Canvas {
    picture: RgbImage,
    origin: [usize; 2],
    scale: usize,
}

impl Canvas {
    /// The place of a position of the frame, where a pixel's centre is in the middle of its square.
    fn place(&self, at: [f64; 2]) -> [i64; 2] {
        std::array::from_fn(|axis| {
            ((at[axis] + 0.5 - self.origin[axis] as f64) * self.scale as f64) as i64
        })
    }

    fn set(&mut self, [x, y]: [i64; 2], colour: Rgb<u8>) {
        let inside = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        if let Some(pixel) = inside.and_then(|(x, y)| self.picture.get_pixel_mut_checked(x, y)) {
            *pixel = colour;
        }
    }

    fn line(&mut self, homography: &Homography, from: [f64; 2], to: [f64; 2], colour: Rgb<u8>) {
        let steps = 2 * self.picture.width().max(self.picture.height());
        for step in 0..=steps {
            let part = f64::from(step) / f64::from(steps);
            let at = std::array::from_fn(|axis| from[axis] + part * (to[axis] - from[axis]));
            self.set(self.place(homography.to_image(at)), colour);
        }
    }

    fn mark(&mut self, at: [f64; 2], colour: Rgb<u8>) {
        let [x, y] = self.place(at);
        let reach = (self.scale as i64 / 2).max(2);
        for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
            if dx * dx + dy * dy <= reach * reach {
                self.set([x + dx, y + dy], colour);
            }
        }
    }
}
