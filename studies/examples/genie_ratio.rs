//! The errors of the best detector relative to the genie's on the same frames, over distance, interval, L2A and ISO. The genie's wrong
//! panels are a bound; its wrong bits are not.
//!
//! `cargo run --release -p vocc-studies --example genie_ratio -- DISTANCES INTERVALS L2AS ISOS [FRAMES [SEED [followed]]]`, for example
//! `70,110 0.5,1 2 100,32000 400 1`. Each frame has random bits, a random sub-pixel phase and a reflectance of 0.3 to 0.5; `followed` keeps
//! the reflectance constant, as for a panel that a receiver follows. The 95 % interval of the ratio comes from resampled frames.

use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{EvaluateError, Evaluator, Settings};
use studies::statistics::ratio_95;
use studies::work_precision::scene_in_clear_air;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [distances, intervals, l2as, isos, ..] = &arguments[..] else {
        return Err("give DISTANCES INTERVALS L2AS ISOS, such as 70,110 0.5,1 2 100,32000".into());
    };
    let number = |at: usize, default: u64| arguments.get(at).map_or(Ok(default), |given| given.parse());
    let (frames, seed) = (number(4, 200)?, number(5, 1)?);
    let followed = arguments.get(6).is_some_and(|word| word == "followed");
    println!(
        "| d (m) | i | L2A | ISO | k-means | ml | genie | ml/genie | wrong panels: ml | genie |\n|{}",
        "---|".repeat(10)
    );
    let mut totals = [0; 3];
    for distance in numbers(distances)? {
        for interval in numbers(intervals)? {
            for l2a in numbers(l2as)? {
                for iso in numbers(isos)? {
                    print!("| {distance} | {interval} | {l2a} | {iso} |");
                    let settings = |detector| Settings {
                        random_reflectance: !followed,
                        ..Settings::fast(frames, seed, detector)
                    };
                    let scene = scene_in_clear_air((distance, interval, iso, l2a))?;
                    let errors = DETECTORS.map(|detector| errors(&scene, settings(detector)));
                    let [Ok(kmeans), Ok(found), Ok(genie)] = errors else {
                        println!(" too small | | | | | |");
                        continue;
                    };
                    for (total, errors) in totals.iter_mut().zip([&kmeans, &found, &genie]) {
                        *total += sum(errors);
                    }
                    let rate = |errors: &[u64]| sum(errors) as f64 / (64 * frames) as f64;
                    let [low, high] = ratio_95(&found, &genie);
                    println!(
                        " {:.5} | {:.5} | {:.5} | {:.2} ({low:.2} to {high:.2}) | {} | {} |",
                        rate(&kmeans),
                        rate(&found),
                        rate(&genie),
                        sum(&found) as f64 / sum(&genie) as f64,
                        wrong(&found),
                        wrong(&genie)
                    );
                }
            }
        }
    }
    let [kmeans, found, genie] = totals;
    println!("\nErrors in all: k-means {kmeans}, ml {found}, genie {genie}");
    Ok(())
}

const DETECTORS: [DetectorChoice; 3] = [DetectorChoice::KMeans, DetectorChoice::MaximumLikelihood, DetectorChoice::Genie];

fn numbers(list: &str) -> Result<Vec<f64>, std::num::ParseFloatError> {
    list.split(',').map(str::parse).collect()
}

/// The bit errors of each frame.
fn errors(scene: &Scene, settings: Settings) -> Result<Vec<u64>, EvaluateError> {
    let evaluator = Evaluator::new(scene, settings)?;
    let mut workspace = evaluator.workspace();
    (0..settings.frames)
        .map(|frame| Ok(evaluator.evaluate(frame..frame + 1, &mut workspace)?.errors.errors()))
        .collect()
}

/// Panels with any error.
fn wrong(errors: &[u64]) -> usize {
    errors.iter().filter(|&&errors| errors > 0).count()
}

fn sum(errors: &[u64]) -> u64 {
    errors.iter().sum()
}
