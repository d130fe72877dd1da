//! Measures how well a panel is followed by a shaking camera, by its displacement between frames.
//!
//! `cargo run --release -p vocc-tests --example shaking_camera -- [FILMS] [FIRST SEED] [random|smooth|turn] [PITCH PX] [STEP]`
//!
//! For each cell: films whose message arrived, frames read, legible frames that were not read, readings off by at least 0.6 pitches, those
//! of them with a confidence above 90 %, and wrong bits of readings in place. Steps are in pitches, or in degrees for a turn. With a pitch
//! and a step it prints each film.

use rayon::prelude::*;
use std::ops::Add;
use vocc_tests::shake::{Film, FilmResult, Light, Shake, receive};

const FRAMES: usize = 90;
const PITCHES_PX: [f64; 6] = [4.0, 5.5, 8.0, 11.0, 20.0, 40.0];
const STEPS_PITCHES: [f64; 7] = [0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 2.0];
const TURNS_DEG: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<f64>().ok());
    let films = number(0).unwrap_or(20.0) as u64;
    let first = number(1).unwrap_or(1.0) as u64;
    let (pitch, step) = (number(3), number(4));
    for (shake, name) in [(Shake::Random, "random"), (Shake::Smooth, "smooth"), (Shake::Turn, "turn")] {
        if arguments.get(2).is_some_and(|wanted| wanted != name && wanted != "all") {
            continue;
        }
        let steps = if shake == Shake::Turn { &TURNS_DEG[..] } else { &STEPS_PITCHES[..] };
        let unit = if shake == Shake::Turn { "° a frame" } else { "pitches" };
        println!("{name} shake, {films} films of each pitch and step: {}", FilmResult::COLUMNS);
        for &pitch_px in PITCHES_PX.iter().filter(|&&of| pitch.is_none_or(|wanted| wanted == of)) {
            for &by in steps.iter().filter(|&&of| step.is_none_or(|wanted| wanted == of)) {
                let film = |seed| Film {
                    seed,
                    pitch_px,
                    shake,
                    step: if shake == Shake::Turn { by } else { by * pitch_px },
                    frames: FRAMES,
                    light: Light::Steady,
                };
                let is_one = pitch.is_some() && step.is_some();
                let fates: Vec<FilmResult> = (first..first + films)
                    .into_par_iter()
                    .map(|seed| receive(film(seed), is_one && films == 1))
                    .collect();
                if is_one {
                    fates
                        .iter()
                        .enumerate()
                        .for_each(|(i, fate)| println!("  seed {}: {fate:?}", first + i as u64));
                }
                let result = fates.into_iter().fold(FilmResult::default(), Add::add);
                println!("pitch {pitch_px:4} px, step {by:4} {unit}: {result}");
            }
        }
    }
}
