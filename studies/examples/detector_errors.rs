//! Bit error rates of the detectors and the genie.
//!
//! `cargo run --release -p vocc-studies --example detector_errors -- GRID [FRAMES [SEED]]`, where GRID is `noisy`, `distance`, `l2a` or
//! `iso` (by default 200 frames and seed 1). The genie decides for the likeliest panel, so its wrong panels are a bound on average over all
//! frames, but its wrong bits are not. Every frame has random bits, a random sub-pixel phase and a reflectance of 0.3 to 0.5.

use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};
use studies::statistics::FrameErrors;
use studies::work_precision::scene_in_clear_air;

/// Distance in m, interval, ISO and L2A.
type Point = (f64, f64, f64, f64);

const DETECTORS: [(&str, DetectorChoice); 5] = [
    ("k-means", DetectorChoice::KMeans),
    ("fisher", DetectorChoice::Fisher),
    ("fisher-ngr", DetectorChoice::FisherNgr),
    ("ml", DetectorChoice::MaximumLikelihood),
    ("genie", DetectorChoice::Genie),
];

/// The detectors whose wrong bits and panels are printed with intervals: the genie's panels are a bound, whose uncertainty must be shown
/// next to the best receiver's.
const COUNTED: [&str; 2] = ["ml", "genie"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let grid = arguments.next().unwrap_or_else(|| "noisy".into());
    let frames: u64 = arguments.next().map_or(Ok(200), |given| given.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |given| given.parse())?;
    print!("| d (m) | i | ISO | L2A |");
    DETECTORS.iter().for_each(|(name, _)| print!(" {name} |"));
    COUNTED.iter().for_each(|name| print!(" {name}: bits (95 %) | panels (95 %) |"));
    println!("\n|{}", "---|".repeat(4 + DETECTORS.len() + 2 * COUNTED.len()));
    for point in points(&grid)? {
        let (distance, interval, iso, l2a) = point;
        print!("| {distance} | {interval} | {iso} | {l2a} |");
        let mut counted = Vec::new();
        for (name, detector) in DETECTORS {
            let settings = Settings::fast(frames, seed, detector);
            let evaluation = Evaluator::new(&scene_in_clear_air(point)?, settings)?.run(|_| true)?;
            print!(" {:.5} |", evaluation.errors.rate());
            counted.extend(COUNTED.contains(&name).then_some(evaluation.errors));
        }
        counted.iter().for_each(|errors| print!("{}", counts(errors)));
        println!();
    }
    Ok(())
}

/// Numbers of wrong bits and panels, with the intervals of their rates in percent.
fn counts(errors: &FrameErrors) -> String {
    let percent = |[low, high]: [f64; 2]| format!("{:.2} to {:.2}", 100.0 * low, 100.0 * high);
    format!(
        " {} ({}) | {} ({}) |",
        errors.errors(),
        percent(errors.interval_95()),
        errors.wrong_frames(),
        percent(errors.frame_error_rate().1)
    )
}

fn points(grid: &str) -> Result<Vec<Point>, String> {
    Ok(match grid {
        "noisy" => vec![
            (70.0, 0.5, 100.0, 0.2),
            (70.0, 0.5, 1600.0, 1.0),
            (70.0, 0.5, 32_000.0, 2.0),
            (70.0, 1.0, 32_000.0, 2.0),
            (70.0, 0.5, 100.0, 4.0),
        ],
        "distance" => [30.0, 50.0, 70.0]
            .into_iter()
            .flat_map(|distance| [0.5, 1.0, 2.0].map(|interval| (distance, interval, 32_000.0, 1.0)))
            .collect(),
        "l2a" => [0.2, 0.6, 1.0, 2.0, 3.0, 4.0].map(|l2a| (60.0, 0.5, 8000.0, l2a)).into(),
        "iso" => [100.0, 400.0, 1600.0, 6400.0, 16_000.0, 32_000.0]
            .map(|iso| (70.0, 0.5, iso, 0.6))
            .into(),
        _ => {
            return Err(format!("no grid {grid:?}: choose noisy, distance, l2a or iso"));
        }
    })
}
