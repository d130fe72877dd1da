//! Work-precision diagrams: error over cost, both logarithmic.

use studies::work_precision::{CostUnit, Diagram, Part, Point};

use crate::numbers::time;
use crate::plot::{Axis, Chart, Drawing, Entry, FRONT, Line, Mark, Page, Point as ChartPoint, RGBColor, Series, colours, short};

/// The size of a diagram.
const SIZE_PX: (i32, i32) = (560, 430);
const BARS: &str = "bars: quartiles of time; 95 % intervals; rms to greatest error";
const REFERENCE: &str = "the page names the reference of the errors";

/// The name and the colour of a curve or a single variant.
type NamedColour = (String, RGBColor);

/// All diagrams of a part.
pub fn figure(part: &Part) -> anyhow::Result<Drawing> {
    let named = named(part);
    let names = named.iter().map(|(name, colour)| {
        let is_curve = points(part).any(|point| point.curve == *name);
        entry(name, *colour, is_curve)
    });
    let charts = part.diagrams.iter().map(|diagram| chart(diagram, &named));
    let page = Page {
        charts: charts.collect(),
        columns: 2,
        chart_px: SIZE_PX,
        legend: vec![names.collect(), marks(), words(&part.diagrams)],
    };
    page.draw()
}

/// The first diagram of two parts, for an overview: drawing and reading of a panel. `None` until both are measured.
pub fn summary(parts: &[Part]) -> anyhow::Result<Option<Drawing>> {
    let wanted = ["renderer", "detectors"];
    let found = wanted.map(|name| parts.iter().find(|part| part.name == name));
    let [Some(renderer), Some(detectors)] = found else {
        return Ok(None);
    };
    let first = [renderer, detectors].map(|part| {
        let diagram = part.diagrams.first();
        diagram.map(|diagram| (diagram, named(part)))
    });
    let first: Vec<_> = first.into_iter().flatten().collect();
    let rows = first.iter().map(|(diagram, named)| {
        let is_there = |name: &String| diagram.points.iter().any(|point| called(point) == name);
        let named = named.iter().filter(|(name, _)| is_there(name));
        let entries = named.map(|(name, colour)| {
            let is_curve = diagram.points.iter().any(|point| point.curve == *name);
            entry(name, *colour, is_curve)
        });
        let title = Entry::of_words(&format!("{}:", diagram.cost));
        std::iter::once(title).chain(entries).collect()
    });
    let diagrams: Vec<Diagram> = first.iter().map(|(diagram, _)| (*diagram).clone()).collect();
    let charts = first.iter().map(|(diagram, named)| chart(diagram, named));
    let page = Page {
        charts: charts.collect(),
        columns: 2,
        chart_px: SIZE_PX,
        legend: rows.chain([marks(), words(&diagrams)]).collect(),
    };
    page.draw().map(Some)
}

/// Legend of the marks, common to all diagrams.
fn marks() -> Vec<Entry> {
    vec![
        Entry::of_mark("on the front", Some(Mark::Dot), false),
        Entry::of_mark("beaten in both", Some(Mark::Ring), false),
        Entry::of_mark("at most", Some(Mark::AtMost), false),
        Entry::of_mark("default", None, true),
        Entry::of(&front(&[])),
        Entry::of_words(BARS),
    ]
}

fn entry(name: &str, colour: RGBColor, is_curve: bool) -> Entry {
    Entry {
        name: name.into(),
        colour,
        line: if is_curve { Line::Thin } else { Line::None },
        mark: Some(Mark::Dot),
        is_ringed: false,
    }
}

/// Curves and single variants in order of appearance, with their colours.
fn named(part: &Part) -> Vec<NamedColour> {
    let mut names: Vec<String> = Vec::new();
    for point in points(part) {
        if !names.iter().any(|name| name == called(point)) {
            names.push(called(point).to_owned());
        }
    }
    let colours = colours(&names);
    names.into_iter().zip(colours).collect()
}

fn points(part: &Part) -> impl Iterator<Item = &Point> {
    part.diagrams.iter().flat_map(|diagram| &diagram.points)
}

/// The name of a point's curve, or its own name for a single variant.
fn called(point: &Point) -> &str {
    if point.curve.is_empty() { &point.variant } else { &point.curve }
}

/// The part of a point's name that distinguishes it within its curve; empty if it is the whole name.
fn knob(point: &Point) -> &str {
    match point.variant.strip_prefix(&point.curve) {
        Some("") => "",
        Some(rest) if !point.curve.is_empty() => rest.strip_prefix(", ").unwrap_or(&point.variant),
        _ => &point.variant,
    }
}

