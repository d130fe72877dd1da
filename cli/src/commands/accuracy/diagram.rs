//! Work-precision diagrams: error against cost, both logarithmic.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use studies::work_precision::{CostUnit, Diagram, Part, Point};

use super::axis::{Axis, short};
use super::labels::{Box, Labels};
use super::legend;
use crate::plot::{self, FONT, Surface};

/// The size of a diagram.
const SIZE_PX: (i32, i32) = (560, 430);
/// What is around its axes: left, top, right, bottom.
const AROUND_PX: [i32; 4] = [78, 34, 18, 52];
const TITLE_PX: i32 = 16;
pub const TEXT_PX: i32 = 14;
const LABEL_PX: i32 = 11;
/// What marks reach over.
const DOT_PX: i32 = 4;
const RING_PX: i32 = 9;
/// The colour of the front.
pub const FRONT: RGBColor = RGBColor(205, 205, 205);
const GRID: RGBColor = RGBColor(232, 232, 232);
const QUIET: RGBColor = RGBColor(90, 90, 90);

/// All diagrams of a part.
pub fn figure(part: &Part) -> anyhow::Result<String> {
    let curves = legend::curves(part);
    let count = part.diagrams.len();
    let columns = count.clamp(1, 2);
    let rows = count.div_ceil(columns).max(1);
    let width_px = 2 * SIZE_PX.0;
    let legend_px = legend::height_px(&curves, width_px);
    let height_px = legend_px + SIZE_PX.1 * rows as i32;
    plot::svg((width_px as u32, height_px as u32), |surface| {
        let (head, body) = surface.split_vertically(legend_px);
        legend::draw(&head, &curves)?;
        let parts = body.split_evenly((rows, columns));
        for (surface, diagram) in parts.iter().zip(&part.diagrams) {
            let (width, _) = surface.dim_in_pixel();
            let frame = Frame::new(diagram, width as i32);
            frame.draw(surface, diagram, &curves)?;
        }
        Ok(())
    })
}

/// The first diagrams of two parts, for a first look: how a panel is drawn, and how it is read. None before both are measured.
pub fn summary(parts: &[Part]) -> anyhow::Result<Option<String>> {
    let wanted = ["renderer", "detectors"];
    let found = wanted.map(|name| parts.iter().find(|part| part.name == name));
    let [Some(renderer), Some(detectors)] = found else {
        return Ok(None);
    };
    let first = [renderer, detectors].map(|part| part.diagrams.first().cloned());
    let both = Part {
        diagrams: first.into_iter().flatten().collect(),
        ..renderer.clone()
    };
    figure(&both).map(Some)
}

/// What a point is marked as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A full dot.
    OnFront,
    /// An empty one.
    Beaten,
    /// A full dot with a ring around it.
    Default,
}

/// Draws a mark.
pub fn mark(surface: &Surface, at: (i32, i32), colour: RGBColor, mark: Mark) -> anyhow::Result<()> {
    match mark {
        Mark::OnFront => surface.draw(&Circle::new(at, 4, colour.filled()))?,
        Mark::Beaten => {
            surface.draw(&Circle::new(at, 3, WHITE.filled()))?;
            surface.draw(&Circle::new(at, 3, colour.stroke_width(1)))?;
        }
        Mark::Default => surface.draw(&Circle::new(at, 8, colour.stroke_width(2)))?,
    }
    Ok(())
}

/// Writes from a top left corner.
pub fn text(
    surface: &Surface,
    words: &str,
    at: (i32, i32),
    size_px: i32,
    colour: RGBColor,
) -> anyhow::Result<()> {
    let style = (FONT, size_px).into_font().color(&colour);
    surface.draw(&Text::new(words.to_string(), at, style))?;
    Ok(())
}

/// The axes of a diagram and where they are.
struct Frame {
    edges: Box,
    x: Axis,
    y: Axis,
}

impl Frame {
    fn new(diagram: &Diagram, width: i32) -> Self {
        let [left, top, right, bottom] = AROUND_PX;
        let edges = [left, top, width - right, SIZE_PX.1 - bottom];
        let costs = diagram.points.iter().map(|point| point.ratio.median);
        let errors = diagram.points.iter();
        let errors = errors.flat_map(|point| [point.error, point.rms.unwrap_or(point.error)]);
        Self {
            edges,
            x: Axis::over(costs, [edges[0], edges[2]]),
            y: Axis::over(errors, [edges[3], edges[1]]),
        }
    }

