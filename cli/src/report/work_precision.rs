//! The report's page: the choices, then each part's default, plot and method.

use studies::work_precision::{CostUnit, Diagram, Part, Point, Scale};

use super::document::Document;
use super::figure::Figure;
use crate::numbers::{digits, time};
use crate::plot::{Drawing, short};

/// The name of the overview's files.
pub const OVERVIEW: &str = "summary";

/// The origin of a run.
pub struct Provenance<'a> {
    /// The command's options.
    pub options: &'a str,
    pub scale: &'a Scale,
    pub machine: &'a str,
    /// The folder of its pictures and numbers.
    pub folder: &'a str,
}

/// The page: the choice in each part, an overview, then each part.
pub fn page(parts: &[Part], made: &Provenance, overview: Option<&Drawing>, figures: &[Figure]) -> Document {
    let mut document = Document::new("What accuracy costs in time");
    document.text(
        "Choose by the accuracy that you want and the time that you have. Each row is a step with alternatives. A cell has the error, the \
         time (3 ×: three times the default's) and, in brackets, the variant. If the quickest is also more exact than the default, the \
         default has another reason, given below.",
    );
    choices(&mut document, parts);
    if let Some(overview) = overview {
        document.picture(
            &format!("{}/{OVERVIEW}", made.folder),
            "drawing a panel, and reading it.",
            &overview.svg,
        );
    }
    document.text(&format!(
        "In each plot **down** is more exact and **left** is quicker. The grey band is the *Pareto front*: variants that no other beats in \
         both. A ring marks the default, an arrow an error too small to measure (a rate of zero is drawn at half an error). Bars are 95 % \
         intervals (Gaffke 2005). Times are medians and quartiles of {} turns, in which all variants run alternately, over the time of the \
         variant that the axis names.",
        made.scale.turns
    ));
    document.text(&format!(
        "`cargo run --release -- accuracy{}` measures all of this, here on: {}. Other runs have other times: compare ratios.",
        made.options, made.machine
    ));
    for (part, figure) in parts.iter().zip(figures) {
        document.heading(&part.title);
        let stem = format!("{}/{}", made.folder, figure.name);
        let caption = format!("[vector graphic]({stem}.svg), [all numbers]({stem}.csv)");
        document.picture(&stem, &caption, &figure.drawing.svg);
        document.text(&format!("**Default.** {}", part.default_choice()));
        document.text(&format!("**Variants.** {} **Reference.** {}", part.method, part.reference));
    }
    document
}

/// Lists each part's choice: the ends of the front, and the default, in the diagram with the longest front.
fn choices(document: &mut Document, parts: &[Part]) {
    let rows = parts.iter().filter_map(|part| {
        let diagram = most_varied(&part.diagrams)?;
        let front = || diagram.points.iter().filter(|point| point.on_front);
        let quickest = front().min_by(|a, b| a.cost.median.total_cmp(&b.cost.median))?;
        let most_exact = front().min_by(|a, b| a.error.total_cmp(&b.error))?;
        let default = default(diagram)?;
        let unless_default = |point: &Point| {
            if are_alike(point, default) {
                "the default".into()
            } else {
                choice(diagram, point, default)
            }
        };
        let title = format!("[{}](#{})", part.title, part.title.to_lowercase().replace(' ', "-"));
        Some(vec![
            format!("{title}: {}", measure(diagram)),
            diagram.title.clone(),
            unless_default(quickest),
            choice(diagram, default, default),
            unless_default(most_exact),
        ])
    });
    document.table(&["step: error", "case", "quickest", "default", "most exact"], rows);
}

/// Whether two variants have the same error and the same time, to three digits and half a percent.
fn are_alike(point: &Point, default: &Point) -> bool {
    let is_as_quick = (point.cost.median / default.cost.median - 1.0).abs() < 0.005;
    is_as_quick && digits(point.error) == digits(default.error)
}

/// Of the diagrams with the first one's error and unit of cost, the one with the most variants on its front; of several, the first.
fn most_varied(diagrams: &[Diagram]) -> Option<&Diagram> {
    let first = diagrams.first()?;
    let on_front = |diagram: &&Diagram| diagram.points.iter().filter(|point| point.on_front).count();
    diagrams
        .iter()
        .rev()
        .filter(|diagram| diagram.cost_unit == first.cost_unit && diagram.error == first.error)
        .max_by_key(on_front)
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

/// A variant's error without the interval, its cost relative to the default's, and its name. A rate of zero is no bound.
fn choice(diagram: &Diagram, point: &Point, default: &Point) -> String {
    let error = match (point.at_most, diagram.error_unit.is_empty()) {
        (true, true) => "none seen".into(),
        (true, false) => format!("< {}", digits(point.error)),
        (false, _) => digits(point.error),
    };
    let spent = if point == default {
        cost(diagram, point)
    } else {
        format!("{} ×", digits(point.cost.median / default.cost.median))
    };
    format!("**{error}** in {spent} ({})", point.variant)
}

fn cost(diagram: &Diagram, point: &Point) -> String {
    match diagram.cost_unit {
        CostUnit::Ns => time(point.cost.median),
        CostUnit::Instructions => format!("{} instructions", short(point.cost.median.round())),
        CostUnit::Cycles => format!("{} cycles", short(point.cost.median.round())),
    }
}
