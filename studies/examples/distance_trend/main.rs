//! Tests whether the best L2A is higher at short distances, as Do & Yoo 2020 report in their figure 21, and under which reading of their
//! paper.
//!
//! `cargo run --release -p vocc-studies --example distance_trend [FRAMES]` draws FRAMES frames (by default 60) at each interval and
//! distance for each of [`reading::READINGS`], on whole pixels so that each step can be varied. It evaluates them with each of
//! [`statistic::STATISTICS`], and prints the best L2A at 30, 50 and 70 m for each interval. It does not use the simulator's renderer, so
//! that its first line is also a check of the renderer.

mod drawing;
mod features;
mod reading;
mod statistic;

use rayon::prelude::*;
use reading::{Interpretation, READINGS};
use statistic::{Clouds, STATISTICS};

const INTERVALS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
const DISTANCES_M: [f64; 3] = [30.0, 50.0, 70.0];
/// L2A 0.2 to 4.
const RATIOS: usize = 20;

fn ratio(k: usize) -> f64 {
    0.2 * (k + 1) as f64
}

fn main() {
    let frames = std::env::args().nth(1).map_or(Ok(60), |text| text.parse());
    let Ok(frames) = frames else {
        eprintln!("give the number of frames, such as 60");
        std::process::exit(2);
    };
    println!("best L2A at 30, 50, 70 m; * where the range ends; {frames} frames a point");
    print!("{:<44}", "reading");
    INTERVALS.iter().for_each(|i| print!(" interval {i:<12}"));
    println!(" higher near");
    for reading in &READINGS {
        let clouds = clouds(reading, frames);
        let statistics = if reading.is_plain() { &STATISTICS[..] } else { &STATISTICS[..1] };
        for (name, statistic) in statistics {
            let best = best(&clouds, *statistic);
            println!("{:<44}{}", format!("{}, {name}", reading.name), row(&best));
        }
        for (name, statistic) in STATISTICS.iter().skip(statistics.len()) {
            let best = best(&clouds, *statistic);
            if best.iter().filter(|best| is_higher_near(best)).count() > 2 {
                println!("{:<44}{}", format!("  with {name}"), row(&best));
            }
        }
    }
}

/// The features at every interval, distance and ratio.
fn clouds(reading: &Interpretation, frames: u64) -> Vec<Vec<Vec<Clouds>>> {
    let at = |interval: f64| {
        let along = DISTANCES_M.par_iter();
        along.map(|&d| clouds_at(reading, interval, d, frames)).collect()
    };
    INTERVALS.par_iter().map(|&interval| at(interval)).collect()
}

/// The features at one interval and distance, for each ratio: the same frames for all.
fn clouds_at(reading: &Interpretation, interval: f64, distance_m: f64, frames: u64) -> Vec<Clouds> {
    let mut clouds = vec![Clouds::default(); RATIOS];
    for frame in 0..frames {
        let scene = drawing::Scene::random(reading, interval, distance_m, frame);
        let light = scene.light(reading);
        for (k, clouds) in clouds.iter_mut().enumerate() {
            let grey = light.grey(reading, ratio(k));
            clouds.push(&features::measure(reading, &scene, &grey), scene.bits);
        }
    }
    clouds
}

/// The best ratio by interval and distance.
fn best(clouds: &[Vec<Vec<Clouds>>], statistic: fn(&Clouds) -> f64) -> Vec<[f64; 3]> {
    let of = |clouds: &[Clouds]| {
        let values: Vec<f64> = clouds.iter().map(statistic).collect();
        let top = (0..RATIOS).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
        if top == 0 || top == RATIOS - 1 {
            return ratio(top);
        }
        let (before, at, after) = (values[top - 1], values[top], values[top + 1]);
        ratio(top) + 0.1 * (before - after) / (before - 2.0 * at + after)
    };
    clouds.iter().map(|row| std::array::from_fn(|k| of(&row[k]))).collect()
}

/// Whether the best ratio is higher at 30 than at 70 m, and its value at 50 m lies in between. Two ratios that are both at the end of the
/// range are indistinguishable.
fn is_higher_near(&[near, middle, far]: &[f64; 3]) -> bool {
    near >= middle && middle >= far && near > far + TELLABLE
}

/// Smaller differences may be chance.
const TELLABLE: f64 = 0.1;

fn row(best: &[[f64; 3]]) -> String {
    let number = |value: f64| {
        let star = if value >= ratio(RATIOS - 1) { '*' } else { ' ' };
        format!("{value:.2}{star} ")
    };
    let cells: String = best.iter().map(|best| format!(" {:<21}", best.map(number).concat())).collect();
    let higher: Vec<String> = INTERVALS
        .iter()
        .zip(best)
        .filter(|(_, best)| is_higher_near(best))
        .map(|(interval, _)| interval.to_string())
        .collect();
    format!("{cells} {}", if higher.is_empty() { "nowhere".into() } else { higher.join(" ") })
}
