//! Work-precision diagrams: error against cost, both logarithmic.

use studies::work_precision::{CostUnit, Diagram, Part, Point};

use crate::numbers::time;
use crate::plot::{
    Axis, BLACK, COLOURS, Chart, Drawing, Entry, FRONT, Line, Mark, Page, Point as Drawn, RGBColor,
    Series, short,
};

/// The size of a diagram.
const SIZE_PX: (i32, i32) = (560, 430);
const BARS: &str = "bars: quartiles of time, 95 % of a sampled error, down to the rms";

/// All diagrams of a part.
pub fn figure(part: &Part) -> anyhow::Result<Drawing> {
    let curves = curves(part);
    let marks = vec![
        Entry::of_mark("on the front", Some(Mark::Dot), false),
        Entry::of_mark("beaten in both", Some(Mark::Ring), false),
        Entry::of_mark("at most", Some(Mark::AtMost), false),
        Entry::of_mark("default", None, true),
        Entry::of(&front(&[])),
        Entry::of_mark(BARS, None, false),
    ];
    let names = curves.iter().map(|(name, colour)| Entry {
        name: name.clone(),
        colour: *colour,
        line: Line::Thin,
        mark: Some(Mark::Dot),
        is_ringed: false,
    });
    let charts = part.diagrams.iter().map(|diagram| chart(diagram, &curves));
    let page = Page {
        charts: charts.collect(),
        columns: 2,
        chart_px: SIZE_PX,
        legend: vec![names.collect(), marks],
    };
    page.draw()
}

/// The first diagrams of two parts, for a first look: how a panel is drawn, and how it is read. None before both are measured.
pub fn summary(parts: &[Part]) -> anyhow::Result<Option<Drawing>> {
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

/// The curves of a part in the order in which they appear, with their colours.
fn curves(part: &Part) -> Vec<(String, RGBColor)> {
    let mut names: Vec<String> = Vec::new();
    for point in part.diagrams.iter().flat_map(|diagram| &diagram.points) {
        if !point.curve.is_empty() && !names.contains(&point.curve) {
            names.push(point.curve.clone());
        }
    }
    names.into_iter().zip(COLOURS.into_iter().cycle()).collect()
}

fn chart(diagram: &Diagram, curves: &[(String, RGBColor)]) -> Chart {
    let costs = diagram.points.iter().map(|point| point.ratio.median);
    let errors = diagram.points.iter();
    let errors = errors.flat_map(|point| [point.error, point.rms.unwrap_or(point.error)]);
    let error = match diagram.error_unit.as_str() {
        "" => diagram.error.clone(),
        unit => format!("{} ({unit})", diagram.error),
    };
    // Variants that stand alone have no colour, and are named first.
    let alone = (String::new(), BLACK);
    let series = std::iter::once(&alone).chain(curves);
    let series = series.map(|(name, colour)| series_of(diagram, name, *colour));
    Chart {
        title: diagram.title.clone(),
        x: Axis::around_logarithms(&cost_label(diagram), costs),
        y: Axis::around_logarithms(&error, errors),
        series: std::iter::once(front(&diagram.points))
            .chain(series)
            .collect(),
    }
}

/// A band along the points that no other beats: whatever costs as much as one of them may err as much.
fn front(points: &[Point]) -> Series {
    let mut points: Vec<&Point> = points.iter().filter(|point| point.on_front).collect();
    points.sort_by(|a, b| a.cost.median.total_cmp(&b.cost.median));
    Series {
        name: "the front".into(),
        colour: FRONT,
        line: Line::Steps,
        points: points.into_iter().map(drawn).collect(),
    }
}

/// The points of a curve, its ends and what is done by default named; of those that stand alone, all.
fn series_of(diagram: &Diagram, name: &str, colour: RGBColor) -> Series {
    let is_alone = name.is_empty();
    let points = diagram.points.iter().filter(|point| point.curve == name);
    let last = points.clone().count().saturating_sub(1);
    let points = points.enumerate().map(|(k, point)| {
        // A curve's name is its colour.
        let knob = point.variant.strip_prefix(&point.curve);
        let knob = knob.and_then(|knob| knob.strip_prefix(", "));
        let name = knob.unwrap_or(&point.variant);
        let is_named = is_alone || point.is_default || k == 0 || k == last;
        Drawn {
            name: is_named.then(|| name.to_string()),
            ..drawn(point)
        }
    });
    Series {
        name: name.into(),
        colour,
        line: if is_alone { Line::None } else { Line::Thin },
        points: points.collect(),
    }
}

fn drawn(point: &Point) -> Drawn {
    Drawn {
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
