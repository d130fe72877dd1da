//! Renders full-HD frames into a folder and times the cold search in each; `tests/tools/beside-apriltag` compares another detector.
//!
//! `cargo run --release -p vocc-tests --example search_time -- FOLDER`

use std::path::Path;
use std::time::Instant;

use link::camera::Camera;
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::{Effort, Locator, LocatorMemory};
use vocc_tests::sightings::{RandomScene, photographs};

const SIZE: [usize; 2] = [1920, 1080];

fn main() {
    let folder = std::env::args().nth(1).expect("usage: search_time FOLDER");
    let photographs = photographs(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../studies/photographs"))).expect("readable photographs");
    let locator = Locator::new(Camera::default()).expect("the default settings");
    let mut memory = Box::new(LocatorMemory::<{ 160 * 160 }>::new());
    for seed in [0, 1, 9, 16, 19, 38] {
        let sighting = RandomScene::draw(seed, SIZE, 2, &photographs).expect("a scene that can be drawn");
        let frames: Vec<Frame> = sighting
            .frames
            .iter()
            .map(|pixels| Frame::new(pixels, SIZE[0], SIZE[1]).expect("a frame"))
            .collect();
        let mut fastest_ms = f64::INFINITY;
        let mut found = false;
        for _ in 0..20 {
            let begun = Instant::now();
            let location = locator.locate_among(&frames[1], &frames[..1], &[], Effort::Share(1), &mut memory, &mut ());
            fastest_ms = fastest_ms.min(begun.elapsed().as_secs_f64() * 1e3);
            found = location.is_ok();
        }
        let path = Path::new(&folder).join(format!("frame-{seed:02}.png"));
        image::save_buffer(
            &path,
            &sighting.frames[1],
            SIZE[0] as u32,
            SIZE[1] as u32,
            image::ExtendedColorType::L8,
        )
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        println!(
            "{seed:>2}: {fastest_ms:6.2} ms, {}: {}",
            if found { "found" } else { "not found" },
            sighting.what
        );
    }
}
