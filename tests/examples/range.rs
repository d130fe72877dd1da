//! Counts the panels found within three frames over the locator's whole range, and false detections without panels.
//!
//! `cargo run --release -p vocc-tests --example range -- SCENES [FOLDER OF PHOTOGRAPHS] [WIDTHxHEIGHT] [FIRST SEED] [TURNED BY, °]`

use vocc_tests::arguments::Arguments;
use vocc_tests::sightings::{Tally, search_empty, search_scenes};

fn main() {
    let Arguments {
        seeds,
        size,
        photographs,
        rest,
    } = Arguments::read();
    let turn_deg = rest.first().and_then(|turn| turn.parse().ok()).unwrap_or(0.0);
    let scenes = seeds.end - seeds.start;
    let Tally {
        found_at,
        wrong,
        lost,
        mut errors_px,
    } = search_scenes(seeds.clone(), turn_deg, size, &photographs, |line| println!("{line}"));
    let found: usize = found_at.iter().sum();
    errors_px.sort_by(f64::total_cmp);
    let quantile = |part: f64| {
        errors_px
            .get((part * (errors_px.len() as f64 - 1.0)) as usize)
            .copied()
            .unwrap_or(f64::NAN)
    };
    println!(
        "{found} of {scenes} scenes found within three frames ({found_at:?} by frame), {wrong} wrong, {lost} lost; corner LEDs to {:.3} px \
         (median), {:.3} px (99 %)",
        quantile(0.5),
        quantile(0.99)
    );
    let seen = search_empty(seeds, size, &photographs, |line| println!("{line}"));
    println!("{seen} panels seen in {scenes} photographs without one, each alone and then moved");
}
