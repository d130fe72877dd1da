//! Figures 14, 17 and 20: Bvar, Wvar and B2W over L2A, interval and distance.

use plotters::prelude::*;
use studies::reproduction::Findings;
use studies::reproduction::OperatingPoint;
use studies::reproduction::Study;
use studies::reproduction::{Batches, Sums};
use studies::statistics::Estimate;

use super::chart::{Axis, COLOURS, Chart, Curve, Mark, OFF, ON, Place, draw};
use super::figure::{Figure, csv};
use crate::plot;

/// Over L2A, with the grey levels that explain it.
pub fn over_l2a(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let about = About {
        name: "figure-14",
        caption: "Variances over L2A (interval 1, 50 m), and why Bvar levels off: one On LED after another comes to stand at 255.",
        label: "L2A",
        key: "l2a",
        with_greys: true,
    };
    about.figure(&study.axes.l2a, &study.over_l2a(), findings)
}

/// Over the interval.
pub fn over_interval(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let about = About {
        name: "figure-17",
        caption: "Variances over the interval (L2A 1, 50 m).",
        label: "interval (gap / diameter)",
        key: "interval",
        with_greys: false,
    };
    about.figure(&study.axes.interval, &study.over_interval(), findings)
}

/// Over the distance.
pub fn over_distance(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let about = About {
        name: "figure-20",
        caption: "Variances over the distance (L2A 1, interval 1).",
        label: "distance (m)",
        key: "distance_m",
        with_greys: false,
    };
    about.figure(&study.axes.distance_m, &study.over_distance(), findings)
}

/// What a figure is about.
struct About {
    name: &'static str,
    caption: &'static str,
    label: &'static str,
    key: &'static str,
    /// Whether grey levels are shown beside the variances.
    with_greys: bool,
}

/// A quantity of the sums of a point.
type Quantity = fn(&Sums) -> f64;

const QUANTITIES: [(&str, Quantity); 9] = [
    ("bvar", |s| s.distinguishability().bvar),
    ("wvar", |s| s.distinguishability().wvar),
    ("b2w", |s| s.distinguishability().b2w.unwrap_or(0.0)),
    ("agr_on", |s| s.on.mean()[0]),
    ("agr_off", |s| s.off.mean()[0]),
    ("gri_on", |s| s.on.mean()[1]),
    ("gri_off", |s| s.off.mean()[1]),
    ("grey_on", |s| s.on_grey.mean()[0]),
    ("grey_off", |s| s.off_grey.mean()[0]),
];

impl About {
    fn figure(
        &self,
        xs: &[f64],
        settings: &[OperatingPoint],
        findings: &Findings,
    ) -> anyhow::Result<Option<Figure>> {
        let points: Option<Vec<&Batches>> = settings
            .iter()
            .map(|&setting| findings.point(setting))
            .collect();
        let Some(points) = points else {
            return Ok(None);
        };
        let of = |index: usize, name: &str, colour| curve(xs, &points, index, name, colour);
        let mut charts = vec![
            self.chart(
                xs,
                "Bvar",
                "between-class variance",
                vec![of(0, "Bvar", COLOURS[0])],
            ),
            self.chart(
                xs,
                "Wvar",
                "within-class variance",
                vec![of(1, "Wvar", COLOURS[3])],
            ),
            self.chart(xs, "B2W", "Bvar / Wvar", vec![of(2, "B2W", COLOURS[2])]),
        ];
        if self.with_greys {
            let greys = vec![of(7, "On", ON), of(8, "Off", OFF)];
            charts.push(self.chart(xs, "at the centres of LEDs", "grey level", greys));
        }
        let columns = if self.with_greys { 2 } else { 3 };
        let rows = charts.len().div_ceil(columns);
        let svg = plot::svg((370 * columns as u32, 320 * rows as u32), |surface| {
            let parts = surface.split_evenly((rows, columns));
            parts
                .iter()
                .zip(&charts)
                .try_for_each(|(part, chart)| draw(part, chart))
        })?;
        Ok(Some(Figure {
            name: self.name,
            caption: self.caption.into(),
            csv: numbers(self.key, xs, &points),
            svg,
        }))
    }

    fn chart(&self, xs: &[f64], title: &str, y: &str, curves: Vec<Curve>) -> Chart {
        let end = |x: Option<&f64>| x.copied().unwrap_or(0.0);
        let highest = curves.iter().flat_map(|c| &c.places).map(|p| p.y.high);
        Chart {
            title: title.into(),
            x: Axis::linear(self.label, [end(xs.first()), end(xs.last())]),
            y: Axis::from_zero(y, highest),
            curves,
            legend: SeriesLabelPosition::LowerRight,
        }
    }
}

/// A quantity of [`QUANTITIES`] over the points.
fn curve(xs: &[f64], points: &[&Batches], index: usize, name: &str, colour: RGBColor) -> Curve {
    let (_, quantity) = QUANTITIES[index];
    let place = |(&x, point): (&f64, &&Batches)| Place {
        x,
        y: point.estimate(quantity),
        mark: Mark::Known,
    };
    Curve {
        name: name.into(),
        colour,
        places: xs.iter().zip(points).map(place).collect(),
    }
}

fn numbers(key: &str, xs: &[f64], points: &[&Batches]) -> String {
    let mut head = vec![key.to_string(), "frames".to_string()];
    for (name, _) in QUANTITIES {
        head.extend(["", "_low", "_high"].map(|end| format!("{name}{end}")));
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let rows = xs.iter().zip(points).map(|(x, point)| {
        let mut row = vec![x.to_string(), point.frames().to_string()];
        for (_, quantity) in QUANTITIES {
            let Estimate { value, low, high } = point.estimate(quantity);
            row.extend([value, low, high].map(|number| number.to_string()));
        }
        row
    });
    csv(&head, rows)
}
