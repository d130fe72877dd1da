//! The page: each part's question, plot and table, and what was measured on what.

use studies::work_precision::{CostUnit, Diagram, Part, Point, Scale};

use super::document::Document;
use super::figure::Figure;
use crate::numbers::{digits, time, with_interval};
use crate::plot::short;

/// How a run was made.
pub struct Provenance<'a> {
    /// The command's options.
    pub options: &'a str,
    pub scale: &'a Scale,
    pub machine: &'a str,
    /// The folder of its pictures and numbers.
    pub folder: &'a str,
}

/// The page of what was measured.
pub fn page(parts: &[Part], made: &Provenance, figures: &[Figure]) -> Document {
    let mut document = Document::new("What accuracy costs in time");
    document.text(
        "Wherever this project can do a thing more or less exactly, here is what exactness costs: error against time for every way \
         it has, and for ways that it does not go. In each plot **down** is more exact and **left** is quicker. The grey band is \
         the *Pareto front*: the ways that no other beats in both. Full dots are on it, empty dots are beaten, arrows are bounds \
         that the error does not exceed, and a ring marks what is done unless told otherwise. Below each plot stands why.",
    );
    document.text(&format!(
        "Provenance by `cargo run --release -- accuracy{}`, on: {}.",
        made.options, made.machine
    ));
    document.text(&format!(
        "Times are multiples of the baseline's, named at the axis with its own time. All of a plot's variants are timed by turns in \
         one run, {} turns; the ratio is taken turn by turn, and its median and quartiles are given. Errors are against a reference \
         that is named.",
        made.scale.turns
    ));
    for (part, figure) in parts.iter().zip(figures) {
        document.heading(&part.title);
        let stem = format!("{}/{}", made.folder, figure.name);
        let caption = format!("[vector graphic]({stem}.svg), [all numbers]({stem}.csv)");
        document.picture(&stem, &caption, &figure.drawing.svg);
        document.text(&format!("**What is compared.** {}", part.method));
        document.text(&format!("**The reference.** {}", part.reference));
        document.text(&format!("**The default, and why.** {}", part.default));
        table(&mut document, part);
    }
    document
}

/// The points worth telling of each diagram, by their cost.
fn table(document: &mut Document, part: &Part) {
    let head = ["", "variant", "error", "cost", "ratio (quartiles)", "front"];
    let rows = part.diagrams.iter().flat_map(|diagram| {
        let mut points: Vec<&Point> = diagram.points.iter().filter(|point| is_told(diagram, point)).collect();
        points.sort_by(|a, b| a.cost.median.total_cmp(&b.cost.median));
        let first = points.first().map(|point| std::ptr::from_ref(*point));
        points
            .into_iter()
            .map(|point| row(diagram, point, Some(std::ptr::from_ref(point)) == first))
            .collect::<Vec<_>>()
    });
    document.table(&head, rows);
}

/// Whether a point is on the front, alone, the default, the baseline or the end of a curve.
fn is_told(diagram: &Diagram, point: &Point) -> bool {
    let mut curve = diagram.points.iter().filter(|other| other.curve == point.curve);
    let ends = [curve.next(), curve.next_back()];
    let is_an_end = ends.into_iter().flatten().any(|end| std::ptr::eq(end, point));
    point.on_front || point.is_default || point.is_baseline || point.curve.is_empty() || is_an_end
}

fn row(diagram: &Diagram, point: &Point, is_first: bool) -> Vec<String> {
    let emphasis = if point.is_default { "**" } else { "" };
    let error = match point.error_95 {
        Some(interval) => with_interval(point.error, interval, digits),
        None if point.rms.is_some() => format!("{} (rms {})", digits(point.error), digits(point.rms.unwrap_or_default())),
        None if point.at_most => format!("< {}", digits(point.error)),
        None => digits(point.error),
    };
    let cost = match diagram.cost_unit {
        CostUnit::Ns => time(point.cost.median),
        CostUnit::Instructions | CostUnit::Cycles => short(point.cost.median.round()),
    };
    let title = format!("**{}**, {}", diagram.title, diagram.error);
    vec![
        if is_first { title } else { String::new() },
        format!("{emphasis}{}{emphasis}", point.variant),
        error,
        cost,
        with_interval(point.ratio.median, [point.ratio.low, point.ratio.high], digits),
        match (point.on_front, point.at_most) {
            (true, _) => "●".into(),
            (false, true) => "↓ a bound".into(),
            (false, false) => "○ beaten".into(),
        },
    ]
}
