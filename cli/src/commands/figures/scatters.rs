//! Figures 13, 16 and 19: where On and Off LEDs lie in the plane of AGR and GRI.

use studies::reproduction::{DISTANCE_M, Feature, INTERVAL, L2A, OperatingPoint, Study, scatter};

use crate::plot::{Axis, Chart, Line, Mark, OFF, ON, Page, Point, RGBColor, Series};
use crate::report::figure::{Figure, csv};

/// Frames of a cloud, as in the paper.
const FRAMES: u64 = 10;

/// At low, mid and high L2A.
pub fn over_l2a(study: &Study) -> anyhow::Result<Figure> {
    let at = |l2a| OperatingPoint {
        interval: INTERVAL,
        distance_m: DISTANCE_M,
        l2a,
    };
    let shown = [0.2, 2.0, 4.0].map(|l2a| (at(l2a), format!("L2A {l2a}"), l2a));
    let caption = "Features of the LEDs in ten frames at low, mid and high L2A: interval 1, 50 m.";
    clouds(study, "figure-13", caption, "l2a", &shown)
}

/// At intervals 0.5 to 2.
pub fn over_interval(study: &Study) -> anyhow::Result<Figure> {
    let at = |interval| OperatingPoint {
        interval,
        distance_m: DISTANCE_M,
        l2a: L2A,
    };
    let shown = [0.5, 1.0, 1.5, 2.0].map(|i| (at(i), format!("interval {i}"), i));
    let caption = "Features of the LEDs in ten frames at four intervals: L2A 1, 50 m.";
    clouds(study, "figure-16", caption, "interval", &shown)
}

/// At 30, 50 and 70 m.
pub fn over_distance(study: &Study) -> anyhow::Result<Figure> {
    let at = |distance_m| OperatingPoint {
        interval: INTERVAL,
        distance_m,
        l2a: L2A,
    };
    let shown = [30.0, 50.0, 70.0].map(|d| (at(d), format!("{d} m"), d));
    let caption = "Features of the LEDs in ten frames at three distances: L2A 1, interval 1.";
    clouds(study, "figure-19", caption, "distance_m", &shown)
}

fn clouds(
    study: &Study,
    name: &'static str,
    caption: &str,
    key: &str,
    settings: &[(OperatingPoint, String, f64)],
) -> anyhow::Result<Figure> {
    let clouds = settings
        .iter()
        .map(|(setting, ..)| Ok(scatter(&setting.scene(&study.scene), FRAMES, study.seed)?))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let all = || clouds.iter().flatten();
    let x = Axis::around("AGR", all().map(|f| f64::from(f.agr)));
    let y = Axis::around("GRI (grey levels)", all().map(|f| f64::from(f.gri)));
    let charts = settings.iter().zip(&clouds);
    let charts = charts.map(|((_, title, _), cloud)| Chart {
        title: title.clone(),
        x: x.clone(),
        y: y.clone(),
        series: vec![
            specks("Off", OFF, cloud.iter().filter(|feature| !feature.on)),
            specks("On", ON, cloud.iter().filter(|feature| feature.on)),
        ],
    });
    let columns = if settings.len() == 4 { 2 } else { 3 };
    let drawing = Page::new(charts.collect(), columns, (340, 330)).draw()?;
    let rows = settings.iter().zip(&clouds).flat_map(|((_, _, key), cloud)| {
        cloud.iter().map(move |feature: &Feature| {
            vec![
                key.to_string(),
                feature.frame.to_string(),
                feature.led.to_string(),
                u8::from(feature.on).to_string(),
                feature.agr.to_string(),
                feature.gri.to_string(),
            ]
        })
    });
    Ok(Figure {
        name,
        caption: caption.into(),
        csv: csv(&[key, "frame", "led", "on", "agr", "gri"], rows)?,
        drawing,
    })
}

fn specks<'a>(name: &str, colour: RGBColor, features: impl Iterator<Item = &'a Feature>) -> Series {
    let point = |feature: &Feature| Point {
        x: f64::from(feature.agr),
        y: f64::from(feature.gri),
        mark: Mark::Speck,
        ..Point::default()
    };
    Series {
        name: name.into(),
        colour,
        line: Line::None,
        points: features.map(point).collect(),
    }
}
