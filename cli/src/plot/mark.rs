//! Marks of points.

use plotters::prelude::{Circle, Color, PathElement, RGBColor, Rectangle};

use super::palette::WHITE;
use super::paper::Surface;

/// The mark of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// A filled dot.
    #[default]
    Dot,
    /// A hollow dot.
    Ring,
    /// A small translucent dot, for clouds.
    Speck,
    /// A down arrow: the value is an upper bound.
    AtMost,
    /// A box over the point's range, with a line at its value.
    Box,
    /// No mark: a line shows the point.
    None,
}

/// Half-width of a box.
const BOX_PX: i32 = 18;
/// Length of an arrow.
pub const ARROW_PX: i32 = 10;

impl Mark {
    /// Distance of the mark's edge from its point, with or without a ring.
    pub fn reach_px(self, is_ringed: bool) -> i32 {
        match self {
            _ if is_ringed => 9,
            Self::Box => BOX_PX,
            Self::Speck => 2,
            Self::None => 0,
            Self::Dot | Self::Ring | Self::AtMost => 4,
        }
    }

    /// Draws the mark at a pixel; `range` is a box's, from the lower to the upper pixel.
    pub fn draw(self, surface: &Surface, at: (i32, i32), range: [i32; 2], colour: RGBColor) -> anyhow::Result<()> {
        let (x, y) = at;
        match self {
            Self::None => {}
            Self::Dot => surface.draw(&Circle::new(at, 4, colour.filled()))?,
            Self::Speck => surface.draw(&Circle::new(at, 2, colour.mix(0.5).filled()))?,
            Self::Ring => {
                surface.draw(&Circle::new(at, 3, WHITE.filled()))?;
                surface.draw(&Circle::new(at, 3, colour.stroke_width(1)))?;
            }
            Self::AtMost => {
                let bar = vec![(x - 4, y), (x + 4, y)];
                surface.draw(&PathElement::new(bar, colour.stroke_width(2)))?;
                arrow(surface, at, colour)?;
            }
            Self::Box => {
                let ends = [(x - BOX_PX, range[1]), (x + BOX_PX, range[0])];
                surface.draw(&Rectangle::new(ends, colour.mix(0.35).filled()))?;
                surface.draw(&Rectangle::new(ends, colour.stroke_width(1)))?;
                let line = vec![(x - BOX_PX, y), (x + BOX_PX, y)];
                surface.draw(&PathElement::new(line, colour.stroke_width(3)))?;
            }
        }
        Ok(())
    }
}

/// Draws a down arrow from a pixel.
pub fn arrow(surface: &Surface, (x, y): (i32, i32), colour: RGBColor) -> anyhow::Result<()> {
    let tip = (x, y + ARROW_PX);
    let head = vec![(x - 3, tip.1 - 4), tip, (x + 3, tip.1 - 4)];
    for line in [vec![(x, y), tip], head] {
        surface.draw(&PathElement::new(line, colour.stroke_width(2)))?;
    }
    Ok(())
}

/// Draws the ring that highlights a point.
pub fn ring(surface: &Surface, at: (i32, i32), colour: RGBColor) -> anyhow::Result<()> {
    Ok(surface.draw(&Circle::new(at, 8, colour.stroke_width(2)))?)
}