    fn at(&self, point: &Point) -> (i32, i32) {
        (self.x.pixel(point.ratio.median), self.y.pixel(point.error))
    }

    fn draw(
        &self,
        surface: &Surface,
        diagram: &Diagram,
        curves: &[(String, RGBColor)],
    ) -> anyhow::Result<()> {
        self.axes(surface, diagram)?;
        self.front(surface, diagram)?;
        for (name, colour) in curves {
            let line = diagram.points.iter().filter(|point| point.curve == *name);
            let line: Vec<_> = line.map(|point| self.at(point)).collect();
            if line.len() > 1 {
                surface.draw(&PathElement::new(line, colour.mix(0.6).stroke_width(1)))?;
            }
        }
        for point in &diagram.points {
            self.point(surface, point, legend::colour(curves, &point.curve))?;
        }
        self.labels(surface, diagram, curves)
    }

    fn axes(&self, surface: &Surface, diagram: &Diagram) -> anyhow::Result<()> {
        let [left, top, right, bottom] = self.edges;
        let small = |anchor: Pos| (FONT, TEXT_PX - 2).into_font().color(&BLACK).pos(anchor);
        for tick in self.x.ticks() {
            let x = self.x.pixel(tick);
            surface.draw(&PathElement::new(
                vec![(x, top), (x, bottom)],
                GRID.stroke_width(1),
            ))?;
            let style = small(Pos::new(HPos::Center, VPos::Top));
            surface.draw(&Text::new(short(tick), (x, bottom + 5), style))?;
        }
        for tick in self.y.ticks() {
            let y = self.y.pixel(tick);
            surface.draw(&PathElement::new(
                vec![(left, y), (right, y)],
                GRID.stroke_width(1),
            ))?;
            let style = small(Pos::new(HPos::Right, VPos::Center));
            surface.draw(&Text::new(short(tick), (left - 6, y), style))?;
        }
        surface.draw(&Rectangle::new(
            [(left, top), (right, bottom)],
            QUIET.stroke_width(1),
        ))?;
        let centred = |size| {
            (FONT, size)
                .into_font()
                .color(&BLACK)
                .pos(Pos::new(HPos::Center, VPos::Top))
        };
        let middle = ((left + right) / 2, (top + bottom) / 2);
        surface.draw(&Text::new(
            diagram.title.clone(),
            (middle.0, 10),
            centred(TITLE_PX),
        ))?;
        surface.draw(&Text::new(
            cost_label(diagram),
            (middle.0, bottom + 26),
            centred(TEXT_PX),
        ))?;
        let error = match diagram.error_unit.as_str() {
            "" => diagram.error.clone(),
            unit => format!("{} ({unit})", diagram.error),
        };
        let style = (FONT, TEXT_PX)
            .into_font()
            .transform(FontTransform::Rotate270);
        let style = style.color(&BLACK).pos(Pos::new(HPos::Center, VPos::Top));
        surface.draw(&Text::new(error, (8, middle.1), style))?;
        Ok(())
    }

    /// A band along the points that no other beats.
    fn front(&self, surface: &Surface, diagram: &Diagram) -> anyhow::Result<()> {
        let mut points: Vec<&Point> = diagram
            .points
            .iter()
            .filter(|point| point.on_front)
            .collect();
        points.sort_by(|a, b| a.cost.median.total_cmp(&b.cost.median));
        // Whatever costs as much as a point may err as much: steps.
        let mut line = Vec::new();
        let mut before: Option<(i32, i32)> = None;
        for at in points.into_iter().map(|point| self.at(point)) {
            line.extend(before.map(|before| (at.0, before.1)));
            line.push(at);
            before = Some(at);
        }
        if line.len() > 1 {
            surface.draw(&PathElement::new(line, FRONT.stroke_width(6)))?;
        }
        Ok(())
    }

