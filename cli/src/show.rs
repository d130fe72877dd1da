//! Draws readings: the panel enlarged, with its outline, its cells, and each LED's bit.

use std::path::{Path, PathBuf};

use ab_glyph::{Font, FontRef, PxScale, ScaleFont};
use image::{ExtendedColorType, Rgb, RgbImage};
use link::panel::{LEDS, SIDE};
use reception::panel_pose::PanelPose;
use rx_pipeline::corners::Homography;
use rx_pipeline::frame::Frame;
use rx_pipeline::receiver::FrameReading;

use crate::pictures::write_encoded;
use crate::pose::with_sigma;

/// Approximate side of the enlarged panel in pixels.
const SIDE_PX: f64 = 640.0;
/// Margin around the panel, in pitches.
const RIM: f64 = 1.5;
/// Soft values from here on have full colour.
const SURE: f32 = 60.0;
const OUTLINE: Rgb<u8> = Rgb([255, 200, 0]);
const CELLS: Rgb<u8> = Rgb([90, 90, 160]);
const ON: [f32; 3] = [40.0, 255.0, 40.0];
const OFF: [f32; 3] = [255.0, 60.0, 60.0];

/// Colours of the panel's axes: along its rows, down its columns, into it.
const AXES: [Rgb<u8>; 3] = [Rgb([255, 0, 200]), Rgb([0, 220, 255]), Rgb([255, 255, 255])];
/// Font size of text (px).
const WORDS_PX: f32 = 22.0;
/// Margin of text (px).
const MARGIN_PX: i64 = 8;
/// Length of the arrow per m/s (px).
const SPEED_PX: f64 = 6.0;
/// Maximum length of the arrow (px).
const LONGEST_PX: f64 = 240.0;

/// The name of the drawing of a panel in a film's frame.
pub fn in_frame(number: u64, panel: usize) -> PathBuf {
    format!("frame-{number:06}-panel-{panel}.png").into()
}

/// The name of the drawing of the panel in a picture.
pub fn in_picture(picture: &Path) -> PathBuf {
    let mut name = picture.file_stem().unwrap_or_default().to_os_string();
    name.push("-panel.png");
    name.into()
}

/// Draws a reading: cells in blue, the outline in yellow, and on each LED a mark, green for On and red for Off, brighter if more reliable.
/// If the pose is known: the panel's axes from its centre (rows, columns, and into it), its range as text, and at the left an arrow, which
/// points down if the panel approaches.
pub fn reading(path: &Path, frame: &Frame, reading: &FrameReading, panel_pose: &PanelPose) -> anyhow::Result<()> {
    let homography = reading.corners.homography();
    let far = (SIDE - 1) as f64 + RIM;
    let ends = [[-RIM, -RIM], [far, -RIM], [far, far], [-RIM, far]].map(|corner| homography.to_image(corner));
    let end = |axis: usize, limit: usize| {
        let low = ends.iter().fold(f64::INFINITY, |low, e| low.min(e[axis])).floor().max(0.0) as usize;
        let high = ends
            .iter()
            .fold(0.0, |high: f64, e| high.max(e[axis]))
            .ceil()
            .min(limit as f64 - 1.0) as usize;
        (low.min(high), high - low.min(high) + 1)
    };
    let ((x, width), (y, height)) = (end(0, frame.width()), end(1, frame.height()));
    let scale = (SIDE_PX / width.max(height) as f64).round().clamp(1.0, 24.0) as usize;
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
        let colour = if line == 0 || line == SIDE { OUTLINE } else { CELLS };
        canvas.line(&homography, [at, -0.5], [at, end], colour);
        canvas.line(&homography, [-0.5, at], [end, at], colour);
    }
    for led in 0..LEDS {
        let soft = reading.detection.soft.0[led];
        let full = if reading.detection.bits.led(led) { ON } else { OFF };
        let sure = 0.35 + 0.65 * (f32::from(soft).abs() / SURE).min(1.0);
        let colour = Rgb(full.map(|c| (c * sure) as u8));
        canvas.mark(homography.to_image([(led % SIDE) as f64, (led / SIDE) as f64]), colour);
    }
    canvas.pose(panel_pose);
    let size = [canvas.picture.width(), canvas.picture.height()];
    write_encoded(path, &canvas.picture, size, ExtendedColorType::Rgb8)
}

