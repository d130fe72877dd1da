//! Counts the messages received from films of a panel with a carrier, drawn without the simulator, by random cameras.
//!
//! `cargo run --release -p vocc-tests --example undersampled_films -- [FILMS] [FIRST SEED] [rolling|global|still|blind] [BYTES] [verbose]`
//!
//! `rolling`: rolling shutter in three films of four; LEDs 6 to 30 px apart. `global`: global shutter, 5.5 px. `still`: `rolling` with a
//! panel without a carrier. `blind`: `rolling` with exposures of a whole cycle. BYTES: a message of that length, in films of four repeats
//! or more; otherwise a short message. `verbose` prints for each frame where the panel was read, the bits that were read, and which rows
//! of them are the panel's (`+`), its complement's (`-`), or neither's (`?`). The last lines compare the bits' stated certainty with the
//! share that is wrong.

use rayon::prelude::*;
use reception::PanelReport;
use rx_pipeline::detect::Detection;
use studies::statistics::Reliability;
use vocc_tests::undersampled::{Film, FilmResult, receive};

const MESSAGE: &[u8] = b"Lane closed ahead";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<u64>().ok());
    let (films, first) = (number(0).unwrap_or(30), number(1).unwrap_or(1));
    let kind = arguments.get(2).map_or("rolling", String::as_str);
    let bytes = number(3);
    let is_verbose = arguments.last().is_some_and(|last| last == "verbose");
    let message = bytes.map_or(MESSAGE.to_vec(), |bytes| (0..bytes).map(|i| (i * 89 % 251) as u8).collect());
    let of_camera = |seed| match kind {
        "global" => Film::of_camera(seed),
        "still" => Film {
            cycles: 0,
            ..Film::of_rolling_camera(seed)
        },
        "blind" => {
            let film = Film::of_rolling_camera(seed);
            Film {
                exposure_s: 1.0 / film.carrier_hz(),
                ..film
            }
        }
        _ => Film::of_rolling_camera(seed),
    };
    let fates: Vec<FilmResult> = (first..first + films)
        .into_par_iter()
        .map(|seed| {
            let film = of_camera(seed);
            let film = match bytes {
                Some(_) => film.of_repeats(&message, 4),
                None => film,
            };
            let fate = receive(film, &message, |number, shown, report| {
                if is_verbose {
                    println!("  {number:3} {}", told(shown.bits, report));
                }
            });
            let turns = film.carrier_hz() * film.line_delay_s * 7.0 * film.pitch_px;
            println!(
                "{seed:5} {:6.2} frames/s, {:4.0} Hz, {:.2} cycles exposed, {turns:6.2} cycles over the panel, {:4.1} px, {:.1} ms: {:?}, wrong {}, \
                 {} of {} read, {} beside",
                film.fps,
                film.carrier_hz(),
                film.carrier_hz() * film.exposure_s,
                film.pitch_px,
                1e3 * film.jitter_s,
                fate.delivered,
                fate.wrong,
                fate.read,
                film.frames,
                fate.beside,
            );
            fate.advice.iter().for_each(|advice| println!("      {advice}"));
            fate
        })
        .collect();
    let delivered = fates.iter().filter(|fate| fate.delivered.is_some()).count();
    let wrong: usize = fates.iter().map(|fate| fate.wrong).sum();
    println!("{delivered} of {films} delivered, {wrong} wrong messages");
    let mut reliability = Reliability::default();
    fates.iter().for_each(|fate| reliability.merge(&fate.reliability));
    println!("| stated | wrong (95 %) | wrong bits |\n|---|---|---|");
    reliability.bins().for_each(|bin| println!("| {bin} |"));
}

/// Describes the result of a frame that shows `bits`.
fn told(bits: u64, report: &PanelReport) -> String {
    match &report.reading {
        Ok(reading) => {
            let wrong = reading.detection.bits.bits() ^ bits;
            let row = |row: u64| match (wrong >> (8 * row) & 0xff).count_ones() {
                0..=1 => '+',
                7..=8 => '-',
                _ => '?',
            };
            let mixed = if reading.detection.mixed.is_some() { ", mixed" } else { "" };
            let rows: String = (0..8).map(row).collect();
            let [x, y] = reading.corners.centre_px();
            let bits = reading.detection.bits;
            let Detection {
                confidence, modulation, ..
            } = reading.detection;
            format!(
                "{rows} {bits} at ({x:.1}, {y:.1}), {:.1} px apart, {confidence:.3} sure, contrast {modulation:.2}{mixed}",
                reading.corners.pitch_px()
            )
        }
        Err(loss) => loss.to_string(),
    }
}