/// The first and the last point of a curve, by their distinguishing names.
fn knobs<'a>(diagram: &'a Diagram, curve: &str) -> Option<[&'a str; 2]> {
    let mut points = diagram.points.iter().filter(|point| point.curve == curve);
    let first = points.next()?;
    Some([first, points.next_back().unwrap_or(first)].map(knob))
}

/// Whether several curves of a diagram have the same two ends; the legend then states them once.
fn is_shared(diagram: &Diagram, ends: [&str; 2]) -> bool {
    let curves = curves(diagram);
    let same = curves.iter().filter(|curve| knobs(diagram, curve) == Some(ends));
    same.count() > 1
}

fn curves(diagram: &Diagram) -> Vec<&str> {
    let mut curves: Vec<&str> = Vec::new();
    for point in &diagram.points {
        if !point.curve.is_empty() && !curves.contains(&point.curve.as_str()) {
            curves.push(&point.curve);
        }
    }
    curves
}

/// Legend texts: the errors' reference, and the ends that several curves share.
fn words(diagrams: &[Diagram]) -> Vec<Entry> {
    let mut said: Vec<String> = Vec::new();
    for diagram in diagrams {
        for curve in curves(diagram) {
            let Some(ends) = knobs(diagram, curve).filter(|ends| is_shared(diagram, *ends)) else {
                continue;
            };
            let led = match ends {
                [from, to] if from == to => continue,
                ["", "soft"] => "lines lead from bits alone to soft values".into(),
                ["", to] => format!("lines lead to {to}"),
                [from, to] => format!("lines lead from {from} to {to}"),
            };
            if !said.contains(&led) {
                said.push(led);
            }
        }
    }
    let said = said.iter().map(String::as_str);
    [REFERENCE].into_iter().chain(said).map(Entry::of_words).collect()
}

fn chart(diagram: &Diagram, named: &[NamedColour]) -> Chart {
    let costs = diagram.points.iter().map(|point| point.ratio.median);
    let errors = diagram.points.iter();
    let errors = errors.flat_map(|point| {
        let [low, high] = point.error_95.unwrap_or([point.error; 2]);
        // The edge cuts off an interval without a lower end.
        let low = low.max(point.error / 10.0);
        [point.error, point.rms.unwrap_or(point.error), low, high]
    });
    let error = match diagram.error_unit.as_str() {
        "" => diagram.error.clone(),
        unit => format!("{} ({unit})", diagram.error),
    };
    let series = named.iter();
    let series = series.map(|(name, colour)| series_of(diagram, name, *colour));
    Chart {
        title: diagram.title.clone(),
        x: Axis::around_logarithms(&cost_label(diagram), costs),
        y: Axis::around_logarithms(&error, errors),
        series: std::iter::once(front(&diagram.points)).chain(series).collect(),
    }
}

/// A band along the Pareto front: at each cost, the smallest error.
fn front(points: &[Point]) -> Series {
    let mut points: Vec<&Point> = points.iter().filter(|point| point.on_front).collect();
    points.sort_by(|a, b| a.cost.median.total_cmp(&b.cost.median));
    Series::new("the front", FRONT, Line::Steps, points.into_iter().map(drawn).collect())
}

/// The points of a curve, or the single variant of that name. The ends of a curve bear their names unless the legend states them.
fn series_of(diagram: &Diagram, name: &str, colour: RGBColor) -> Series {
    let points = diagram.points.iter().filter(|point| called(point) == name);
    let last = points.clone().count().saturating_sub(1);
    let ends = knobs(diagram, name);
    let is_said = ends.is_some_and(|ends| is_shared(diagram, ends));
    let points = points.enumerate().map(|(k, point)| {
        let is_alone = point.curve.is_empty();
        let is_end = (k == 0 || k == last) && !is_said;
        let word = knob(point);
        let is_named = !word.is_empty() && (is_alone || is_end);
        ChartPoint {
            name: is_named.then(|| word.to_owned()),
            ..drawn(point)
        }
    });
    Series::new(name, colour, if ends.is_some() { Line::Thin } else { Line::None }, points.collect())
}

fn drawn(point: &Point) -> ChartPoint {
    ChartPoint {
        x: point.ratio.median,
        y: point.error,
        x_range: Some([point.ratio.low, point.ratio.high]),
        y_range: point.error_95.or(point.rms.map(|rms| [rms, point.error])),
        mark: match (point.at_most, point.on_front) {
            (true, _) => Mark::AtMost,
            (false, true) => Mark::Dot,
            (false, false) => Mark::Ring,
        },
        is_ringed: point.is_default,
        name: None,
    }
}

/// Label of the horizontal axis: multiples of the baseline's cost.
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
    format!("{what} of {}, over that of {} ({cost})", diagram.cost, baseline.variant)
}
