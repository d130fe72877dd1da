//! Figure 22: bit error rates over the distance, with the best L2A and with a random one.

use plotters::prelude::*;
use studies::reproduction::Dimming;
use studies::reproduction::Findings;
use studies::reproduction::PAPERS_DETECTOR;
use studies::reproduction::Study;
use studies::statistics::Estimate;
use studies::statistics::FrameErrors;

use super::chart::{Axis, COLOURS, Chart, Curve, Mark, Place, draw};
use super::figure::{Figure, csv};
use crate::plot;

/// The paper's figure, with its detector.
pub fn figure(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let curves: Option<Vec<Curve>> = [
        (Dimming::Best, "best L2A for the interval", COLOURS[0]),
        (Dimming::Random, "random L2A, 0.2 to 4", COLOURS[1]),
    ]
    .into_iter()
    .map(|(dimming, name, colour)| curve(study, findings, PAPERS_DETECTOR, dimming, name, colour))
    .collect();
    let Some(curves) = curves else {
        return Ok(None);
    };
    let chart = chart(study, "k-means on (AGR, GRI)".into(), curves, floor(study));
    Ok(Some(Figure {
        name: "figure-22",
        caption: format!(
            "Bit error rate over the distance, intervals drawn from 0.5 to 2. {BOUND}"
        ),
        svg: plot::svg((620, 420), |surface| draw(surface, &chart))?,
        csv: numbers(study, findings, &[PAPERS_DETECTOR]),
    }))
}

const BOUND: &str =
    "Bands: 95 %, whole frames resampled. An arrow is the bound 3/frames where no bit was wrong.";

/// The same for all detectors.
pub fn detectors(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let charts: Option<Vec<Chart>> = [
        (Dimming::Best, "best L2A for the interval"),
        (Dimming::Random, "random L2A, 0.2 to 4"),
    ]
    .into_iter()
    .map(|(dimming, title)| {
        let detectors = study.axes.detectors.iter().zip(COLOURS.iter().cycle());
        let curves: Option<Vec<Curve>> = detectors
            .map(|(name, colour)| curve(study, findings, name, dimming, name, *colour))
            .collect();
        Some(chart(study, title.to_string(), curves?, floor(study)))
    })
    .collect();
    let Some(charts) = charts else {
        return Ok(None);
    };
    let svg = plot::svg((1000, 430), |surface| {
        let parts = surface.split_evenly((1, charts.len()));
        parts
            .iter()
            .zip(&charts)
            .try_for_each(|(part, chart)| draw(part, chart))
    })?;
    Ok(Some(Figure {
        name: "figure-22-detectors",
        caption: format!(
            "Figure 22 with every detector. Fisher's discriminants are trained on other frames of each interval, distance and L2A. {BOUND}"
        ),
        svg,
        csv: numbers(study, findings, &study.axes.detectors),
    }))
}

/// The least rate that the charts show: somewhat below the bound that the frames of a point can give.
fn floor(study: &Study) -> f64 {
    let frames = study.error_frames(PAPERS_DETECTOR) as f64;
    10f64.powf((1.0 / (64.0 * frames)).log10().floor())
}

fn chart(study: &Study, title: String, curves: Vec<Curve>, floor: f64) -> Chart {
    let distances = &study.axes.error_distance_m;
    let highest = curves.iter().flat_map(|c| &c.places).map(|p| p.y.high);
    let top = highest.fold(floor, f64::max).log10().ceil();
    Chart {
        title,
        x: Axis::linear(
            "distance (m)",
            [distances[0] - 3.0, distances[distances.len() - 1] + 3.0],
        ),
        // A decade of room for the legend.
        y: Axis::logarithmic("bit error rate", [floor, 10f64.powf(top + 1.0).min(1.0)]),
        curves,
        legend: SeriesLabelPosition::UpperLeft,
    }
}

fn curve(
    study: &Study,
    findings: &Findings,
    detector: &str,
    dimming: Dimming,
    name: &str,
    colour: RGBColor,
) -> Option<Curve> {
    let place = |&x: &f64| Some(place(x, findings.errors(x, dimming, detector)?));
    let places: Option<Vec<Place>> = study.axes.error_distance_m.iter().map(place).collect();
    Some(Curve {
        name: name.into(),
        colour,
        places: places?,
    })
}

fn place(x: f64, errors: &FrameErrors) -> Place {
    let [low, high] = errors.interval_95();
    let value = errors.rate();
    Place {
        x,
        y: Estimate { value, low, high },
        mark: if errors.errors() == 0 {
            Mark::Bound
        } else {
            Mark::Known
        },
    }
}

fn numbers(study: &Study, findings: &Findings, detectors: &[&str]) -> String {
    let head = [
        "detector",
        "dimming",
        "distance_m",
        "frames",
        "bits",
        "bit_errors",
        "ber",
        "ber_low",
        "ber_high",
    ];
    let mut rows = Vec::new();
    for detector in detectors {
        for (dimming, word) in [(Dimming::Best, "best"), (Dimming::Random, "random")] {
            for &distance_m in &study.axes.error_distance_m {
                let Some(errors) = findings.errors(distance_m, dimming, detector) else {
                    continue;
                };
                let [low, high] = errors.interval_95();
                let counts = [errors.frames(), errors.bits(), errors.errors()];
                let mut row = vec![detector.to_string(), word.into(), distance_m.to_string()];
                row.extend(counts.map(|count| count.to_string()));
                row.extend([errors.rate(), low, high].map(|rate| rate.to_string()));
                rows.push(row);
            }
        }
    }
    csv(&head, rows.into_iter())
}