    fn point(&self, surface: &Surface, point: &Point, colour: RGBColor) -> anyhow::Result<()> {
        let at = self.at(point);
        let quiet = colour.mix(0.5).stroke_width(1);
        let [low, high] = [point.ratio.low, point.ratio.high].map(|ratio| self.x.pixel(ratio));
        surface.draw(&PathElement::new(vec![(low, at.1), (high, at.1)], quiet))?;
        if let Some(rms) = point.rms {
            let (x, low) = (at.0, self.y.pixel(rms));
            surface.draw(&PathElement::new(vec![at, (x, low)], quiet))?;
            surface.draw(&PathElement::new(vec![(x - 3, low), (x + 3, low)], quiet))?;
        }
        if let Some([low, high]) = point.error_95 {
            let [low, high] = [low, high].map(|error| self.y.pixel(error));
            surface.draw(&PathElement::new(vec![(at.0, low), (at.0, high)], quiet))?;
        }
        if point.at_most {
            let (x, y) = at;
            let tip = (x, (y + 15).min(self.edges[3] - 1));
            let style = colour.stroke_width(1);
            surface.draw(&PathElement::new(vec![at, tip], style))?;
            surface.draw(&PathElement::new(
                vec![(x - 3, tip.1 - 4), tip, (x + 3, tip.1 - 4)],
                style,
            ))?;
        }
        mark(
            surface,
            at,
            colour,
            if point.on_front {
                Mark::OnFront
            } else {
                Mark::Beaten
            },
        )?;
        if point.is_default {
            mark(surface, at, colour, Mark::Default)?;
        }
        Ok(())
    }

    /// Names of variants that stand alone, then of curves' ends, as far as there is room.
    fn labels(
        &self,
        surface: &Surface,
        diagram: &Diagram,
        curves: &[(String, RGBColor)],
    ) -> anyhow::Result<()> {
        let around = |point: &Point| {
            let (x, y) = self.at(point);
            let reach = if point.is_default { RING_PX } else { DOT_PX };
            [x - reach, y - reach, x + reach, y + reach]
        };
        let mut labels = Labels::new(self.edges, diagram.points.iter().map(around).collect());
        let of = |name: &str| {
            let name = name.to_string();
            diagram
                .points
                .iter()
                .filter(move |point| point.curve == name)
        };
        let ends = curves.iter().flat_map(|(name, _)| {
            let (first, last) = (of(name).next(), of(name).next_back());
            [first, last.filter(|_| of(name).count() > 1)]
        });
        let alone = of("").chain(
            diagram
                .points
                .iter()
                .filter(|point| point.is_default && !point.curve.is_empty()),
        );
        let mut named: Vec<&Point> = Vec::new();
        for point in alone.chain(ends.flatten()) {
            if named.iter().any(|other| std::ptr::eq(*other, point)) {
                continue;
            }
            named.push(point);
            // A curve's name is its colour.
            let knob = point.variant.strip_prefix(&point.curve);
            let knob = knob.and_then(|knob| knob.strip_prefix(", "));
            let name = knob.unwrap_or(&point.variant);
            let apart = if point.is_default { RING_PX } else { DOT_PX };
            if let Some(placed) = labels.place(name, self.at(point), apart) {
                let colour = legend::colour(curves, &point.curve);
                if let Some(end) = placed.leader {
                    let line = vec![self.at(point), end];
                    surface.draw(&PathElement::new(line, colour.mix(0.5).stroke_width(1)))?;
                }
                text(surface, name, placed.corner, LABEL_PX, colour)?;
            }
        }
        Ok(())
    }
}

/// What the horizontal axis shows: multiples of the baseline's cost.
fn cost_label(diagram: &Diagram) -> String {
    let baseline = diagram.points.iter().find(|point| point.is_baseline);
    let Some(baseline) = baseline else {
        return format!("cost of {}", diagram.cost);
    };
    let (what, cost) = match diagram.cost_unit {
        CostUnit::Ns => ("time", time(baseline.cost.median)),
        CostUnit::Instructions => ("instructions", short(baseline.cost.median)),
        CostUnit::Cycles => ("cycles", short(baseline.cost.median)),
    };
    format!(
        "{what} of {}, over that of {} ({cost})",
        diagram.cost, baseline.variant
    )
}

/// A time in the unit that suits it.
pub fn time(ns: f64) -> String {
    let (value, unit) = match ns {
        ns if ns < 1e3 => (ns, "ns"),
        ns if ns < 1e6 => (ns / 1e3, "µs"),
        ns if ns < 1e9 => (ns / 1e6, "ms"),
        ns => (ns / 1e9, "s"),
    };
    let digits = (2 - value.max(1.0).log10() as i32).max(0) as usize;
    format!("{value:.digits$} {unit}")
}
