//! What a chart shows: series of points, and what connects them.

use plotters::prelude::RGBColor;

use super::mark::Mark;

/// Points that belong together.
pub struct Series {
    /// Its name in the legend; empty for one that is not in it.
    pub name: String,
    pub colour: RGBColor,
    pub line: Line,
    pub points: Vec<Point>,
}

impl Series {
    pub fn new(name: impl Into<String>, colour: RGBColor, line: Line, points: Vec<Point>) -> Self {
        let name = name.into();
        Self {
            name,
            colour,
            line,
            points,
        }
    }
}

/// What connects the points of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    None,
    /// A thin line; points have bars over their ranges.
    Thin,
    /// A line, and a band over the vertical ranges; a point alone has a bar.
    Band,
    /// Wide steps without marks, down at each point.
    Steps,
}

/// A point of a series.
#[derive(Clone, Debug, Default)]
pub struct Point {
    pub x: f64,
    pub y: f64,
    /// Where it may lie as well.
    pub x_range: Option<[f64; 2]>,
    pub y_range: Option<[f64; 2]>,
    pub mark: Mark,
    /// Whether a ring sets it apart.
    pub is_ringed: bool,
    /// What is written beside it, where there is room.
    pub name: Option<String>,
}

impl Point {
    /// A value with the range that it may lie in.
    pub fn within(x: f64, y: f64, y_range: [f64; 2]) -> Self {
        let y_range = Some(y_range);
        Self {
            x,
            y,
            y_range,
            ..Self::default()
        }
    }

    /// An error rate with its interval; where none of the errors was met, all that is known is that it is at most the interval's end.
    pub fn rate(x: f64, rate: f64, [low, high]: [f64; 2], errors: u64) -> Self {
        let (y, mark) = match errors {
            0 => (high, Mark::AtMost),
            _ => (rate, Mark::Dot),
        };
        Self {
            mark,
            ..Self::within(x, y, [low, high])
        }
    }
}

impl Line {
    /// How wide it is.
    pub fn width_px(self) -> Option<u32> {
        match self {
            Self::None => None,
            Self::Thin => Some(1),
            Self::Band => Some(2),
            Self::Steps => Some(6),
        }
    }
}
