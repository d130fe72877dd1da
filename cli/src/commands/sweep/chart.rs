//! The plot of a sweep: bit error rate over the key with the most numeric values.

use studies::detectors::DetectorChoice;
use studies::sweep::{Results, Summary, Sweep};

use crate::plot::{Axis, Chart, Drawing, Entry, Line, Mark, Page, Point, Series, colours};

/// Size of one chart in pixels: width, height.
const SIZE_PX: (i32, i32) = (560, 420);
/// Maximum number of charts; the table has all cells.
const MOST_CHARTS: usize = 4;
/// Maximum number of curves in a chart.
const MOST_CURVES: usize = 7;
/// Minimum rate drawn.
const LEAST: f64 = 1e-12;

/// One chart per detector, one curve per setting of the other keys; without other varying keys, one chart with a curve per detector. `None`
/// if no key has numbers.
pub fn draw(results: &Results) -> anyhow::Result<Option<Drawing>> {
    let sweep = results.sweep();
    let Some((key, places)) = abscissa(sweep) else {
        return Ok(None);
    };
    let cells: Vec<Summary> = (0..sweep.cells()).map(|cell| results.summary(cell)).collect();
    let rate = rate_axis(&cells);
    let chart = |title: &str, series: Vec<Series>| Chart {
        title: title.into(),
        x: Axis::around(&sweep.grid[key].key, places.iter().copied()),
        y: rate.clone(),
        series,
    };
    let of = |detector: &DetectorChoice| -> Vec<&Summary> {
        let cells = cells.iter();
        cells.filter(|cell| cell.detector == detector.name()).collect()
    };
    let is_alone = |(place, axis): (usize, &studies::sweep::Axis)| place == key || axis.values.len() < 2;
    let charts: Vec<Chart> = if sweep.grid.iter().enumerate().all(is_alone) {
        let detectors = sweep.detectors.iter();
        let curves = detectors.map(|detector| (detector.name().to_owned(), of(detector)));
        let title = match &sweep.detectors[..] {
            [detector] => detector.name(),
            _ => "",
        };
        vec![chart(title, series(sweep, key, &places, curves.collect()))]
    } else {
        let detectors = sweep.detectors.iter().take(MOST_CHARTS);
        let detectors = detectors.map(|detector| {
            let curves = by_setting(sweep, key, of(detector));
            chart(detector.name(), series(sweep, key, &places, curves))
        });
        detectors.collect()
    };
    let columns = charts.len();
    let page = Page {
        legend: vec![legend(&charts)],
        ..Page::new(charts, columns, SIZE_PX)
    };
    page.draw().map(Some)
}

/// The axis of rates, down to the lowest one drawn.
fn rate_axis(cells: &[Summary]) -> Axis {
    let known = cells.iter().filter(|cell| cell.frames > 0);
    let least = known.map(|cell| lowest(cell).max(LEAST)).fold(1e-1, f64::min);
    let name = if cells.iter().any(|cell| cell.frames_across > Some(0)) {
        "bit error rate, frames of one symbol"
    } else {
        "bit error rate"
    };
    Axis::logarithmic(name, [10f64.powf(least.log10().floor()), 1.0])
}

/// The legend common to all charts, with the arrow's meaning if there is one.
fn legend(charts: &[Chart]) -> Vec<Entry> {
    let series = charts.iter().flat_map(|chart| &chart.series);
    let bounds = |series: &Series| series.points.iter().any(|point| point.mark == Mark::AtMost);
    let has_bounds = series.clone().any(bounds);
    let mut shown: Vec<&Series> = Vec::new();
    for series in series.filter(|series| !series.name.is_empty()) {
        if !shown.iter().any(|other| other.name == series.name) {
            shown.push(series);
        }
    }
    let bound = has_bounds.then(|| Entry::of_mark("at most", Some(Mark::AtMost), false));
    shown.into_iter().map(Entry::of).chain(bound).collect()
}

/// The axis with the most values that are all numbers, and its values.
fn abscissa(sweep: &Sweep) -> Option<(usize, Vec<f64>)> {
    let numbers = |axis: &studies::sweep::Axis| {
        let values = axis.values.iter().map(|value| value.parse().ok());
        values.collect::<Option<Vec<f64>>>()
    };
    let axes = sweep.grid.iter().enumerate();
    axes.filter_map(|(place, axis)| Some((place, numbers(axis)?)))
        .max_by_key(|(place, values)| (values.len(), std::cmp::Reverse(*place)))
}

/// The lowest rate drawn for a cell.
fn lowest(cell: &Summary) -> f64 {
    let (rate, [low, high], errors) = cell.comparable();
    if errors == 0 { high } else { low.max(rate / 10.0) }
}

/// A curve's name and its cells.
type Curve<'a> = (String, Vec<&'a Summary>);

/// Groups cells by their settings of the other keys.
fn by_setting<'a>(sweep: &Sweep, key: usize, cells: Vec<&'a Summary>) -> Vec<Curve<'a>> {
    let mut curves: Vec<Curve> = Vec::new();
    for cell in cells {
        let name = name(sweep, key, cell);
        match curves.iter_mut().find(|(known, _)| *known == name) {
            Some((_, cells)) => cells.push(cell),
            None => curves.push((name, vec![cell])),
        }
    }
    curves
}

fn series(sweep: &Sweep, key: usize, places: &[f64], mut curves: Vec<Curve>) -> Vec<Series> {
    curves.truncate(MOST_CURVES);
    let values = &sweep.grid[key].values;
    let point = |cell: &&Summary| {
        let at = values.iter().position(|value| *value == cell.values[key])?;
        let (rate, interval, errors) = cell.comparable();
        (cell.frames > 0).then(|| Point::rate(places[at], rate, interval, errors))
    };
    let names: Vec<String> = curves.iter().map(|(name, _)| name.clone()).collect();
    let curves = curves.into_iter().zip(colours(&names));
    let curves = curves.map(|((name, cells), colour)| {
        let mut points: Vec<Point> = cells.iter().filter_map(point).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series::new(name, colour, Line::Band, points)
    });
    curves.collect()
}

/// A curve's name: its settings of the other varying keys.
fn name(sweep: &Sweep, key: usize, cell: &Summary) -> String {
    let axes = sweep.grid.iter().zip(&cell.values).enumerate();
    let others = axes.filter(|(place, (axis, _))| *place != key && axis.values.len() > 1);
    let names = others.map(|(_, (axis, value))| {
        let word = axis.key.rsplit('.').next().unwrap_or(&axis.key);
        format!("{word} {value}")
    });
    names.collect::<Vec<_>>().join(", ")
}
