//! Measures how often 95 % intervals contain the true rate, for figure 22, in which interval, L2A, reflectance, phase and bits are drawn
//! for each frame.
//!
//! `cargo run --release -p vocc-studies --example coverage -- [FRAMES [SEEDS [DISTANCE_M [TRUTH_FRAMES]]]]`, by default 4000, 50, 70 and 1
//! 000 000. The true rate is that of at most TRUTH_FRAMES frames with another seed: the count ends early at 20 000 wrong bits, and is then
//! uncertain by 2 to 3 %. Prints the rate and the interval of each seed whose interval misses it, then the count. Between 90 and 99 % of the
//! seeds should contain it, or more if errors are few.

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
    let counted = count(truth_frames, seeds + 1)?;
    let truth = counted.rate();
    println!("the truth, of {} frames: {truth:.3e}", counted.frames());
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
