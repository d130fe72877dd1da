//! Charts and rows of pictures: commands provide the data, this module the appearance.
//!
//! A [`Page`] holds [`Chart`]s, a chart two [`Axis`]es and [`Series`] of [`Point`]s. A legend is placed where it covers least, a point's
//! name if there is space. A page is drawn once, and [`save`] writes it as SVG and as PNG.

mod axis;
mod chart;
mod labels;
mod legend;
mod mark;
mod page;
mod palette;
mod paper;
mod pictures;
mod raster;
mod series;
mod sheet;

pub use axis::{Axis, short};
pub use chart::Chart;
pub use legend::Entry;
pub use mark::Mark;
pub use page::Page;
pub use palette::{EDGE, FRONT, OFF, ON, RGBColor, colours};
pub use paper::{Drawing, files_of, save, stem};
pub use pictures::{Picture, row};
pub use series::{Line, Point, Series};

/// A rectangle in pixels: left, top, right, bottom.
type Box = [i32; 4];

/// Whether two rectangles overlap.
fn meet(one: Box, other: Box) -> bool {
    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
}
