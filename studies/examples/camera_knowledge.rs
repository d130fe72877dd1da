//! What it costs not to know the camera: bit errors and time after 20 frames of a receiver that learnt it, of one that was told, and of
//! the genie.
//!
//! `cargo run --release -p vocc-studies --example camera_knowledge -- [FRAMES [SEED]]` (400 and 1 unless told). The panel's reflectance
//! stays; its bits and sub-pixel phase are each frame's own. The interval of 95 % of the ratio comes from resampled frames.

use studies::camera_knowledge::{CASES, cost};
use studies::statistics::ratio_95;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let frames: u64 = arguments.next().map_or(Ok(400), |given| given.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |given| given.parse())?;
    println!(
        "| camera | d (m) | i | lx | learnt | told | genie | learnt/told (95 %) | µs: learnt | told |\n|{}",
        "---|".repeat(10)
    );
    let (mut learnt, mut told) = (Vec::new(), Vec::new());
    for case in &CASES {
        let cost = cost(case, frames, seed)?;
        let (distance, interval, lux, _) = case.place;
        let genie = cost.genie.map_or("".into(), |errors| {
            format!(
                "{:.5}",
                errors.iter().sum::<u64>() as f64 / (64 * frames) as f64
            )
        });
        println!(
            "| {} | {distance} | {interval} | {lux} | {:.5} | {:.5} | {genie} | {} | {:.0} | {:.0} |",
            case.name,
            cost.learnt.rate(),
            cost.told.rate(),
            ratio(&cost.learnt.errors, &cost.told.errors),
            cost.learnt.time_us,
            cost.told.time_us,
        );
        learnt.extend(cost.learnt.errors);
        told.extend(cost.told.errors);
    }
    println!("\nof all cameras: learnt/told {}", ratio(&learnt, &told));
    Ok(())
}

fn ratio(above: &[u64], below: &[u64]) -> String {
    let sum = |errors: &[u64]| errors.iter().sum::<u64>() as f64;
    if sum(below) == 0.0 {
        return format!("{} to none", sum(above));
    }
    let [low, high] = ratio_95(above, below);
    format!("{:.2} ({low:.2} to {high:.2})", sum(above) / sum(below))
}
