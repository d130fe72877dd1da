//! Legends, inside a chart where they cover least, or in rows above a page.

use plotters::prelude::{Color, PathElement, RGBColor, Rectangle};

use super::mark::{Mark, ring};
use super::palette::{BLACK, EDGE, WHITE};
use super::paper::{Anchor, Surface, width_px, words};
use super::series::{Line, Series};
use super::{Box, meet};

/// Font size of an entry.
const NAME_PX: i32 = 13;
/// Height of an entry.
const ROW_PX: i32 = 18;
/// Length of an entry's line sample.
const SAMPLE_PX: i32 = 26;
/// Margin around entries.
const RIM_PX: i32 = 8;
/// Distance between entries of a row.
const BETWEEN_PX: i32 = 26;

/// A sample of a series or a mark, and its name.
#[derive(Clone, Debug)]
pub struct Entry {
    pub name: String,
    pub colour: RGBColor,
    pub line: Line,
    pub mark: Option<Mark>,
    pub is_ringed: bool,
}

impl Entry {
    /// The entry of a series.
    pub fn of(series: &Series) -> Self {
        let mark = series.points.first().map(|_| Mark::Dot);
        Self {
            name: series.name.clone(),
            colour: series.colour,
            line: series.line,
            mark: mark.filter(|_| series.line != Line::Steps),
            is_ringed: false,
        }
    }

    /// The entry of a mark.
    pub fn of_mark(name: &str, mark: Option<Mark>, is_ringed: bool) -> Self {
        Self {
            name: name.into(),
            colour: BLACK,
            line: Line::None,
            mark,
            is_ringed,
        }
    }

    /// An entry of text alone.
    pub fn of_words(words: &str) -> Self {
        Self::of_mark(words, None, false)
    }

    /// Whether it has no sample.
    fn is_bare(&self) -> bool {
        self.line == Line::None && self.mark.is_none() && !self.is_ringed
    }

    fn width_px(&self) -> i32 {
        let sample = if self.is_bare() { 0 } else { SAMPLE_PX + RIM_PX };
        sample + width_px(&self.name, NAME_PX)
    }

    /// Draws it from a point to the right, vertically centred.
    fn draw(&self, surface: &Surface, (left, middle): (i32, i32)) -> anyhow::Result<()> {
        let mut name = left;
        if !self.is_bare() {
            let centre = (left + SAMPLE_PX / 2, middle);
            if let Some(width) = self.line.width_px() {
                let line = vec![(left, middle), (left + SAMPLE_PX, middle)];
                surface.draw(&PathElement::new(line, self.colour.stroke_width(width.max(2))))?;
            }
            if let Some(mark) = self.mark {
                mark.draw(surface, centre, [middle; 2], self.colour)?;
            }
            if self.is_ringed {
                ring(surface, centre, self.colour)?;
            }
            name += SAMPLE_PX + RIM_PX;
        }
        words(surface, &self.name, (name, middle), NAME_PX, Anchor::Right)
    }
}

/// Draws entries in a column, inside a chart where they cover the fewest of `drawn`; returns the rectangle.
pub fn inside(surface: &Surface, edges: Box, entries: &[Entry], drawn: &[(i32, i32)]) -> anyhow::Result<Box> {
    let widest = entries.iter().map(Entry::width_px).max().unwrap_or(0);
    let size = [widest + 2 * RIM_PX, ROW_PX * entries.len() as i32 + RIM_PX];
    let place = freest(edges, size, drawn);
    let corners = [(place[0], place[1]), (place[2], place[3])];
    surface.draw(&Rectangle::new(corners, WHITE.mix(0.85).filled()))?;
    surface.draw(&Rectangle::new(corners, EDGE.mix(0.5).stroke_width(1)))?;
    let middle = place[1] + (RIM_PX + ROW_PX) / 2;
    for (row, entry) in (0..).zip(entries) {
        entry.draw(surface, (place[0] + RIM_PX, middle + ROW_PX * row))?;
    }
    Ok(place)
}

/// The rectangle of that size that covers the fewest pixels: corners first, then positions between them.
fn freest(edges: Box, [width, height]: [i32; 2], drawn: &[(i32, i32)]) -> Box {
    let [left, top, right, bottom] = edges;
    let (near, far) = (left + RIM_PX, right - RIM_PX - width);
    let (high, low) = (top + RIM_PX, bottom - RIM_PX - height);
    let corners = [(near, high), (far, high), (far, low), (near, low)];
    let across = |k| near + k * (far - near) / 8;
    let between = [high, low, (high + low) / 2];
    let between = between.map(|y| (0..=8).map(move |k| (across(k), y)));
    let places = corners.into_iter().chain(between.into_iter().flatten());
    let places = places.map(|(x, y)| [x, y, x + width, y + height]);
    let covered = |place: &Box| {
        let pixels = drawn.iter();
        pixels.filter(|&&(x, y)| meet(*place, [x - 4, y - 4, x + 4, y + 4])).count()
    };
    places.min_by_key(covered).unwrap_or(edges)
}

/// Positions of entries above a page `page_px` wide, from left to right; each row starts a new line and wraps as needed.
fn places(rows: &[Vec<Entry>], page_px: i32) -> Vec<(&Entry, (i32, i32))> {
    let (mut placed, mut line) = (Vec::new(), 0);
    for row in rows.iter().filter(|row| !row.is_empty()) {
        let mut left = BETWEEN_PX;
        for entry in row {
            if left > BETWEEN_PX && left + entry.width_px() > page_px {
                (left, line) = (BETWEEN_PX, line + 1);
            }
            placed.push((entry, (left, ROW_PX * line + ROW_PX / 2 + RIM_PX / 2)));
            left += entry.width_px() + BETWEEN_PX;
        }
        line += 1;
    }
    placed
}

/// Height of rows of entries above a page `page_px` wide; 0 without entries.
pub fn height_px(rows: &[Vec<Entry>], page_px: i32) -> i32 {
    let lowest = places(rows, page_px).into_iter().map(|(_, (_, y))| y).max();
    lowest.map_or(0, |lowest| lowest + ROW_PX / 2 + RIM_PX)
}

/// Draws rows of entries along the top of a surface.
pub fn above(surface: &Surface, rows: &[Vec<Entry>]) -> anyhow::Result<()> {
    let (width, _) = surface.dim_in_pixel();
    let placed = places(rows, width as i32);
    placed.into_iter().try_for_each(|(entry, at)| entry.draw(surface, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_stands_where_least_is_drawn() {
        let rising: Vec<(i32, i32)> = (0..100).map(|k| (2 * k, 100 - k)).collect();
        assert_eq!(freest([0, 0, 200, 100], [60, 30], &rising), [8, 8, 68, 38]);
        let falling: Vec<(i32, i32)> = (0..100).map(|k| (2 * k, k)).collect();
        assert_eq!(freest([0, 0, 200, 100], [60, 30], &falling), [132, 8, 192, 38]);
    }

    #[test]
    fn rows_are_broken_at_the_edge_of_the_page() {
        let entry = || Entry::of_mark("a mark", Some(Mark::Dot), false);
        let rows = [vec![entry(), entry(), entry()], vec![entry()]];
        let lines = |page_px| {
            let mut lines: Vec<i32> = places(&rows, page_px).iter().map(|(_, at)| at.1).collect();
            lines.dedup();
            lines.len()
        };
        assert_eq!([lines(1000), lines(250), lines(10)], [2, 3, 4]);
        assert_eq!(height_px(&[], 100), 0);
    }
}
