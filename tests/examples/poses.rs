//! Measures the error of estimated poses, and whether their covariances are correct.
//!
//! `cargo run --release -p vocc-tests --example poses -- COUNT NEAREST_M FARTHEST_M [TURNED_DEG] [PRESET] [LEAST_YAW_DEG]`

use rayon::prelude::*;
use vocc_tests::poses::{Range, Trial, Trials};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, usual: f64| arguments.get(i).and_then(|text| text.parse().ok()).unwrap_or(usual);
    let count = number(0, 1000.0) as u64;
    let preset = match arguments.get(4).map(String::as_str) {
        Some("dusk") => "dusk",
        Some("night") => "night",
        _ => "day",
    };
    let least = number(5, 0.0);
    let range = Range {
        preset,
        l2a: None,
        distance_m: [number(1, 50.0), number(2, 50.0)],
        yaw_deg: [least.max(0.0), number(3, 30.0)],
        pitch_deg: number(3, 30.0).min(30.0),
    };
    let trials: Vec<Result<Trial, String>> = (0..count)
        .into_par_iter()
        .map_init(
            || Trials::new(range),
            |trials, seed| trials.draw(seed).map_err(|why| why.to_string()),
        )
        .collect();
    let known: Vec<&Trial> = trials.iter().flatten().collect();
    let unknown = trials.len() - known.len();
    if let Some(Err(why)) = trials.iter().find(|trial| trial.is_err()) {
        println!("{unknown} of {count} not known, the first: {why}");
    }
    let mean = |of: &dyn Fn(&Trial) -> f64| known.iter().map(|trial| of(trial)).sum::<f64>() / known.len() as f64;
    let root_mean_square = |of: &dyn Fn(&Trial) -> f64| mean(&|trial| of(trial).powi(2)).sqrt();
    let nees = mean(&Trial::nees);
    let band = 1.96 * (12.0 / known.len() as f64).sqrt();
    println!(
        "NEES {nees:.3}, 95 % band 6 ± {band:.3}, deviation of one {:.2}",
        root_mean_square(&|t| t.nees() - nees)
    );
    for (i, name) in ["x", "y", "z", "about x", "about y", "about z"].into_iter().enumerate() {
        let sigma = |t: &Trial| t.pose.covariance[i][i].sqrt();
        println!(
            "{name}: bias {:.6}, rms {:.6}, stated {:.6}, rms in sigmas {:.3}, mean in sigmas {:.3}",
            mean(&|t| t.error()[i]),
            root_mean_square(&|t| t.error()[i]),
            root_mean_square(&sigma),
            root_mean_square(&|t| t.error()[i] / sigma(t)),
            mean(&|t| t.error()[i] / sigma(t)),
        );
    }
    println!(
        "range: rms {:.4} m, in bounds {:.3}, bound {:.4} m; inflated {}",
        root_mean_square(&Trial::range_error_m),
        root_mean_square(&|t| t.range_error_m() / t.range_bound_m),
        root_mean_square(&|t| t.range_bound_m),
        known.iter().filter(|t| t.pose.inflation > 1.0).count()
    );
    let worst = (0..)
        .zip(&trials)
        .filter_map(|(seed, trial): (u64, _)| Some((trial.as_ref().ok()?.nees(), seed)))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((nees, seed)) = worst {
        println!("the worst NEES is {nees:.1}, of pose {seed}");
    }
    println!(
        "{:.2} ms a pose, {:.2} rounds",
        1e3 * mean(&|t| t.time_s),
        mean(&|t| t.rounds as f64)
    );
}
