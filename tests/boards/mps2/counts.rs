//! The instructions of each detector, stored in a file for `vocc accuracy`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use rx_pipeline::detect::{Detector, Method};
use rx_pipeline::profile::{STAGES, Stage};
use sim::road::camera_of;
use sim::scene::Scene;
use studies::detectors::{DETECTORS, DetectorChoice};
use studies::monte_carlo::{self, Evaluator};
use studies::work_precision::{PLACES, counted_rows as rows, scene_at};
use vocc_tests::firmware::{median, say};

use crate::Images;
use crate::board::{instructions, read};
use crate::film::{HEIGHT, Shots, WIDTH};
use crate::format::MethodChoice;

/// If this is set, the file is rewritten and not compared.
const WRITE: &str = "VOCC_WRITE_COUNTS";
const FRAMES: u64 = 8;
const SIDE: u16 = 96;
/// Relative change of a count from which the file is out of date.
const DRIFT: f64 = 0.1;

/// Every detector takes as many instructions as the file says.
pub fn the_detectors_take_what_is_on_file(images: &Images) {
    let films = PLACES.map(|place| {
        let size = [format!("camera.width_px={WIDTH}"), format!("camera.height_px={HEIGHT}")];
        let scene = scene_at(place, &size).expect("a valid scene");
        let shots = Shots::of(&scene, FRAMES);
        (scene, shots)
    });
    let names = DETECTORS
        .into_iter()
        .filter(|(_, choice)| !matches!(choice, DetectorChoice::Best | DetectorChoice::Genie));
    let counted: Vec<(&str, Vec<f64>)> = names
        .map(|(name, choice)| {
            let each = films
                .iter()
                .map(|(scene, shots)| count(&images.receiver, scene, shots, choice) as f64);
            (name, each.collect())
        })
        .collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../studies/src/work_precision/data/cortex-m7.csv");
    if std::env::var_os(WRITE).is_some() {
        return write(&file, &counted);
    }
    let on_file = std::fs::read_to_string(&file).expect("the counts on file");
    let on_file: Vec<_> = rows(&on_file).collect();
    for (name, counts) in &counted {
        say(&format!("{name}: {counts:?} instructions"));
        let (_, filed) = on_file.iter().find(|(known, _)| known == name).expect("the detector is on file");
        for (count, filed) in counts.iter().zip(filed) {
            assert!(
                (count / filed - 1.0).abs() < DRIFT,
                "{name}: {count} instructions, {filed} on file; write the file anew by {WRITE}=1"
            );
        }
    }
}

/// The median number of instructions from grey levels and corners to bits.
fn count(image: &Path, scene: &Scene, shots: &Shots, choice: DetectorChoice) -> u64 {
    let film = shots.cut(SIDE, method(scene, choice), camera_of(scene), 1.0);
    let mut counts = Vec::new();
    for report in read(image, &film).iter().filter(|report| report.reading.is_some()) {
        let stages = STAGES.iter().zip(&report.stage_ticks);
        let reading = stages.filter(|(stage, _)| matches!(stage, Stage::Cells | Stage::Features | Stage::Detect));
        counts.push(reading.map(|(_, &ticks)| instructions(ticks)).sum());
    }
    assert!(counts.len() as u64 > FRAMES / 2, "{} frames read", counts.len());
    median(&counts)
}

fn method(scene: &Scene, choice: DetectorChoice) -> MethodChoice {
    let settings = monte_carlo::Settings::fast(1, 1, choice);
    let evaluator = Evaluator::new(scene, settings).expect("a panel in view");
    match evaluator.method().expect("a receiver's detector") {
        Method::MaximumLikelihood => MethodChoice::MaximumLikelihood,
        Method::Features(Detector::KMeansRaw) => MethodChoice::KMeansRaw,
        Method::Features(Detector::Otsu) => MethodChoice::Otsu,
        Method::Features(Detector::Fisher(fisher)) => MethodChoice::Fisher(fisher),
        Method::Features(_) => MethodChoice::KMeans,
    }
}

fn write(file: &PathBuf, counted: &[(&str, Vec<f64>)]) {
    let mut table = format!(
        "# Instructions of an emulated Cortex-M7 (QEMU mps2-an500) for the bits and soft values of one panel that is followed, \
         from grey levels and corners on.\n\
         # Made by {WRITE}=1 cargo test -p vocc-tests --test mps2 on_file; lines: detector,place[,place…], the \
         places of the part's diagrams.\n"
    );
    for (name, counts) in counted {
        let counts = counts.iter().map(|count| count.to_string()).collect::<Vec<_>>();
        let _ = writeln!(table, "{name},{}", counts.join(","));
    }
    std::fs::write(file, table).expect("the file is written");
}
