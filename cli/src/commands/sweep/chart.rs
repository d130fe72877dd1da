//! The plot beside a sweep: bit error rates over the key that has the most numbers.

use plotters::prelude::*;
use studies::statistics::Estimate;
use studies::sweep::{Results, Summary, Sweep};

use crate::commands::figures::chart::{Axis, COLOURS, Chart, Curve, Mark, Place, draw};
use crate::plot::svg as draw_svg;

/// Pixels of one chart across and down.
const SIZE: (u32, u32) = (560, 420);
/// The most charts and the most curves in each; the table has all cells.
const MOST_CHARTS: usize = 4;
const MOST_CURVES: usize = 7;
/// The least rate that is drawn.
const LEAST: f64 = 1e-12;

/// One chart a detector, one curve for each setting of the other keys; nothing where no key has numbers.
///
/// # Errors
/// When it cannot be drawn.
pub fn svg(results: &Results) -> anyhow::Result<Option<String>> {
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
    let across = (SIZE.0 * detectors.len() as u32, SIZE.1);
    let document = draw_svg(across, |surface| {
        let parts = surface.split_evenly((1, detectors.len()));
        for (part, detector) in parts.iter().zip(detectors) {
            let cells = cells.iter().filter(|cell| cell.detector == detector.name());
            let chart = Chart {
                title: detector.name().into(),
                x: Axis::linear(&sweep.grid[key].key, ends(&places)),
                y: Axis {
                    label: rate.label.clone(),
                    ..rate
                },
                curves: curves(sweep, key, &places, cells.collect()),
                legend: SeriesLabelPosition::LowerRight,
            };
            draw(part, &chart)?;
        }
        Ok(())
    })?;
    Ok(Some(document))
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

fn ends(places: &[f64]) -> [f64; 2] {
    let low = places.iter().copied().fold(f64::INFINITY, f64::min);
    let high = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let room = 0.04 * (high - low).max(0.1 * high.abs()).max(1e-9);
    [low - room, high + room]
}

/// The lowest rate that a cell is drawn at.
fn lowest(cell: &Summary) -> f64 {
    if cell.bit_errors == 0 {
        cell.ber_95[1]
    } else {
        cell.ber_95[0].max(cell.ber / 10.0)
    }
}

fn curves(sweep: &Sweep, key: usize, places: &[f64], cells: Vec<&Summary>) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for cell in cells {
        let name = name(sweep, key, cell);
        let number = curves.iter().position(|curve| curve.name == name);
        let number = number.unwrap_or_else(|| {
            curves.push(Curve {
                name,
                colour: COLOURS[curves.len() % COLOURS.len()],
                places: Vec::new(),
            });
            curves.len() - 1
        });
        let at = sweep.grid[key]
            .values
            .iter()
            .position(|value| *value == cell.values[key]);
        if let (Some(at), true) = (at, cell.frames > 0) {
            curves[number].places.push(place(places[at], cell));
        }
    }
    curves.truncate(MOST_CURVES);
    for curve in &mut curves {
        curve.places.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    curves
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

fn place(x: f64, cell: &Summary) -> Place {
    let [low, high] = cell.ber_95;
    Place {
        x,
        y: Estimate {
            value: cell.ber,
            low,
            high,
        },
        mark: if cell.bit_errors == 0 {
            Mark::Bound
        } else {
            Mark::Known
        },
    }
}
