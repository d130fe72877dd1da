//! The plot beside a sweep: bit error rates over the key that has the most numbers.

use studies::sweep::{Results, Summary, Sweep};

use crate::plot::{Axis, COLOURS, Chart, Drawing, Line, Page, Point, Series};

/// Pixels of one chart across and down.
const SIZE_PX: (i32, i32) = (560, 420);
/// The most charts and the most curves in each; the table has all cells.
const MOST_CHARTS: usize = 4;
const MOST_CURVES: usize = 7;
/// The least rate that is drawn.
const LEAST: f64 = 1e-12;

/// One chart a detector, one curve for each setting of the other keys; nothing where no key has numbers.
///
/// # Errors
/// When it cannot be drawn.
pub fn draw(results: &Results) -> anyhow::Result<Option<Drawing>> {
    let sweep = results.sweep();
    let Some((key, places)) = abscissa(sweep) else {
        return Ok(None);
    };
    let cells: Vec<Summary> = (0..sweep.cells())
        .map(|cell| results.summary(cell))
        .collect();
    let known = cells.iter().filter(|cell| cell.frames > 0);
    let least = known
        .map(|cell| lowest(cell).max(LEAST))
        .fold(1e-1, f64::min);
    let rate = Axis::logarithmic("bit error rate", [10f64.powf(least.log10().floor()), 1.0]);
    let detectors = &sweep.detectors[..sweep.detectors.len().min(MOST_CHARTS)];
    let charts = detectors.iter().map(|detector| {
        let cells = cells.iter().filter(|cell| cell.detector == detector.name());
        Chart {
            title: detector.name().into(),
            x: Axis::around(&sweep.grid[key].key, places.iter().copied()),
            y: rate.clone(),
            series: series(sweep, key, &places, cells.collect()),
        }
    });
    let page = Page::new(charts.collect(), detectors.len(), SIZE_PX);
    page.draw().map(Some)
}

/// The axis with the most values that are all numbers, and these.
fn abscissa(sweep: &Sweep) -> Option<(usize, Vec<f64>)> {
    let numbers = |axis: &studies::sweep::Axis| {
        let values = axis.values.iter().map(|value| value.parse().ok());
        values.collect::<Option<Vec<f64>>>()
    };
    let axes = sweep.grid.iter().enumerate();
    axes.filter_map(|(place, axis)| Some((place, numbers(axis)?)))
        .max_by_key(|(place, values)| (values.len(), std::cmp::Reverse(*place)))
}

/// The lowest rate that a cell is drawn at.
fn lowest(cell: &Summary) -> f64 {
    if cell.bit_errors == 0 {
        cell.ber_95[1]
    } else {
        cell.ber_95[0].max(cell.ber / 10.0)
    }
}

fn series(sweep: &Sweep, key: usize, places: &[f64], cells: Vec<&Summary>) -> Vec<Series> {
    let mut series: Vec<Series> = Vec::new();
    for cell in cells {
        let name = name(sweep, key, cell);
        let number = series.iter().position(|series| series.name == name);
        let number = number.unwrap_or_else(|| {
            series.push(Series {
                name,
                colour: COLOURS[series.len() % COLOURS.len()],
                line: Line::Band,
                points: Vec::new(),
            });
            series.len() - 1
        });
        let values = &sweep.grid[key].values;
        let at = values.iter().position(|value| *value == cell.values[key]);
        if let (Some(at), true) = (at, cell.frames > 0) {
            let point = Point::rate(places[at], cell.ber, cell.ber_95, cell.bit_errors);
            series[number].points.push(point);
        }
    }
    series.truncate(MOST_CURVES);
    for series in &mut series {
        series.points.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    series
}

/// A curve's settings: the other keys that vary.
fn name(sweep: &Sweep, key: usize, cell: &Summary) -> String {
    let axes = sweep.grid.iter().zip(&cell.values).enumerate();
    let others = axes.filter(|(place, (axis, _))| *place != key && axis.values.len() > 1);
    let names = others.map(|(_, (axis, value))| {
        let word = axis.key.rsplit('.').next().unwrap_or(&axis.key);
        format!("{word} {value}")
    });
    names.collect::<Vec<_>>().join(", ")
}
