//! Measures and plots the calibration of bit probabilities.
//!
//! `cargo run --release -p vocc-tests --example reliability -- FILMS [FOLDER OF PHOTOGRAPHS] [WIDTHxHEIGHT] [FIRST SEED]` writes
//! `docs/detectors/reliability.svg`, and prints its data. Films are those of `any_camera` without broken LEDs, and only frames with a
//! single symbol count: all frames of followed films, those of them with a correctly located panel, and one frame per film read on its own.
//! The detectors read panels with known corners, at the points of `detector_errors`.

mod plot;

use std::error::Error;
use std::path::Path;

use link::camera::Camera;
use plotters::prelude::*;
use rayon::prelude::*;
use rx_pipeline::detect::Method;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{EvaluateError, Evaluator, Settings};
use studies::random_cameras::{RandomFilm, read_alone, receive};
use studies::statistics::{Bin, Reliability};
use studies::work_precision::scene_in_clear_air;
use vocc_tests::arguments::Arguments;

use plot::{FONT, key, legend, svg, titled};

const SIZE: (u32, u32) = (900, 620);
/// Minimum share drawn.
const LEAST: f64 = 1e-6;
/// Minimum number of bits for a point.
const BITS_LEAST: u64 = 100;
/// Frames per point of [`POINTS`].
const FRAMES: u64 = 100;

/// Distance in m, interval, ISO and L2A at which detectors err.
const POINTS: [(f64, f64, f64, f64); 12] = [
    (70.0, 0.5, 100.0, 0.2),
    (70.0, 0.5, 1600.0, 1.0),
    (70.0, 0.5, 32_000.0, 2.0),
    (70.0, 1.0, 32_000.0, 1.0),
    (70.0, 0.5, 100.0, 4.0),
    (50.0, 0.5, 32_000.0, 1.0),
    (70.0, 2.0, 32_000.0, 1.0),
    (60.0, 0.5, 8000.0, 0.2),
    (60.0, 0.5, 8000.0, 4.0),
    (70.0, 0.5, 6400.0, 0.6),
    (70.0, 0.5, 16_000.0, 0.6),
    (70.0, 0.5, 32_000.0, 0.6),
];

/// A data set and its colour (Okabe & Ito 2008).
struct Series {
    name: &'static str,
    colour: RGBColor,
    reliability: Reliability,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::read();
    let [followed, in_place, alone] = films(&arguments);
    let told = |choice| detected(choice);
    let series = [
        ("any camera, followed", RGBColor(170, 170, 170), followed),
        ("the same, panel in its place", BLACK, in_place),
        ("any camera, one frame alone", RGBColor(204, 121, 167), alone),
        (
            "best, corners told",
            RGBColor(0, 114, 178),
            told(DetectorChoice::MaximumLikelihood)?,
        ),
        ("k-means, corners told", RGBColor(213, 94, 0), told(DetectorChoice::KMeans)?),
        ("fisher, corners told", RGBColor(0, 158, 115), told(DetectorChoice::Fisher)?),
    ]
    .map(|(name, colour, reliability)| Series { name, colour, reliability });
    println!("| read by | said to be wrong | wrong (95 %) | bits |\n|---|---|---|---|");
    series.iter().for_each(tell);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/detectors/reliability.svg");
    std::fs::create_dir_all(path.parent().ok_or("a path without a folder")?)?;
    std::fs::write(&path, drawing(&series)?)?;
    println!("{}", path.display());
    Ok(())
}

/// All frames of followed films, those with a correctly located panel, and one frame per film on its own.
fn films(arguments: &Arguments) -> [Reliability; 3] {
    let read: Vec<_> = arguments.seeds.clone().into_par_iter().map(|seed| film(seed, arguments)).collect();
    let mut sums = <[Reliability; 3]>::default();
    for parts in read {
        sums.iter_mut().zip(&parts).for_each(|(sum, part)| sum.merge(part));
    }
    sums
}

fn film(seed: u64, arguments: &Arguments) -> [Reliability; 3] {
    let mut film = RandomFilm::draw(seed, arguments.size, &arguments.photographs).expect("a film that can be drawn");
    if film.has_broken_leds {
        return Default::default();
    }
    let followed = receive(&mut film, arguments.size, Camera::default());
    let mut alone = Reliability::default();
    if let Some((reading, bits)) = read_alone(&mut film, arguments.size) {
        alone.push(&reading.detection.soft, bits);
    }
    [followed.reliability, followed.reliability_in_place, alone]
}

/// Frames of a detector with known corners, at all points.
fn detected(choice: DetectorChoice) -> Result<Reliability, Box<dyn Error>> {
    let mut sum = Reliability::default();
    for point in POINTS {
        let settings = Settings::fast(FRAMES, 1, choice);
        let evaluator = Evaluator::new(&scene_in_clear_air(point)?, settings)?;
        let parts: Result<Vec<Reliability>, EvaluateError> = (0..FRAMES)
            .into_par_iter()
            .map_init(
                || evaluator.workspace(),
                |workspace, frame| {
                    let mut part = Reliability::default();
                    let observed = evaluator.observe(frame, workspace)?;
                    let moment = evaluator.renderer().moment(1, frame);
                    if evaluator.renderer().straddles(0, &moment) {
                        return Ok(part);
                    }
                    let soft = match evaluator.method() {
                        Some(Method::Features(detector)) => {
                            let detection = detector.detect(&observed.features);
                            detection.ok().map(|detection| detection.soft)
                        }
                        _ => evaluator.detect_softly(&observed, workspace)?.1,
                    };
                    if let Some(soft) = soft {
                        part.push(&soft, observed.bits);
                    }
                    Ok(part)
                },
            )
            .collect();
        parts?.iter().for_each(|part| sum.merge(part));
    }
    Ok(sum)
}

impl Series {
    fn bins(&self) -> impl Iterator<Item = Bin> {
        let bins = self.reliability.bins();
        bins.filter(|bin| bin.bits >= BITS_LEAST)
    }
}

fn tell(series: &Series) {
    series.bins().for_each(|bin| println!("| {} | {bin} |", series.name));
}

fn drawing(series: &[Series]) -> Result<String, Box<dyn Error>> {
    svg(SIZE, |surface| {
        let mut chart = titled(surface, "Bits said to be wrong, and bits that are")
            .build_cartesian_2d((LEAST..1.0).log_scale(), (LEAST..1.0).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .label_style((FONT, 13))
            .x_desc("share that is wrong by the soft values (at the left edge: 1e-6 or less)")
            .y_desc("share that is wrong, with its interval of 95 %")
            .x_label_formatter(&|share| format!("{share:.0e}"))
            .y_label_formatter(&|share| format!("{share:.0e}"))
            .draw()?;
        let exact = BLACK.mix(0.4);
        chart.draw_series(LineSeries::new([(LEAST, LEAST), (1.0, 1.0)], exact))?;
        for series in series {
            let (colour, x) = (series.colour, |bin: &Bin| bin.stated.max(LEAST));
            let wrong = series.bins().filter(|bin| bin.wrong > 0);
            let points = wrong.map(|bin| (x(&bin), bin.wrong as f64 / bin.bits as f64));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)).point_size(4))?
                .label(series.name)
                .legend(key(colour));
            chart.draw_series(series.bins().map(|bin| {
                let ends = bin.wrong_95.map(|end| (x(&bin), end.max(LEAST)));
                PathElement::new(ends, colour.stroke_width(1))
            }))?;
        }
        legend(&mut chart, SeriesLabelPosition::LowerRight)
    })
}
