//! Counts the panels found from 3 m on and the messages received with random cameras unknown to the receiver, and false detections in
//! photographs.
//!
//! `cargo run --release -p vocc-tests --example any_camera -- FILMS [FOLDER OF PHOTOGRAPHS] [WIDTHxHEIGHT] [FIRST SEED] [told]`
//!
//! `told` gives the receiver the simulator's parameters of each camera. `RAYON_NUM_THREADS` sets the number of threads.

use link::camera::Camera;
use rayon::prelude::*;
use studies::random_cameras::{FilmResult, IN_TIME, RandomFilm, receive, receive_without_panel};
use vocc_tests::arguments::Arguments;

fn main() {
    let Arguments {
        seeds,
        size,
        photographs,
        rest,
    } = Arguments::read();
    let is_told = rest.first().is_some_and(|word| word == "told");
    let films = seeds.end - seeds.start;
    let fates: Vec<FilmResult> = seeds
        .clone()
        .into_par_iter()
        .map(|seed| {
            let mut film = RandomFilm::draw(seed, size, &photographs).expect("a film");
            let camera = if is_told { film.camera } else { Camera::default() };
            let fate = receive(&mut film, size, camera);
            tell(&film, &fate);
            fate
        })
        .collect();
    let count = |is: fn(&FilmResult) -> bool| fates.iter().filter(|fate| is(fate)).count();
    let sum = |of: fn(&FilmResult) -> u64| fates.iter().map(of).sum::<u64>();
    println!(
        "of {films} films {} found within {IN_TIME} frames, {} later, {} misplaced; {} messages delivered; {} of {} bits wrong",
        count(is_found_in_time),
        count(|fate| fate.found.is_some() && !is_found_in_time(fate)),
        count(|fate| fate.misplaced),
        count(|fate| fate.delivered_at.is_some()),
        sum(|fate| fate.errors),
        sum(|fate| fate.bits),
    );
    let seen: usize = seeds
        .into_par_iter()
        .map(|seed| {
            let seen = receive_without_panel(seed, size, &photographs).expect("a photograph");
            for corners in &seen {
                println!("seen in photograph {seed}: {corners:?}");
            }
            usize::from(!seen.is_empty())
        })
        .sum();
    println!("{seen} of {films} photographs without a panel show one");
}

fn is_found_in_time(fate: &FilmResult) -> bool {
    matches!(fate.found, Some((frame, _)) if frame < IN_TIME) && !fate.misplaced
}

/// Prints a film that failed.
fn tell(film: &RandomFilm, fate: &FilmResult) {
    let mut faults = Vec::new();
    if fate.misplaced {
        faults.push("misplaced".into());
    }
    match fate.found {
        None => faults.push("not found".into()),
        Some((frame, _)) if frame >= IN_TIME => faults.push(format!("found in frame {frame}")),
        Some(_) => {}
    }
    if fate.delivered_at.is_none() {
        faults.push(format!("not delivered, {} of {} bits wrong", fate.errors, fate.bits));
    }
    if !faults.is_empty() {
        println!("{}: pitch {:.1} px, {}: {}", faults.join(", "), film.pitch_px, film.what, fate.why);
    }
}
