//! The report's page: each part's default, plot and method, and the machine.

use studies::work_precision::{CostUnit, Diagram, Part, Point, Scale};

use super::document::Document;
use super::figure::Figure;
use crate::numbers::{digits, time};
use crate::plot::short;

/// The origin of a run.
pub struct Provenance<'a> {
    /// The command's options.
    pub options: &'a str,
    pub scale: &'a Scale,
    pub machine: &'a str,
    /// The folder of its pictures and numbers.
    pub folder: &'a str,
}

/// The page: all defaults, then each part.
pub fn page(parts: &[Part], made: &Provenance, figures: &[Figure]) -> Document {
    let mut document = Document::new("What accuracy costs in time");
    document.text("The defaults, with the range of their errors and costs over the settings measured:");
    summary(&mut document, parts);
    document.text(&format!(
        "In each plot **down** is more exact and **left** is quicker. The grey band is the *Pareto front*: variants that no other beats in \
         both error and time. Full dots are on it, empty dots are beaten, arrows are upper bounds, and a ring marks the default. Times are \
         multiples (×) of the baseline's. All variants of a plot run alternately, {} turns each; the plots show the ratio's median and \
         quartiles over the turns.",
        made.scale.turns
    ));
    document.text(&format!(
        "Measured with `cargo run --release -- accuracy{}` on: {}. Other pages give times of other runs: compare ratios, not times.",
        made.options, made.machine
    ));
    for (part, figure) in parts.iter().zip(figures) {
        document.heading(&part.title);
        let stem = format!("{}/{}", made.folder, figure.name);
        let caption = format!("[vector graphic]({stem}.svg), [all numbers]({stem}.csv)");
        document.picture(&stem, &caption, &figure.drawing.svg);
        document.text(&format!("**Default.** {}", part.default));
        document.text(&format!("**Variants.** {}", part.method));
        document.text(&format!("**Reference.** {}", part.reference));
    }
    document
}

/// Lists each part's default, over its diagrams with the same quantities as the first.
fn summary(document: &mut Document, parts: &[Part]) {
    let rows = parts.iter().filter_map(|part| {
        let first = part.diagrams.first()?;
        let same = part
            .diagrams
            .iter()
            .filter(|other| other.error == first.error && other.cost_unit == first.cost_unit);
        let defaults: Vec<&Point> = same.filter_map(default).collect();
        let name = &defaults.first()?.variant;
        Some(vec![
            format!("[{}](#{})", part.title, part.title.to_lowercase().replace(' ', "-")),
            name.clone(),
            format!("{}: {}", measure(first), span(&defaults, |point| point.error, bare)),
            span(&defaults, |point| point.cost.median, |point| cost(first, point)),
        ])
    });
    document.table(&["", "default", "error", "cost"], rows);
}

/// The default; of several, the baseline.
fn default(diagram: &Diagram) -> Option<&Point> {
    let mut defaults = diagram.points.iter().filter(|point| point.is_default);
    let first = defaults.clone().next();
    defaults.find(|point| point.is_baseline).or(first)
}

/// The error's quantity and unit.
fn measure(diagram: &Diagram) -> String {
    match diagram.error_unit.as_str() {
        "" => diagram.error.clone(),
        unit => format!("{} ({unit})", diagram.error),
    }
}

/// The range of the points' values, as text.
fn span(points: &[&Point], by: fn(&Point) -> f64, text: impl Fn(&Point) -> String) -> String {
    let order = |a: &&&Point, b: &&&Point| by(a).total_cmp(&by(b));
    let ends = [points.iter().min_by(order), points.iter().max_by(order)];
    let [low, high] = ends.map(|end| end.map_or_else(String::new, |point| text(point)));
    if low == high { low } else { format!("{low} to {high}") }
}

/// An error without its interval.
fn bare(point: &Point) -> String {
    let bound = if point.at_most { "< " } else { "" };
    format!("{bound}{}", digits(point.error))
}

fn cost(diagram: &Diagram, point: &Point) -> String {
    match diagram.cost_unit {
        CostUnit::Ns => time(point.cost.median),
        CostUnit::Instructions => format!("{} instructions", short(point.cost.median.round())),
        CostUnit::Cycles => format!("{} cycles", short(point.cost.median.round())),
    }
}
