//! The colours of all charts.

pub use plotters::style::RGBColor;
pub use plotters::style::colors::{BLACK, WHITE};

/// Colours of series. The first seven can be told apart by colour-blind readers too (Okabe & Ito 2008).
pub const COLOURS: [RGBColor; 10] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(60, 60, 60),
    RGBColor(140, 86, 75),
    RGBColor(120, 130, 0),
    RGBColor(110, 60, 180),
];
/// On LEDs.
pub const ON: RGBColor = COLOURS[1];
/// Off LEDs.
pub const OFF: RGBColor = COLOURS[0];
/// A front, behind the points on it.
pub const FRONT: RGBColor = RGBColor(205, 205, 205);
/// Lines across a chart at its ticks.
pub const GRID: RGBColor = RGBColor(232, 232, 232);
/// A chart's edge.
pub const EDGE: RGBColor = RGBColor(90, 90, 90);
