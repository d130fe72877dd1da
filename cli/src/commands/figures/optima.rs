//! Figure 21: the best L2A over interval and distance, and its range over the distances.

use studies::optimum::RANGE;
use studies::reproduction::paper::BEST_L2A;
use studies::reproduction::{BestRatio, Findings, OperatingPoint, Study};
use studies::statistics::Estimate;

use crate::plot::{Axis, Chart, EDGE, Line, Mark, Page, Point, Series, colours};
use crate::report::figure::{Figure, csv};

/// The charts' upper end, above the searched range to leave space for the legend.
const TOP: f64 = RANGE[1] + 2.2;

/// Draws the figure, if all best ratios are known.
pub fn figure(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let (intervals, distances) = (&study.axes.optimum_interval, &study.axes.optimum_distance_m);
    let rows: Option<Vec<Vec<&BestRatio>>> = intervals
        .iter()
        .map(|&interval| {
            let along = distances.iter();
            along.map(|&d| findings.optimum(interval, d)).collect()
        })
        .collect();
    let Some(rows) = rows else {
        return Ok(None);
    };
    let charts = vec![over_distance(intervals, distances, &rows), ranges(intervals, &rows)];
    let numbers = intervals.iter().zip(&rows).flat_map(|(interval, row)| {
        distances.iter().zip(row).map(move |(distance, best)| {
            let Estimate { value, low, high } = best.l2a;
            let numbers = [*interval, *distance, value, low, high, best.b2w];
            let mut cells = numbers.map(|number| number.to_string()).to_vec();
            cells.push(u8::from(best.at_border).to_string());
            cells
        })
    });
    let head = ["interval", "distance_m", "l2a", "l2a_low", "l2a_high", "b2w", "at_border"];
    Ok(Some(Figure {
        name: "figure-21",
        caption: "The L2A of the greatest B2W: over the distance for each interval (a), and its range over the distances with their mean, \
                  which figure 22 uses (b). Rings: where the range of L2A ends, the best may lie beyond. The bar is the paper's number."
            .into(),
        csv: csv(&head, numbers)?,
        drawing: Page::new(charts, 2, (460, 400)).draw()?,
    }))
}

fn over_distance(intervals: &[f64], distances: &[f64], rows: &[Vec<&BestRatio>]) -> Chart {
    let point = |(&x, best): (&f64, &&BestRatio)| Point {
        x,
        y: best.l2a.value,
        y_range: Some([best.l2a.low, best.l2a.high]),
        mark: if best.at_border { Mark::Ring } else { Mark::Dot },
        ..Point::default()
    };
    let names = names(intervals);
    let series = names.iter().zip(rows).zip(colours(&names));
    let series = series.map(|((name, row), colour)| Series::new(name, colour, Line::Band, distances.iter().zip(row).map(point).collect()));
    Chart {
        title: "(a) best L2A".into(),
        x: Axis::around("distance (m)", distances.iter().copied()),
        y: Axis::linear("best L2A", [0.0, TOP]),
        series: series.chain([stated()]).collect(),
    }
}

/// The best L2A that the paper states for one interval and distance.
fn stated() -> Series {
    let at = OperatingPoint::REFERENCE;
    let point = Point {
        x: at.distance_m,
        y: BEST_L2A,
        mark: Mark::Box,
        ..Point::default()
    };
    Series::new(format!("paper: interval {}", at.interval), EDGE, Line::None, vec![point])
}

fn names(intervals: &[f64]) -> Vec<String> {
    let names = intervals.iter();
    names.map(|interval| format!("interval {interval}")).collect()
}

fn ranges(intervals: &[f64], rows: &[Vec<&BestRatio>]) -> Chart {
    let point = |x: f64, row: &[&BestRatio]| {
        let values = || row.iter().map(|best| best.l2a.value);
        let mean = values().sum::<f64>() / row.len() as f64;
        Point {
            x,
            y: mean,
            y_range: Some([values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]),
            mark: Mark::Box,
            name: Some(format!("{mean:.2}")),
            ..Point::default()
        }
    };
    let series = intervals.iter().zip(rows).zip(colours(&names(intervals)));
    let series = series.map(|((&interval, row), colour)| Series::new("", colour, Line::None, vec![point(interval, row)]));
    let ends = [intervals[0] - 0.3, intervals[intervals.len() - 1] + 0.3];
    Chart {
        title: "(b) range over the distances".into(),
        x: Axis::linear("interval (gap / diameter)", ends),
        y: Axis::linear("best L2A, all distances", [0.0, TOP]),
        series: series.collect(),
    }
}
