//! Series of points, and the lines between them.

use plotters::prelude::RGBColor;

use super::mark::Mark;

/// A series of points.
pub struct Series {
    /// The legend entry; empty for a series without one.
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

    /// A thin straight line without marks.
    pub fn straight(name: impl Into<String>, colour: RGBColor, ends: [[f64; 2]; 2]) -> Self {
        let end = |[x, y]: [f64; 2]| Point {
            x,
            y,
            mark: Mark::None,
            ..Point::default()
        };
        Self::new(name, colour, Line::Thin, ends.map(end).into())
    }
}

/// The line through a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    None,
    /// A thin line; points have range bars.
    Thin,
    /// A line with a band over the vertical ranges; a lone point has a bar.
    Band,
    /// Wide steps without marks, down at each point.
    Steps,
}

/// A point of a series.
#[derive(Clone, Debug, Default)]
pub struct Point {
    pub x: f64,
    pub y: f64,
    /// The horizontal uncertainty range.
    pub x_range: Option<[f64; 2]>,
    pub y_range: Option<[f64; 2]>,
    pub mark: Mark,
    /// Whether a ring highlights it.
    pub is_ringed: bool,
    /// The label, if space permits.
    pub name: Option<String>,
}

impl Point {
    /// A value with its uncertainty range.
    pub fn within(x: f64, y: f64, y_range: [f64; 2]) -> Self {
        let y_range = Some(y_range);
        Self {
            x,
            y,
            y_range,
            ..Self::default()
        }
    }

    /// An error rate with its interval; without errors, the interval's end as an upper bound.
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
    /// The line width.
    pub fn width_px(self) -> Option<u32> {
        match self {
            Self::None => None,
            Self::Thin => Some(1),
            Self::Band => Some(2),
            Self::Steps => Some(6),
        }
    }
}
