//! Figures 14, 17 and 20: Bvar, Wvar and B2W over L2A, interval and distance.

use studies::reproduction::{Batches, Findings, OperatingPoint, Sums};
use studies::statistics::Estimate;

use super::variation::Variation;
use crate::plot::{Axis, Chart, EDGE, Line, OFF, ON, Page, Point, RGBColor, Series, colours};
use crate::report::figure::{Figure, csv};

/// A quantity from the sums of a point.
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

/// The variances along an axis, if all are known; optionally with the grey levels that explain them.
pub fn figure(
    findings: &Findings,
    (name, caption): (&'static str, &str),
    variation: &Variation,
    (xs, settings): (&[f64], &[OperatingPoint]),
    with_greys: bool,
) -> anyhow::Result<Option<Figure>> {
    let points: Option<Vec<&Batches>> = settings.iter().map(|&setting| findings.point(setting)).collect();
    let Some(points) = points else {
        return Ok(None);
    };
    let of = |index: usize, name: &str, colour| series(xs, &points, index, name, colour);
    let names = ["Bvar", "Wvar", "B2W"];
    let colours = colours(&names);
    let own = |k: usize| vec![of(k, names[k], colours[k])];
    let mut charts = vec![
        chart(variation, xs, names[0], "between-class variance", own(0)),
        chart(variation, xs, names[1], "within-class variance", own(1)),
        chart(variation, xs, names[2], "Bvar / Wvar", own(2)),
    ];
    if with_greys {
        let greys = vec![of(7, "On", ON), of(8, "Off", OFF)];
        charts.push(chart(variation, xs, "at the centres of LEDs", "grey level", greys));
    }
    let columns = if with_greys { 2 } else { 3 };
    Ok(Some(Figure {
        name,
        caption: caption.into(),
        csv: numbers(variation.key, xs, &points)?,
        drawing: Page::new(charts, columns, (370, 320)).draw()?,
    }))
}

fn chart(variation: &Variation, xs: &[f64], title: &str, y: &str, mut series: Vec<Series>) -> Chart {
    let points = series.iter().flat_map(|series| &series.points);
    let highest: Vec<f64> = points.filter_map(|point| point.y_range).map(|[_, high]| high).collect();
    let top = highest.iter().copied().fold(0.0, f64::max);
    let of_quantity = variation.stated.iter().filter(|(quantity, ..)| *quantity == title);
    series.extend(of_quantity.map(|&(_, x, words)| Series::straight(words, EDGE, [[x, 0.0], [x, top]])));
    Chart {
        title: title.into(),
        x: Axis::around(variation.label, xs.iter().copied()),
        y: Axis::from_zero(y, highest.into_iter()),
        series,
    }
}

/// A quantity of [`QUANTITIES`] over the points.
fn series(xs: &[f64], points: &[&Batches], index: usize, name: &str, colour: RGBColor) -> Series {
    let (_, quantity) = QUANTITIES[index];
    let point = |(&x, point): (&f64, &&Batches)| {
        let Estimate { value, low, high } = point.estimate(quantity);
        Point::within(x, value, [low, high])
    };
    Series::new(name, colour, Line::Band, xs.iter().zip(points).map(point).collect())
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
