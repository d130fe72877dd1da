//! A sheet that draws each shape twice: as SVG and in pixels.

use std::io::Error;

use plotters::prelude::SVGBackend;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind};

use super::raster::Raster;

/// A drawing backend for plots.
pub struct Sheet<'a> {
    svg: SVGBackend<'a>,
    raster: &'a mut Raster<'static>,
}

impl<'a> Sheet<'a> {
    /// A sheet of this width and height in pixels.
    pub fn new(svg: &'a mut String, raster: &'a mut Raster<'static>, size_px: (u32, u32)) -> Self {
        Self {
            svg: SVGBackend::with_string(svg, size_px),
            raster,
        }
    }
}

type DrawResult = Result<(), DrawingErrorKind<Error>>;

impl DrawingBackend for Sheet<'_> {
    type ErrorType = Error;

    fn get_size(&self) -> (u32, u32) {
        self.svg.get_size()
    }

    fn ensure_prepared(&mut self) -> DrawResult {
        self.svg.ensure_prepared()
    }

    fn present(&mut self) -> DrawResult {
        self.svg.present()
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> DrawResult {
        self.raster.pixel(at, colour);
        self.svg.draw_pixel(at, colour)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> DrawResult {
        self.raster.path(&[from, to], style);
        self.svg.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, upper_left: BackendCoord, bottom_right: BackendCoord, style: &S, fill: bool) -> DrawResult {
        self.raster.rectangle(upper_left, bottom_right, style, fill);
        self.svg.draw_rect(upper_left, bottom_right, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> DrawResult {
        let path: Vec<BackendCoord> = path.into_iter().collect();
        self.raster.path(&path, style);
        self.svg.draw_path(path, style)
    }

    fn draw_circle<S: BackendStyle>(&mut self, centre: BackendCoord, radius: u32, style: &S, fill: bool) -> DrawResult {
        self.raster.circle(centre, radius, style, fill);
        self.svg.draw_circle(centre, radius, style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, corners: I, style: &S) -> DrawResult {
        let corners: Vec<BackendCoord> = corners.into_iter().collect();
        self.raster.polygon(&corners, style.color());
        self.svg.fill_polygon(corners, style)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> DrawResult {
        self.raster.text(text, style, at);
        self.svg.draw_text(text, style, at)
    }
}
