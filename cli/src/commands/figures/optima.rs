//! Figure 21: the best L2A over interval and distance, and its range over the distances.

use plotters::prelude::*;
use studies::optimum::RANGE;
use studies::reproduction::BestRatio;
use studies::reproduction::Findings;
use studies::reproduction::Study;
use studies::statistics::Estimate;

use super::chart::{Axis, COLOURS, Chart, Curve, Mark, Place, TEXT_PX, draw, plane};
use super::figure::{Figure, csv};
use crate::plot::{self, FONT, Surface};

/// Draws it, if all best ratios are known.
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
    let svg = plot::svg((900, 400), |surface| {
        let (left, right) = surface.split_horizontally(500);
        draw(&left, &over_distance(intervals, distances, &rows))?;
        ranges(&right, intervals, &rows)
    })?;
    let numbers = intervals.iter().zip(&rows).flat_map(|(interval, row)| {
        distances.iter().zip(row).map(move |(distance, best)| {
            let Estimate { value, low, high } = best.l2a;
            let numbers = [*interval, *distance, value, low, high, best.b2w];
            let mut cells = numbers.map(|number| number.to_string()).to_vec();
            cells.push(u8::from(best.at_border).to_string());
            cells
        })
    });
    let head = [
        "interval",
        "distance_m",
        "l2a",
        "l2a_low",
        "l2a_high",
        "b2w",
        "at_border",
    ];
    Ok(Some(Figure {
        name: "figure-21",
        caption: "The L2A of the greatest B2W: over the distance for each interval (a), and its range over the distances with their mean, which figure 22 uses (b). Rings: where the range of L2A ends, the best may lie beyond.".into(),
        csv: csv(&head, numbers),
        svg,
    }))
}

fn over_distance(intervals: &[f64], distances: &[f64], rows: &[Vec<&BestRatio>]) -> Chart {
    let curve = |((interval, row), colour): ((&f64, &Vec<&BestRatio>), &RGBColor)| Curve {
        name: format!("interval {interval}"),
        colour: *colour,
        places: distances
            .iter()
            .zip(row)
            .map(|(&x, best)| Place {
                x,
                y: best.l2a,
                mark: if best.at_border {
                    Mark::End
                } else {
                    Mark::Known
                },
            })
            .collect(),
    };
    let ends = [distances[0] - 2.0, distances[distances.len() - 1] + 2.0];
    Chart {
        title: "(a) best L2A".into(),
        x: Axis::linear("distance (m)", ends),
        y: Axis::linear("best L2A", [0.0, RANGE[1] + 1.6]),
        curves: intervals
            .iter()
            .zip(rows)
            .zip(&COLOURS)
            .map(curve)
            .collect(),
        legend: SeriesLabelPosition::UpperMiddle,
    }
}

fn ranges(surface: &Surface, intervals: &[f64], rows: &[Vec<&BestRatio>]) -> anyhow::Result<()> {
    let x = Axis::linear(
        "interval (gap / diameter)",
        [intervals[0] - 0.3, intervals[intervals.len() - 1] + 0.3],
    );
    let y = Axis::linear("best L2A, all distances", [0.0, RANGE[1] + 1.6]);
    let mut plane = plane(surface, "(b) range over the distances", &x, &y)?;
    for ((&interval, row), colour) in intervals.iter().zip(rows).zip(COLOURS) {
        let values = || row.iter().map(|best| best.l2a.value);
        let (low, high) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        let mean = values().sum::<f64>() / row.len() as f64;
        let bar = [(interval - 0.1, low), (interval + 0.1, high)];
        plane.draw_series([
            Rectangle::new(bar, colour.mix(0.35).filled()),
            Rectangle::new(bar, colour.stroke_width(1)),
        ])?;
        plane.draw_series([PathElement::new(
            vec![(interval - 0.1, mean), (interval + 0.1, mean)],
            colour.stroke_width(3),
        )])?;
        plane.draw_series([EmptyElement::at((interval, high))
            + Text::new(format!("{mean:.2}"), (-14, -22), (FONT, TEXT_PX))])?;
    }
    Ok(())
}
