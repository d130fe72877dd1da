//! Figures 8, 12, 15 and 18: rows of pictures.

use studies::reproduction::{DAYLIGHT, PAIR_LUMINANCE_CD_M2, Picture, Study, pair_picture, panel_picture};

use super::variation::Variation;
use crate::plot;
use crate::report::figure::{Figure, csv};

/// A picture with its caption and its key in the numbers.
struct Panel {
    picture: Picture,
    words: Vec<String>,
    key: f64,
}

/// Panels at some values of the varied quantity.
pub fn figure(study: &Study, name: &'static str, caption: &str, variation: &Variation, values: &[f64]) -> anyhow::Result<Figure> {
    let panel = |&key: &f64| {
        Ok(Panel {
            picture: panel_picture(&(variation.at)(key).scene(&study.scene), study.seed)?,
            words: vec![(variation.words)(key)],
            key,
        })
    };
    let panels: Vec<Panel> = values.iter().map(panel).collect::<anyhow::Result<_>>()?;
    row(name, caption, variation.key, &panels, 220)
}

/// Two LEDs from strong sun to twilight.
pub fn daylight(study: &Study) -> anyhow::Result<Figure> {
    let panel = |&(condition, illuminance_lx): &(&str, f64)| {
        let (picture, l2a) = pair_picture(&study.scene, illuminance_lx)?;
        let words = vec![condition.to_string(), format!("{illuminance_lx} lx, L2A {}", two_digits(l2a))];
        let key = illuminance_lx;
        Ok(Panel { picture, words, key })
    };
    let panels: Vec<Panel> = DAYLIGHT.iter().map(panel).collect::<anyhow::Result<_>>()?;
    let caption = format!(
        "Two LEDs of one panel at 50 m, the left one Off, the right one On at {PAIR_LUMINANCE_CD_M2} cd/m², as the \
         ambient light fades and the exposure follows it."
    );
    row("figure-08", &caption, "illuminance_lx", &panels, 190)
}

/// Formats a number to two significant digits.
fn two_digits(number: f64) -> String {
    let digits = (1 - number.abs().log10().floor() as i32).max(0) as usize;
    format!("{number:.digits$}")
}

fn row(name: &'static str, caption: &str, key: &str, panels: &[Panel], width_px: i32) -> anyhow::Result<Figure> {
    let pictures = panels.iter().map(|panel| plot::Picture {
        grey: &panel.picture.grey,
        width: panel.picture.width,
        words: panel.words.clone(),
    });
    let drawing = plot::row(&pictures.collect::<Vec<_>>(), width_px)?;
    let rows = panels.iter().flat_map(|panel| {
        let width = panel.picture.width.max(1);
        let pixel = move |(k, grey): (usize, &u8)| {
            [panel.key, (k / width) as f64, (k % width) as f64, f64::from(*grey)]
                .map(|number| number.to_string())
                .to_vec()
        };
        panel.picture.grey.iter().enumerate().map(pixel)
    });
    Ok(Figure {
        name,
        caption: caption.into(),
        csv: csv(&[key, "row", "column", "grey"], rows)?,
        drawing,
    })
}