/// Limit of coordinates, so that arithmetic on lines to them cannot overflow.
const FARTHEST_PX: f64 = 1e6;

struct Canvas {
    picture: RgbImage,
    origin: [usize; 2],
    scale: usize,
}

impl Canvas {
    /// The canvas position of a frame position; a pixel's centre maps to the middle of its square.
    fn place(&self, at: [f64; 2]) -> [i64; 2] {
        std::array::from_fn(|axis| {
            let place = (at[axis] + 0.5 - self.origin[axis] as f64) * self.scale as f64;
            place.clamp(-FARTHEST_PX, FARTHEST_PX) as i64
        })
    }

    fn set(&mut self, [x, y]: [i64; 2], colour: Rgb<u8>) {
        let inside = u32::try_from(x).ok().zip(u32::try_from(y).ok());
        if let Some(pixel) = inside.and_then(|(x, y)| self.picture.get_pixel_mut_checked(x, y)) {
            *pixel = colour;
        }
    }

    fn line(&mut self, homography: &Homography, from: [f64; 2], to: [f64; 2], colour: Rgb<u8>) {
        let [from, to] = [from, to].map(|at| self.place(homography.to_image(at)));
        self.stroke(from, to, colour, 0);
    }

    /// Draws a straight line with a half-width in pixels.
    fn stroke(&mut self, from: [i64; 2], to: [i64; 2], colour: Rgb<u8>, half: i64) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // Lines are as long as the canvas, except those to distant ends.
        let steps = dx.abs().max(dy.abs()).clamp(1, 4 * SIDE_PX as i64);
        for step in 0..=steps {
            let [x, y] = [from[0] + dx * step / steps, from[1] + dy * step / steps];
            for (i, j) in (-half..=half).flat_map(|i| (-half..=half).map(move |j| (i, j))) {
                self.set([x + i, y + j], colour);
            }
        }
    }

    fn pose(&mut self, panel_pose: &PanelPose) {
        let (Some(pose), Some([middle, ends @ ..])) = (panel_pose.pose(), panel_pose.axes_px()) else {
            return;
        };
        for (end, colour) in ends.into_iter().zip(AXES) {
            self.stroke(self.place(middle), self.place(end), colour, 1);
        }
        let mut words = format!("{} m", with_sigma(pose.numbers().range_m));
        if let Some(speed) = panel_pose.speed_m_s() {
            words += &format!(", nearer by {} m/s", with_sigma(speed));
            let long = (SPEED_PX * speed.value).clamp(-LONGEST_PX, LONGEST_PX) as i64;
            let from = [3 * MARGIN_PX, i64::from(self.picture.height()) / 2];
            let tip = [from[0], from[1] + long];
            self.stroke(from, tip, OUTLINE, 1);
            for side in [-MARGIN_PX, MARGIN_PX] {
                self.stroke(tip, [tip[0] + side, tip[1] - MARGIN_PX * long.signum()], OUTLINE, 1);
            }
        }
        self.words(&words);
    }

    /// Draws text into the upper left corner.
    fn words(&mut self, words: &str) {
        let Ok(font) = FontRef::try_from_slice(dejavu::sans::regular()) else {
            return;
        };
        let font = font.as_scaled(PxScale::from(WORDS_PX));
        let (mut x, base) = (MARGIN_PX as f32, MARGIN_PX as f32 + font.ascent());
        for letter in words.chars() {
            let id = font.glyph_id(letter);
            let glyph = id.with_scale_and_position(WORDS_PX, ab_glyph::point(x, base));
            x += font.h_advance(id);
            let Some(outline) = font.outline_glyph(glyph) else {
                continue;
            };
            let corner = outline.px_bounds().min;
            outline.draw(|column, row, share| {
                if share > 0.4 {
                    let at = [corner.x + column as f32, corner.y + row as f32];
                    self.set(at.map(|c| c as i64), OUTLINE);
                }
            });
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
