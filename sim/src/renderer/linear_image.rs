//! A linear image in the precision of its renderer's level.

use super::canvas::{Canvas, Region};
use super::{PanelExposure, Renderer};
use crate::accuracy::Level;

/// The linear values of a region.
#[derive(Clone, Debug)]
pub enum LinearImage {
    /// In single precision.
    Single(Canvas<f32>),
    /// In double precision, for [`Level::Reference`].
    Double(Canvas<f64>),
}

impl LinearImage {
    /// Its values, row by row.
    pub fn values(&self) -> Vec<f64> {
        match self {
            Self::Single(canvas) => canvas.values().iter().map(|&linear| linear.into()).collect(),
            Self::Double(canvas) => canvas.values().to_vec(),
        }
    }
}

impl Renderer {
    /// A linear image of a region, for drawing at this renderer's level.
    pub fn linear_image(&self, region: Region) -> LinearImage {
        match self.level {
            Level::Reference => LinearImage::Double(Canvas::new(region)),
            Level::Fine | Level::Fast => LinearImage::Single(Canvas::new(region)),
        }
    }

    /// Draws frame `frame` of run `seed` as [`draw`](Self::draw) or [`draw_exact`](Self::draw_exact) does.
    pub fn draw_frame(&self, seed: u64, frame: u64, shown: &[PanelExposure], image: &mut LinearImage) {
        let moment = self.moment(seed, frame);
        match image {
            LinearImage::Single(canvas) => self.draw(&moment, shown, canvas),
            LinearImage::Double(canvas) => self.draw_exact(&moment, shown, canvas),
        }
    }

    /// Reads a frame out as [`read_out`](Self::read_out) or [`read_out_exact`](Self::read_out_exact) does.
    pub fn read_frame(&self, seed: u64, frame: u64, image: &LinearImage, grey: &mut [u8]) {
        match image {
            LinearImage::Single(canvas) => self.read_out(seed, frame, canvas, grey),
            LinearImage::Double(canvas) => self.read_out_exact(seed, frame, canvas, grey),
        }
    }
}
