//! Charts: series of points over two axes.

use plotters::prelude::{Color, PathElement, Polygon, Rectangle};

use super::labels::{LABEL_PX, Labels};
use super::legend::{self, Entry};
use super::mark::{ARROW_PX, Mark, arrow, ring};
use super::palette::{EDGE, GRID};
use super::paper::{Anchor, Surface, coloured, words};
use super::series::{Line, Point, Series};
use super::{Axis, Box};

/// Margins around the axes: left, top, right, bottom.
const AROUND_PX: Box = [74, 34, 18, 52];
/// Distance of a name from the chart's edge.
const RIM_PX: i32 = 4;
const TITLE_PX: i32 = 16;
const TEXT_PX: i32 = 14;
const TICK_PX: i32 = 12;

pub struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// From back to front.
    pub series: Vec<Series>,
}

impl Chart {
    /// Draws the chart, with or without its own legend.
    pub fn draw(&self, surface: &Surface, has_legend: bool) -> anyhow::Result<()> {
        let plane = Plane::new(self, surface);
        plane.axes()?;
        self.series.iter().try_for_each(|series| plane.line(series))?;
        let (bounds, values): (Vec<_>, Vec<_>) = plane.marked().partition(|(_, point)| point.mark == Mark::AtMost);
        for &(series, point) in &values {
            plane.point(series, point, plane.at(point))?;
        }
        let mut taken: Vec<Box> = values.iter().map(|(_, point)| plane.around(point)).collect();
        for chain in chains(bounds, |point| plane.at(point)) {
            taken.push(plane.chain(&chain)?);
        }
        let entries: Vec<Entry> = self.series.iter().filter(|series| !series.name.is_empty()).map(Entry::of).collect();
        if has_legend && entries.len() > 1 {
            taken.push(legend::inside(surface, plane.edges, &entries, &plane.drawn())?);
        }
        plane.names(taken)
    }
}

/// Maps a chart's values to a surface.
struct Plane<'a, 'b> {
    chart: &'a Chart,
    surface: &'a Surface<'b>,
    edges: Box,
}

impl<'a, 'b> Plane<'a, 'b> {
    fn new(chart: &'a Chart, surface: &'a Surface<'b>) -> Self {
        let (width, height) = surface.dim_in_pixel();
        let [left, top, right, bottom] = AROUND_PX;
        Self {
            chart,
            surface,
            edges: [left, top, width as i32 - right, height as i32 - bottom],
        }
    }

    fn x(&self, value: f64) -> i32 {
        let length = f64::from(self.edges[2] - self.edges[0]);
        self.edges[0] + (self.chart.x.share(value) * length).round() as i32
    }

    fn y(&self, value: f64) -> i32 {
        let length = f64::from(self.edges[3] - self.edges[1]);
        self.edges[3] - (self.chart.y.share(value) * length).round() as i32
    }

    fn at(&self, point: &Point) -> (i32, i32) {
        (self.x(point.x), self.y(point.y))
    }

    /// A point's vertical range in pixels, lower end first.
    fn range(&self, point: &Point) -> [i32; 2] {
        point.y_range.unwrap_or([point.y; 2]).map(|end| self.y(end))
    }

    fn path(&self, line: Vec<(i32, i32)>, colour: &impl Color, width_px: u32) -> anyhow::Result<()> {
        Ok(self.surface.draw(&PathElement::new(line, colour.stroke_width(width_px)))?)
    }

