//! The panel and its surroundings in linear light, in pixels that suit its size.

use link::camera::Camera;

use super::PoseError;
use crate::corners::Corners;
use crate::frame::Frame;

/// The greatest pitch in the frame's own pixels (px).
const FINE_PITCH_PX: f64 = 8.0;
/// The approximate pitch in larger pixels (px).
const COARSE_PITCH_PX: f64 = 6.0;
/// The greatest blur in the frame's own pixels (px).
const FINE_BLUR_PX: f64 = 2.0;
/// Room around the panel's outer LEDs, in pitches.
const RIM: f64 = 1.5;
/// The middle of the panel, in pitches.
const MIDDLE: f64 = 3.5;
/// Half the side of the panel's outer cells, in pitches.
const HALF: f64 = 4.0;
/// The grey level of a saturated pixel.
const WHITE: u8 = u8::MAX;
/// Steps of light, from none to white, in the table of the variance of rounding, which is nearly linear in between.
const ROUNDINGS: usize = 128;

/// Light of pixels, 1 at grey 118, each the mean of a square of the frame's.
pub(super) struct Pixels<const N: usize> {
    light: [f32; N],
    /// Whether it holds a saturated pixel of the frame.
    full: [bool; N],
    /// Its distance outside the panel's cells, in pitches; negative within.
    outside: [f32; N],
    /// Columns and rows.
    pub size: [usize; 2],
    /// The frame's first pixel.
    first: [usize; 2],
    /// The side of a pixel in pixels of the frame.
    pub side: usize,
    /// The light of the highest grey level.
    pub white: f64,
    /// The variance of rounding to grey levels, by steps of light.
    rounding: [f64; ROUNDINGS + 1],
}

impl<const N: usize> Pixels<N> {
    pub const EMPTY: Self = Self {
        light: [0.0; N],
        full: [false; N],
        outside: [0.0; N],
        size: [0; 2],
        first: [0; 2],
        side: 1,
        white: 0.0,
        rounding: [0.0; ROUNDINGS + 1],
    };

    /// Loads the pixels around a panel from a frame.
    pub fn take(&mut self, frame: &Frame<'_>, corners: &Corners, camera: &Camera) -> Result<(), PoseError> {
        let pitch = f64::from(corners.pitch_px());
        let pitch_side = if pitch > FINE_PITCH_PX {
            libm::round(pitch / COARSE_PITCH_PX)
        } else {
            1.0
        };
        let blur_side = libm::ceil(f64::from(camera.blur_sigma_px) / FINE_BLUR_PX);
        self.side = pitch_side.max(blur_side).max(1.0) as usize;
        let homography = corners.homography();
        let ends = [[-RIM, -RIM], [7.0 + RIM, -RIM], [7.0 + RIM, 7.0 + RIM], [-RIM, 7.0 + RIM]].map(|place| homography.to_image(place));
        for (axis, limit) in [frame.width(), frame.height()].into_iter().enumerate() {
            let low = ends.iter().fold(f64::INFINITY, |low, end| low.min(end[axis]));
            let high = ends.iter().fold(f64::NEG_INFINITY, |high, end| high.max(end[axis]));
            let first = libm::floor(low).max(0.0) as usize;
            let last = libm::ceil(high).max(0.0).min(limit as f64 - 1.0) as usize;
            self.first[axis] = first;
            self.size[axis] = (last + 1).saturating_sub(first) / self.side;
        }
        let [width, height] = self.size;
        if width == 0 || height == 0 {
            return Err(PoseError::OutsideFrame);
        }
        if width.saturating_mul(height) > N {
            return Err(PoseError::TooLarge {
                width,
                height,
                capacity: N,
            });
        }
        let mut table = [0.0f32; 256];
        for (grey, light) in table.iter_mut().enumerate() {
            *light = camera.light(grey as f32);
        }
        self.white = f64::from(table[usize::from(WHITE)]);
        for (step, variance) in self.rounding.iter_mut().enumerate() {
            let light = self.white * step as f64 / ROUNDINGS as f64;
            *variance = rounding_variance(camera, light) / (self.side * self.side) as f64;
        }
        let share = 1.0 / (self.side * self.side) as f32;
        for row in 0..height {
            for column in 0..width {
                let (mut light, mut full) = (0.0, false);
                for y in 0..self.side {
                    let line = frame.row(self.first[1] + row * self.side + y).unwrap_or_default();
                    let start = self.first[0] + column * self.side;
                    for &grey in line.get(start..start + self.side).unwrap_or_default() {
                        light += table[usize::from(grey)];
                        full |= grey == WHITE;
                    }
                }
                let place = row * width + column;
                let here = homography.to_panel(self.to_frame([column as f64, row as f64]));
                let outside = here.map(|line| (line - MIDDLE).abs() - HALF);
                self.light[place] = light * share;
                self.full[place] = full;
                self.outside[place] = outside[0].max(outside[1]) as f32;
            }
        }
        Ok(())
    }

    /// Light of a pixel, whether it holds a saturated pixel of the frame, and its distance outside the panel's cells, in pitches.
    pub fn at(&self, column: usize, row: usize) -> (f64, bool, f64) {
        let place = row * self.size[0] + column;
        (f64::from(self.light[place]), self.full[place], f64::from(self.outside[place]))
    }

    /// The ground's plane at a pixel: its middle, and its slopes across the window.
    pub fn ground(&self, column: usize, row: usize) -> [f64; 3] {
        let [width, height] = self.size.map(|length| length as f64);
        [1.0, 2.0 * column as f64 / width - 1.0, 2.0 * row as f64 / height - 1.0]
    }

    /// The variance of rounding to grey levels at that light.
    pub fn rounding_variance(&self, light: f64) -> f64 {
        let place = light.clamp(0.0, self.white) / self.white * ROUNDINGS as f64;
        let below = (place as usize).min(ROUNDINGS - 1);
        let part = place - below as f64;
        self.rounding[below] * (1.0 - part) + self.rounding[below + 1] * part
    }

    /// Converts a position from the frame to these pixels.
    pub fn seen_at(&self, position: [f64; 2]) -> [f64; 2] {
        let side = self.side as f64;
        core::array::from_fn(|axis| (position[axis] - self.first[axis] as f64 - (side - 1.0) / 2.0) / side)
    }

    /// Converts a position from these pixels to the frame.
    pub fn to_frame(&self, position: [f64; 2]) -> [f64; 2] {
        let side = self.side as f64;
        core::array::from_fn(|axis| position[axis] * side + self.first[axis] as f64 + (side - 1.0) / 2.0)
    }
}

/// The variance of light due to rounding to grey levels.
fn rounding_variance(camera: &Camera, light: f64) -> f64 {
    let grey = camera.grey(light as f32);
    let step = f64::from(camera.light(grey + 0.5) - camera.light((grey - 0.5).max(camera.black_grey)));
    step * step / 12.0
}
