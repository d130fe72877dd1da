//! Shared plotting code of the examples.

use std::error::Error;

use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

/// The font of all text.
pub const FONT: &str = "DejaVu Sans";

/// A drawing surface for an SVG document.
pub type Surface<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// A chart with two axes.
pub type Chart<'a, X, Y> = ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>;

/// Draws an SVG document.
pub fn svg(size: (u32, u32), draw: impl FnOnce(&Surface) -> Result<(), Box<dyn Error>>) -> Result<String, Box<dyn Error>> {
    register_font(FONT, FontStyle::Normal, dejavu::sans::regular()).map_err(|_| "a damaged font")?;
    let mut document = String::new();
    {
        let surface = SVGBackend::with_string(&mut document, size).into_drawing_area();
        surface.fill(&WHITE)?;
        draw(&surface)?;
        surface.present()?;
    }
    Ok(document)
}

/// A chart with a title and space for axis labels.
pub fn titled<'a, 'b>(surface: &'a Surface<'b>, title: &str) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut chart = ChartBuilder::on(surface);
    chart
        .caption(title, (FONT, 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64);
    chart
}

/// The legend sample of a series of this colour.
pub fn key(colour: RGBColor) -> impl Fn((i32, i32)) -> PathElement<(i32, i32)> {
    move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(3))
}

/// Draws the legend of the drawn series.
pub fn legend<X: Ranged, Y: Ranged>(chart: &mut Chart<'_, X, Y>, place: SeriesLabelPosition) -> Result<(), Box<dyn Error>> {
    chart
        .configure_series_labels()
        .position(place)
        .background_style(WHITE)
        .border_style(BLACK)
        .label_font((FONT, 13))
        .draw()?;
    Ok(())
}
