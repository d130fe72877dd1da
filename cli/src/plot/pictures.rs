//! Rows of grey pictures with captions.

use plotters::prelude::{Color, RGBColor, Rectangle};

use super::palette::BLACK;
use super::paper::{self, Anchor, Drawing, Surface, words};

/// A grey picture.
pub struct Picture<'a> {
    /// Its pixels, row by row.
    pub grey: &'a [u8],
    /// Pixels in a row.
    pub width: usize,
    /// The caption's lines.
    pub words: Vec<String>,
}

const GAP_PX: i32 = 16;
const LINE_PX: i32 = 20;
const TEXT_PX: i32 = 15;

/// Draws pictures of equal width side by side, as an SVG document.
pub fn row(pictures: &[Picture], width_px: i32) -> anyhow::Result<Drawing> {
    let height_px = |picture: &Picture| picture.edge(picture.rows(), width_px);
    let tallest_px = pictures.iter().map(height_px).max().unwrap_or(0);
    let lines = pictures.iter().map(|picture| picture.words.len()).max();
    let size = (
        pictures.len() as i32 * (width_px + GAP_PX) + GAP_PX,
        tallest_px + 2 * GAP_PX + lines.unwrap_or(0) as i32 * LINE_PX,
    );
    paper::draw((size.0 as u32, size.1 as u32), |surface| {
        for (k, picture) in (0..).zip(pictures) {
            let (left, top) = (GAP_PX + k * (width_px + GAP_PX), GAP_PX);
            picture.draw(surface, (left, top), width_px)?;
            for (line, text) in (0..).zip(&picture.words) {
                let place = (left + width_px / 2, top + tallest_px + 6 + line * LINE_PX);
                words(surface, text, place, TEXT_PX, Anchor::Below)?;
            }
        }
        Ok(())
    })
}

impl Picture<'_> {
    fn rows(&self) -> usize {
        self.grey.len() / self.width.max(1)
    }

    /// Start of column or row `k`: a whole pixel, so that no seams show.
    fn edge(&self, k: usize, width_px: i32) -> i32 {
        (k as f64 * f64::from(width_px) / self.width.max(1) as f64).round() as i32
    }

    /// Draws the picture, merging equal neighbours in a row.
    fn draw(&self, surface: &Surface, (left, top): (i32, i32), width_px: i32) -> anyhow::Result<()> {
        let at = |x: usize, y: usize| (left + self.edge(x, width_px), top + self.edge(y, width_px));
        for (y, row) in self.grey.chunks_exact(self.width.max(1)).enumerate() {
            let mut x = 0;
            for run in row.chunk_by(|a, b| a == b) {
                let corners = [at(x, y), at(x + run.len(), y + 1)];
                let grey = RGBColor(run[0], run[0], run[0]);
                surface.draw(&Rectangle::new(corners, grey.filled()))?;
                x += run.len();
            }
        }
        // White pictures need a frame on white paper.
        let corners = [at(0, 0), at(self.width, self.rows())];
        Ok(surface.draw(&Rectangle::new(corners, BLACK.mix(0.4).stroke_width(1)))?)
    }
}
