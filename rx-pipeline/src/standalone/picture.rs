//! A small picture of the camera's view: the panel and its surroundings, or the whole frame with fewer pixels.

use crate::corners::Corners;
use crate::frame::Frame;

/// Pixels of a picture, at most: 81 × 61, a fourth of 324 × 244 along each side.
pub const PICTURE_PIXELS: usize = 81 * 61;
/// The longer side of a picture of a panel, in sides of the panel, at least.
const ROOM: f32 = 1.5;

/// A picture and its place in the frame.
pub struct Picture {
    pixels: [u8; PICTURE_PIXELS],
    /// The number of its frame.
    pub frame: u64,
    /// Columns and rows; 0 before the first frame.
    pub size: [u16; 2],
    /// The frame's position of its first pixel.
    pub origin: [u16; 2],
    /// Pixels of the frame per step between its pixels.
    pub step: u8,
}

impl Picture {
    pub const EMPTY: Self = Self {
        pixels: [0; PICTURE_PIXELS],
        frame: 0,
        size: [0; 2],
        origin: [0; 2],
        step: 1,
    };

    /// The part from `offset` on, up to `most` bytes.
    pub fn part(&self, offset: u32, most: usize) -> &[u8] {
        let [width, height] = self.size.map(usize::from);
        let end = width * height;
        let from = (offset as usize).min(end);
        self.pixels.get(from..(from + most).min(end)).unwrap_or_default()
    }

    /// Draws a frame, or the surroundings of the panel in it.
    pub fn draw(&mut self, number: u64, frame: &Frame<'_>, corners: Option<&Corners>) {
        let size = [frame.width(), frame.height()];
        let (origin, extent) = match corners {
            Some(corners) => around(corners, size),
            None => ([0, 0], size),
        };
        let step = (1..)
            .find(|step| extent[0].div_ceil(*step) * extent[1].div_ceil(*step) <= PICTURE_PIXELS)
            .unwrap_or(1);
        let mut pixels = self.pixels.iter_mut();
        for y in (origin[1]..origin[1] + extent[1]).step_by(step) {
            let row = frame.row(y).unwrap_or_default();
            let row = row.iter().skip(origin[0]).take(extent[0]).step_by(step);
            for (&grey, to) in row.zip(&mut pixels) {
                *to = grey;
            }
        }
        self.frame = number;
        self.origin = origin.map(|at| at as u16);
        self.size = extent.map(|pixels| pixels.div_ceil(step) as u16);
        self.step = step as u8;
    }
}

/// The part of a frame of that size around a panel: its start, and its size.
fn around(corners: &Corners, size: [usize; 2]) -> ([usize; 2], [usize; 2]) {
    let half = 0.5 * ROOM * 8.0 * corners.pitch_px();
    let centre = corners.centre_px();
    let bounds = [0, 1].map(|axis| {
        let from = ((centre[axis] - half).max(0.0) as usize).min(size[axis] - 1);
        let to = ((centre[axis] + half).max(0.0) as usize).clamp(from + 1, size[axis]);
        (from, to - from)
    });
    (bounds.map(|(from, _)| from), bounds.map(|(_, extent)| extent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_frame_is_thinned_out_and_a_panel_is_not() {
        let pixels: std::vec::Vec<u8> = (0..324 * 244).map(|i| (i % 324 / 2) as u8).collect();
        let frame = Frame::new(&pixels, 324, 244).unwrap();
        let mut picture = std::boxed::Box::new(Picture::EMPTY);
        assert!(picture.part(0, 512).is_empty());
        picture.draw(7, &frame, None);
        assert_eq!((picture.size, picture.step, picture.frame), ([81, 61], 4, 7));
        assert_eq!(picture.part(81 * 60, 512).len(), 81);
        assert_eq!(picture.part(81, 3), [0, 2, 4]);
        assert!(picture.part(u32::MAX, 512).is_empty());
        let corners = Corners::new([[100.0, 50.0], [121.0, 50.0], [121.0, 71.0], [100.0, 71.0]]).unwrap();
        picture.draw(8, &frame, Some(&corners));
        assert_eq!((picture.origin, picture.size, picture.step), ([92, 42], [36, 36], 1));
        assert_eq!(picture.part(0, 2), [46, 46]);
    }
}
