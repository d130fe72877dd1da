//! Figures 8, 12, 15 and 18: rows of pictures.

use studies::reproduction::{
    DAYLIGHT, DISTANCE_M, INTERVAL, L2A, OperatingPoint, PAIR_LUMINANCE_CD_M2, Picture, Study, pair_picture, panel_picture,
};

use crate::plot;
use crate::report::figure::{Figure, csv};

/// A picture with what is written under it, and what tells it from the others in the numbers.
struct Shown {
    picture: Picture,
    words: Vec<String>,
    key: f64,
}

/// Panels at L2A 0.2, 1, 2 and 4.
pub fn over_l2a(study: &Study) -> anyhow::Result<Figure> {
    let at = |l2a| OperatingPoint {
        interval: INTERVAL,
        distance_m: DISTANCE_M,
        l2a,
    };
    let shown = [0.2, 1.0, 2.0, 4.0].map(|l2a| (at(l2a), format!("L2A {l2a}"), l2a));
    let caption = "The same bits at L2A 0.2, 1, 2 and 4: interval 1, 50 m.";
    panels(study, "figure-12", caption, "l2a", &shown)
}

/// Panels at intervals 0.5 to 2.
pub fn over_interval(study: &Study) -> anyhow::Result<Figure> {
    let at = |interval| OperatingPoint {
        interval,
        distance_m: DISTANCE_M,
        l2a: L2A,
    };
    let shown = [0.5, 1.0, 1.5, 2.0].map(|i| (at(i), format!("interval {i}"), i));
    let caption = "The same bits at intervals 0.5, 1, 1.5 and 2, zoomed to the same size: L2A 1, 50 m.";
    panels(study, "figure-15", caption, "interval", &shown)
}

/// Panels at 30, 50 and 70 m.
pub fn over_distance(study: &Study) -> anyhow::Result<Figure> {
    let at = |distance_m| OperatingPoint {
        interval: INTERVAL,
        distance_m,
        l2a: L2A,
    };
    let shown = [30.0, 50.0, 70.0].map(|d| (at(d), format!("{d} m"), d));
    let caption = "The same bits at 30, 50 and 70 m, zoomed to the same size: L2A 1, interval 1.";
    panels(study, "figure-18", caption, "distance_m", &shown)
}

fn panels(
    study: &Study,
    name: &'static str,
    caption: &str,
    key: &str,
    settings: &[(OperatingPoint, String, f64)],
) -> anyhow::Result<Figure> {
    let shown = settings
        .iter()
        .map(|(setting, words, key)| {
            Ok(Shown {
                picture: panel_picture(&setting.scene(&study.scene), study.seed)?,
                words: vec![words.clone()],
                key: *key,
            })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    row(name, caption, key, &shown, 220)
}

/// Two LEDs from strong sun to twilight.
pub fn daylight(study: &Study) -> anyhow::Result<Figure> {
    let shown = DAYLIGHT
        .iter()
        .map(|&(condition, illuminance_lx)| {
            let (picture, l2a) = pair_picture(&study.scene, illuminance_lx)?;
            let words = vec![condition.to_string(), format!("{illuminance_lx} lx, L2A {}", two_digits(l2a))];
            Ok(Shown {
                picture,
                words,
                key: illuminance_lx,
            })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let caption = format!(
        "Two LEDs of one panel at 50 m, the left one Off, the right one On at {PAIR_LUMINANCE_CD_M2} cd/m², as the \
         ambient light fades and the exposure follows it."
    );
    row("figure-08", &caption, "illuminance_lx", &shown, 190)
}

/// A number to two significant digits.
fn two_digits(number: f64) -> String {
    let digits = (1 - number.abs().log10().floor() as i32).max(0) as usize;
    format!("{number:.digits$}")
}

fn row(name: &'static str, caption: &str, key: &str, shown: &[Shown], width_px: i32) -> anyhow::Result<Figure> {
    let pictures = shown.iter().map(|shown| plot::Picture {
        grey: &shown.picture.grey,
        width: shown.picture.width,
        words: shown.words.clone(),
    });
    let drawing = plot::row(&pictures.collect::<Vec<_>>(), width_px)?;
    let rows = shown.iter().flat_map(|shown| {
        let width = shown.picture.width.max(1);
        let pixel = move |(k, grey): (usize, &u8)| {
            [shown.key, (k / width) as f64, (k % width) as f64, f64::from(*grey)]
                .map(|number| number.to_string())
                .to_vec()
        };
        shown.picture.grey.iter().enumerate().map(pixel)
    });
    Ok(Figure {
        name,
        caption: caption.into(),
        csv: csv(&[key, "row", "column", "grey"], rows)?,
        drawing,
    })
}
