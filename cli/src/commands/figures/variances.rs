//! Figures 14, 17 and 20: Bvar, Wvar and B2W over L2A, interval and distance.

use studies::reproduction::{Batches, Findings, OperatingPoint, Study, Sums};
use studies::statistics::Estimate;

use crate::plot::{Axis, Chart, Line, OFF, ON, Page, Point, RGBColor, Series, colours};
use crate::report::figure::{Figure, csv};

/// Over L2A, with the grey levels that explain it.
pub fn over_l2a(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let about = About {
        name: "figure-14",
        caption: "Variances over L2A (interval 1, 50 m), and the grey levels at the centres of On and Off LEDs.",
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
    fn figure(&self, xs: &[f64], settings: &[OperatingPoint], findings: &Findings) -> anyhow::Result<Option<Figure>> {
        let points: Option<Vec<&Batches>> = settings.iter().map(|&setting| findings.point(setting)).collect();
        let Some(points) = points else {
            return Ok(None);
        };
        let of = |index: usize, name: &str, colour| series(xs, &points, index, name, colour);
        let names = ["Bvar", "Wvar", "B2W"];
        let colours = colours(&names);
        let own = |k: usize| vec![of(k, names[k], colours[k])];
        let mut charts = vec![
            self.chart(xs, names[0], "between-class variance", own(0)),
            self.chart(xs, names[1], "within-class variance", own(1)),
            self.chart(xs, names[2], "Bvar / Wvar", own(2)),
        ];
        if self.with_greys {
            let greys = vec![of(7, "On", ON), of(8, "Off", OFF)];
            charts.push(self.chart(xs, "at the centres of LEDs", "grey level", greys));
        }
        let columns = if self.with_greys { 2 } else { 3 };
        Ok(Some(Figure {
            name: self.name,
            caption: self.caption.into(),
            csv: numbers(self.key, xs, &points)?,
            drawing: Page::new(charts, columns, (370, 320)).draw()?,
        }))
    }

    fn chart(&self, xs: &[f64], title: &str, y: &str, series: Vec<Series>) -> Chart {
        let points = series.iter().flat_map(|series| &series.points);
        let highest = points.filter_map(|point| point.y_range).map(|[_, high]| high);
        Chart {
            title: title.into(),
            x: Axis::around(self.label, xs.iter().copied()),
            y: Axis::from_zero(y, highest),
            series,
        }
    }
}

/// A quantity of [`QUANTITIES`] over the points.
fn series(xs: &[f64], points: &[&Batches], index: usize, name: &str, colour: RGBColor) -> Series {
    let (_, quantity) = QUANTITIES[index];
    let point = |(&x, point): (&f64, &&Batches)| {
        let Estimate { value, low, high } = point.estimate(quantity);
        Point {
            x,
            y: value,
            y_range: Some([low, high]),
            ..Point::default()
        }
    };
    Series {
        name: name.into(),
        colour,
        line: Line::Band,
        points: xs.iter().zip(points).map(point).collect(),
    }
}

fn numbers(key: &str, xs: &[f64], points: &[&Batches]) -> anyhow::Result<String> {
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
