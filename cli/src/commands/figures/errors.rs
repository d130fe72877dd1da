//! Figure 22: bit error rate over distance, with the best L2A and with a random one.

use studies::reproduction::{Dimming, Findings, PAPERS_DETECTOR, Study};
use studies::statistics::FrameErrors;

use crate::plot::{Axis, Chart, Entry, Line, Mark, Page, Point, Series, colours};
use crate::report::figure::{Figure, csv};

const BEST: &str = "best L2A for the interval";
const RANDOM: &str = "random L2A, 0.2 to 4";
const BOUND: &str = "Bands: 95 %, of all that is drawn at random. An arrow is the bound 3.7/frames where no bit was wrong; where it is \
     that of several, their arrows hang on each other.";

/// The paper's figure, with its detector.
pub fn figure(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let named = [(Dimming::Best, BEST), (Dimming::Random, RANDOM)];
    let series = named.into_iter().zip(colours(&[BEST, RANDOM])).map(|((dimming, name), colour)| {
        Some(Series::new(
            name,
            colour,
            Line::Band,
            points(study, findings, PAPERS_DETECTOR, dimming)?,
        ))
    });
    let Some(series) = series.collect() else {
        return Ok(None);
    };
    let chart = chart(study, "k-means on (AGR, GRI)", series);
    Ok(Some(Figure {
        name: "figure-22",
        caption: format!("Bit error rate over the distance, each frame's interval drawn from 0.5 to 2. {BOUND}"),
        drawing: Page::new(vec![chart], 1, (620, 420)).draw()?,
        csv: numbers(study, findings, &[PAPERS_DETECTOR])?,
    }))
}

/// The same figure with all detectors.
pub fn detectors(study: &Study, findings: &Findings) -> anyhow::Result<Option<Figure>> {
    let charts = [(Dimming::Best, BEST), (Dimming::Random, RANDOM)].map(|(dimming, title)| {
        let detectors = &study.axes.detectors;
        let detectors = detectors.iter().zip(colours(detectors));
        let series = detectors.map(|(name, colour)| Some(Series::new(*name, colour, Line::Band, points(study, findings, name, dimming)?)));
        Some(chart(study, title, series.collect::<Option<_>>()?))
    });
    let Some(charts) = charts.into_iter().collect::<Option<Vec<_>>>() else {
        return Ok(None);
    };
    let detectors = charts.first().into_iter().flat_map(|chart: &Chart| &chart.series);
    let bound = Entry::of_mark("at most", Some(Mark::AtMost), false);
    let legend = detectors.map(Entry::of).chain([bound]).collect();
    Ok(Some(Figure {
        name: "figure-22-detectors",
        caption: format!(
            "Figure 22 with every detector. What learns has learnt on other frames at that distance, of the nearest of {} settings. \
             {BOUND}",
            study.axes.learnt_at.into_iter().product::<usize>()
        ),
        drawing: Page {
            legend: vec![legend],
            ..Page::new(charts, 2, (500, 430))
        }
        .draw()?,
        csv: numbers(study, findings, &study.axes.detectors)?,
    }))
}

/// A chart of rates, down to slightly below the bound that the frames of a point allow.
fn chart(study: &Study, title: &str, series: Vec<Series>) -> Chart {
    let frames = study.error_frames(PAPERS_DETECTOR) as f64;
    let floor = 10f64.powf((1.0 / (64.0 * frames)).log10().floor());
    let points = series.iter().flat_map(|series| &series.points);
    let highest = points.filter_map(|point| point.y_range).map(|[_, high]| high);
    let top = 10f64.powf(highest.fold(floor, f64::max).log10().ceil());
    let distances = study.axes.error_distance_m.iter().copied();
    Chart {
        title: title.into(),
        x: Axis::around("distance (m)", distances),
        // One decade of space for the legend.
        y: Axis::logarithmic("bit error rate", [floor, (10.0 * top).min(1.0)]),
        series,
    }
}

/// A detector's rates over distance; `None` if one is missing.
fn points(study: &Study, findings: &Findings, detector: &str, dimming: Dimming) -> Option<Vec<Point>> {
    let point = |&x: &f64| Some(point(x, findings.errors(x, dimming, detector)?));
    study.axes.error_distance_m.iter().map(point).collect()
}

fn point(x: f64, errors: &FrameErrors) -> Point {
    Point::rate(x, errors.rate(), errors.interval_95(), errors.errors())
}

fn numbers(study: &Study, findings: &Findings, detectors: &[&str]) -> anyhow::Result<String> {
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
    csv(&head, rows)
}
