//! Measures how a panel is read while the light across it changes.
//!
//! `cargo run --release -p vocc-tests --example uneven_light -- [FILMS] [FIRST SEED] [steady|veil|shadows|jumps|all] [PITCH PX]`
//!
//! For each light and pitch: films whose message arrived, frames read, legible frames that were not read, readings off by at least 0.6
//! pitches, those of them with a confidence above 90 %, and wrong bits of readings in place. The camera shakes smoothly, by a tenth of a
//! pitch from frame to frame. A single film prints each frame.

use rayon::prelude::*;
use std::ops::Add;
use vocc_tests::shake::{Film, FilmResult, Light, Shake, receive};

const FRAMES: usize = 180;
const PITCHES_PX: [f64; 3] = [4.0, 5.5, 11.0];
const STEP_PITCHES: f64 = 0.1;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<f64>().ok());
    let films = number(0).unwrap_or(20.0) as u64;
    let first = number(1).unwrap_or(1.0) as u64;
    let lights = [
        (Light::Steady, "steady"),
        (Light::Veil, "veil"),
        (Light::Shadows, "shadows"),
        (Light::Jumps, "jumps"),
    ];
    println!("{films} films of each light and pitch: {}", FilmResult::COLUMNS);
    for (light, name) in lights {
        if arguments.get(2).is_some_and(|wanted| wanted != name && wanted != "all") {
            continue;
        }
        for pitch_px in PITCHES_PX.into_iter().filter(|&of| number(3).is_none_or(|wanted| wanted == of)) {
            let film = |seed| Film {
                seed,
                pitch_px,
                shake: Shake::Smooth,
                step: STEP_PITCHES * pitch_px,
                frames: FRAMES,
                light,
            };
            let results = (first..first + films).into_par_iter().map(|seed| receive(film(seed), films == 1));
            let result = results.reduce(FilmResult::default, Add::add);
            println!("{name:8} {pitch_px:4} px: {result}");
        }
    }
}