    /// Draws the title, the frame, the ticks and the labels.
    fn axes(&self) -> anyhow::Result<()> {
        let Self { chart, surface, .. } = self;
        let [left, top, right, bottom] = self.edges;
        for (tick, label) in chart.x.ticks() {
            let x = self.x(tick);
            self.path(vec![(x, top), (x, bottom)], &GRID, 1)?;
            words(surface, &label, (x, bottom + 5), TICK_PX, Anchor::Below)?;
        }
        for (tick, label) in chart.y.ticks() {
            let y = self.y(tick);
            self.path(vec![(left, y), (right, y)], &GRID, 1)?;
            words(surface, &label, (left - 6, y), TICK_PX, Anchor::Left)?;
        }
        let corners = [(left, top), (right, bottom)];
        surface.draw(&Rectangle::new(corners, EDGE.stroke_width(1)))?;
        let middle = ((left + right) / 2, (top + bottom) / 2);
        words(surface, &chart.title, (middle.0, 10), TITLE_PX, Anchor::Below)?;
        words(surface, &chart.x.label, (middle.0, bottom + 26), TEXT_PX, Anchor::Below)?;
        words(surface, &chart.y.label, (8, middle.1), TEXT_PX, Anchor::Upright)
    }

    fn line(&self, series: &Series) -> anyhow::Result<()> {
        let Some(width_px) = series.line.width_px() else {
            return Ok(());
        };
        let pixels = |points: &[Point]| points.iter().map(|point| self.at(point)).collect();
        match series.line {
            Line::None => Ok(()),
            Line::Thin => self.path(pixels(&series.points), &series.colour.mix(0.6), width_px),
            Line::Steps => self.path(steps(pixels(&series.points)), &series.colour, width_px),
            // Line and band stop before a bound, because it is not a value.
            Line::Band => {
                let runs = series.points.split(|point| point.mark == Mark::AtMost);
                for run in runs.filter(|run| run.len() > 1) {
                    let end = |point: &Point, end: usize| (self.x(point.x), self.range(point)[end]);
                    let upper = run.iter().map(|point| end(point, 1));
                    let lower = run.iter().rev().map(|point| end(point, 0));
                    let band: Vec<(i32, i32)> = upper.chain(lower).collect();
                    self.surface.draw(&Polygon::new(band, series.colour.mix(0.20)))?;
                    self.path(pixels(run), &series.colour, width_px)?;
                }
                Ok(())
            }
        }
    }

    /// Draws a point's bars and mark.
    fn point(&self, series: &Series, point: &Point, at: (i32, i32)) -> anyhow::Result<()> {
        let range = self.range(point);
        let quiet = series.colour.mix(0.5);
        let (x, y) = at;
        if let Some(ends) = point.x_range {
            let [low, high] = ends.map(|end| self.x(end));
            self.path(vec![(low, y), (high, y)], &quiet, 1)?;
        }
        let has_bar = match (series.line, point.mark) {
            (_, Mark::AtMost | Mark::Box) => false,
            (Line::Band, _) => is_alone(series, point),
            _ => point.y_range.is_some(),
        };
        if has_bar {
            self.path(vec![(x, range[0]), (x, range[1])], &quiet, 1)?;
            for end in range {
                self.path(vec![(x - 3, end), (x + 3, end)], &quiet, 1)?;
            }
        }
        point.mark.draw(self.surface, at, range, series.colour)?;
        if point.is_ringed {
            ring(self.surface, at, series.colour)?;
        }
        Ok(())
    }

    /// Draws bounds at one pixel: the first in full, and below it an arrow for each other series. Returns the covered rectangle.
    fn chain(&self, bounds: &[(&Series, &Point)]) -> anyhow::Result<Box> {
        let (mut covered, mut tip) = (Box::default(), None);
        for (k, &(series, point)) in bounds.iter().enumerate() {
            let (x, y) = self.at(point);
            let is_new = !bounds[..k].iter().any(|(other, _)| std::ptr::eq(*other, series));
            let from = *tip.get_or_insert(y);
            if k == 0 {
                covered = self.around(point);
                self.point(series, point, (x, y))?;
            } else if is_new {
                arrow(self.surface, (x, from), series.colour)?;
            }
            if is_new {
                tip = Some(from + ARROW_PX);
                covered[3] = covered[3].max(from + ARROW_PX);
            }
            if point.is_ringed {
                ring(self.surface, (x, y), series.colour)?;
            }
        }
        Ok(covered)
    }

