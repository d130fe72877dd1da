//! Figures 13, 16 and 19: On and Off LEDs in the plane of AGR and GRI.

use studies::reproduction::{Feature, Study, scatter};

use super::variation::Variation;
use crate::plot::{Axis, Chart, Line, Mark, OFF, ON, Page, Point, RGBColor, Series};
use crate::report::figure::{Figure, csv};

/// Frames per cloud, as in the paper.
const FRAMES: u64 = 10;

/// Clouds at some values of the varied quantity.
pub fn figure(study: &Study, name: &'static str, caption: &str, variation: &Variation, values: &[f64]) -> anyhow::Result<Figure> {
    let cloud = |&value: &f64| Ok(scatter(&(variation.at)(value).scene(&study.scene), FRAMES, study.seed)?);
    let clouds: Vec<Vec<Feature>> = values.iter().map(cloud).collect::<anyhow::Result<_>>()?;
    let all = || clouds.iter().flatten();
    let x = Axis::around("AGR", all().map(|f| f64::from(f.agr)));
    let y = Axis::around("GRI (grey levels)", all().map(|f| f64::from(f.gri)));
    let charts = values.iter().zip(&clouds);
    let charts = charts.map(|(&value, cloud)| Chart {
        title: (variation.words)(value),
        x: x.clone(),
        y: y.clone(),
        series: vec![
            specks("Off", OFF, cloud.iter().filter(|feature| !feature.on)),
            specks("On", ON, cloud.iter().filter(|feature| feature.on)),
        ],
    });
    let columns = if values.len() == 4 { 2 } else { 3 };
    let drawing = Page::new(charts.collect(), columns, (340, 330)).draw()?;
    let rows = values.iter().zip(&clouds).flat_map(|(key, cloud)| {
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
        csv: csv(&[variation.key, "frame", "led", "on", "agr", "gri"], rows)?,
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
    Series::new(name, colour, Line::None, features.map(point).collect())
}
