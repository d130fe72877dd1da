//! How often 95 % intervals hold the truth: those of figure 22, where interval, L2A, reflectance, phase and bits are drawn with each frame.
//!
//! `cargo run --release -p vocc-studies --example coverage -- [FRAMES [SEEDS [DISTANCE_M [TRUTH_FRAMES]]]]`, by default 4000, 50, 70 and
//! 1 000 000. The truth is the rate in the last number of frames, of another seed. Prints each seed's rate and interval that misses it,
//! then the count. Between 90 and 99 % of the seeds are to hold it; where there are few errors, more.

use sim::scene::Scene;
use studies::reproduction::{Dimming, Extent, Finding, Findings, PAPERS_DETECTOR, Study, Task};
use studies::statistics::FrameErrors;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, usual: u64| arguments.get(place).map_or(Ok(usual), |given| given.parse());
    let (frames, seeds, truth_frames) = (number(0, 4000)?, number(1, 50)?, number(3, 1_000_000)?);
    let distance_m = arguments.get(2).map_or(Ok(70.0), |given| given.parse())?;
    let scene = Scene::load("paper", &[])?;
    let task = Task::Errors {
        distance_m,
        dimming: Dimming::Random,
        detector: PAPERS_DETECTOR.into(),
    };
    let count = |frames, seed| -> Result<FrameErrors, Box<dyn std::error::Error>> {
        let study = Study::new(scene.clone(), Extent::Claims, frames, seed);
        match study.perform(&task, &Findings::default())? {
            Some(Finding::Errors(errors)) => Ok(*errors),
            _ => Err("no errors were counted".into()),
        }
    };
    let truth = count(truth_frames, seeds + 1)?.rate();
    println!("the truth, of {truth_frames} frames: {truth:.3e}");
    let mut held = 0;
    for seed in 1..=seeds {
        let errors = count(frames, seed)?;
        let [low, high] = errors.interval_95();
        match (low..=high).contains(&truth) {
            true => held += 1,
            false => println!("seed {seed} misses it: {:.3e} ({low:.3e} to {high:.3e})", errors.rate()),
        }
    }
    println!("{held} of {seeds} seeds hold it");
    Ok(())
}