    fn marked(&self) -> impl Iterator<Item = (&'a Series, &'a Point)> {
        let series = self.chart.series.iter();
        let marked = series.filter(|series| series.line != Line::Steps);
        marked.flat_map(|series| series.points.iter().map(move |point| (series, point)))
    }

    /// The rectangle of a point's mark.
    fn around(&self, point: &Point) -> Box {
        let (x, y) = self.at(point);
        let reach = point.mark.reach_px(point.is_ringed);
        [x - reach, y - reach, x + reach, y + reach]
    }

    /// Pixels along all curves; points are repeated as weights.
    fn drawn(&self) -> Vec<(i32, i32)> {
        let mut drawn = Vec::new();
        for series in &self.chart.series {
            for point in &series.points {
                drawn.extend([self.at(point); 20]);
            }
            let pairs = series.points.windows(2);
            for pair in pairs.filter(|_| series.line != Line::None) {
                let [one, other] = [&pair[0], &pair[1]].map(|point| {
                    let [low, high] = self.range(point);
                    let (x, y) = self.at(point);
                    [(x, y), (x, low), (x, high)]
                });
                for ((x, y), (to_x, to_y)) in one.into_iter().zip(other) {
                    let along = |k| (x + k * (to_x - x) / 20, y + k * (to_y - y) / 20);
                    drawn.extend((0..=20).map(along));
                }
            }
        }
        drawn
    }

    /// Draws the names of points, ringed ones first, if the space outside `taken` permits.
    fn names(&self, taken: Vec<Box>) -> anyhow::Result<()> {
        let [left, top, right, bottom] = self.edges;
        let within = [left + RIM_PX, top + RIM_PX, right - RIM_PX, bottom - RIM_PX];
        let mut labels = Labels::new(within, taken, self.drawn());
        let mut named: Vec<_> = self.marked().collect();
        named.sort_by_key(|(_, point)| !point.is_ringed);
        for (series, point) in named {
            let Some(name) = &point.name else { continue };
            let (at, reach) = (self.at(point), point.mark.reach_px(point.is_ringed));
            let Some(placed) = labels.place(name, at, reach) else {
                continue;
            };
            if let Some(end) = placed.leader {
                self.path(vec![at, end], &series.colour.mix(0.5), 1)?;
            }
            let corner = placed.corner;
            coloured(self.surface, name, corner, LABEL_PX, Anchor::Corner, series.colour)?;
        }
        Ok(())
    }
}

/// Groups bounds by pixel.
fn chains<'a>(bounds: Vec<(&'a Series, &'a Point)>, at: impl Fn(&Point) -> (i32, i32)) -> Vec<Vec<(&'a Series, &'a Point)>> {
    let mut chains: Vec<Vec<(&Series, &Point)>> = Vec::new();
    for (series, point) in bounds {
        let same = |chain: &&mut Vec<(&Series, &Point)>| {
            let (x, y) = at(chain[0].1);
            let (to_x, to_y) = at(point);
            (x - to_x).abs() <= 1 && (y - to_y).abs() <= 1
        };
        match chains.iter_mut().find(same) {
            Some(chain) => chain.push((series, point)),
            None => chains.push(vec![(series, point)]),
        }
    }
    chains
}

/// Whether no line connects a point to a neighbour in its series.
fn is_alone(series: &Series, point: &Point) -> bool {
    let mut runs = series.points.split(|point| point.mark == Mark::AtMost);
    runs.any(|run| run.len() == 1 && std::ptr::eq(&run[0], point))
}

/// A line of steps, each right and then down.
fn steps(points: Vec<(i32, i32)>) -> Vec<(i32, i32)> {
    let mut line: Vec<(i32, i32)> = Vec::new();
    for at in points {
        line.extend(line.last().map(|before| (at.0, before.1)));
        line.push(at);
    }
    line
}
