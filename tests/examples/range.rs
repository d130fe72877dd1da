//! How many panels of the locator's whole range are found within three frames, and how many are seen where there are none.
//!
//! `cargo run --release -p vocc-tests --example range -- SCENES [FOLDER OF PHOTOGRAPHS] [WIDTHxHEIGHT] [FIRST SEED]`

use std::path::Path;

use vocc_tests::sightings::{Tally, photographs, search_empty, search_scenes};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let argument = |index: usize| arguments.get(index).map(String::as_str);
    let scenes = argument(1).and_then(|n| n.parse().ok()).unwrap_or(100);
    let folder = argument(2).unwrap_or(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../studies/photographs"
    ));
    let size = argument(3).and_then(|size| {
        let (width, height) = size.split_once('x')?;
        Some([width.parse().ok()?, height.parse().ok()?])
    });
    let size = size.unwrap_or([1920, 1080]);
    let first: u64 = argument(4).and_then(|n| n.parse().ok()).unwrap_or(0);
    let seeds = first..first + scenes;
    let photographs = photographs(Path::new(folder)).expect("a folder of pictures");
    let Tally {
        found_at,
        wrong,
        lost,
        mut errors_px,
    } = search_scenes(seeds.clone(), size, &photographs, |line| println!("{line}"));
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
