//! Measures a locator's detections and false detections over many scenes.

use std::ops::Range;

use image::GrayImage;
use link::camera::Camera;
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::{Effort, Locator, LocatorMemory};
use studies::random_scenes::{FRAMES, RIGHT, ShakenPhotograph, WINDOW_PIXELS};
pub use studies::random_scenes::{RandomScene, photographs};

/// Outcome of many searches.
#[derive(Debug, Default)]
pub struct Tally {
    /// Panels found in the first, second and third frame.
    pub found_at: [usize; FRAMES],
    /// Detections at a wrong position.
    pub wrong: usize,
    /// Panels not found.
    pub lost: usize,
    /// Maximum corner error of each panel found, in pixels.
    pub errors_px: Vec<f64>,
}

/// Searches for the panel of each scene, rotated by `turn_deg` more, in up to three frames, as a receiver does; calls `tell` for each
/// failure.
pub fn search_scenes(seeds: Range<u64>, turn_deg: f64, size: [usize; 2], photographs: &[GrayImage], mut tell: impl FnMut(&str)) -> Tally {
    let locator = Locator::new(Camera::default()).expect("the default settings");
    let mut memory = Box::new(LocatorMemory::<WINDOW_PIXELS>::new());
    let mut tally = Tally::default();
    for seed in seeds {
        let sighting = RandomScene::draw_turned(seed, turn_deg, size, FRAMES as u64, photographs).expect("a scene that can be drawn");
        let frames: Vec<Frame> = sighting.frames.iter().map(|pixels| frame(pixels, size)).collect();
        let mut why = Vec::new();
        let mut outcome = None;
        for number in 0..FRAMES {
            let earlier: Vec<Frame> = frames[..number].iter().rev().copied().collect();
            let effort = Effort::Share(number as u64);
            match locator.locate_among(&frames[number], &earlier, &[], effort, &mut memory, &mut ()) {
                Ok(location) => {
                    outcome = Some((number, sighting.error_px(location.corners.points())));
                    break;
                }
                Err(error) => why.push(error.to_string()),
            }
        }
        match outcome {
            Some((number, error_px)) if error_px < RIGHT * sighting.pitch_px => {
                tally.found_at[number] += 1;
                tally.errors_px.push(error_px);
            }
            Some((number, error_px)) => {
                tally.wrong += 1;
                tell(&format!("wrong by {error_px:.1} px at frame {number}: {}", sighting.what));
            }
            None => {
                tally.lost += 1;
                tell(&format!("lost: {}: {}", sighting.what, why.join("; ")));
            }
        }
    }
    tally
}

/// Searches scenes without panels: photographs of random contrast and noise, alone and with a frame shifted by camera shake; returns the
/// number of detections.
pub fn search_empty(seeds: Range<u64>, size: [usize; 2], photographs: &[GrayImage], mut tell: impl FnMut(&str)) -> usize {
    let locator = Locator::new(Camera::default()).expect("the default settings");
    let mut memory = Box::new(LocatorMemory::<WINDOW_PIXELS>::new());
    let mut seen = 0;
    for seed in seeds {
        let photograph = ShakenPhotograph::draw(seed, size, photographs).expect("a photograph");
        let noise = photograph.noise_grey;
        let frames: Vec<Frame> = photograph.frames.iter().map(|pixels| frame(pixels, size)).collect();
        let mut tell_of = |kind: &str, found: rx_pipeline::locate::Location| {
            seen += 1;
            tell(&format!(
                "seen in photograph {seed}, {kind}, noise {noise}, signal to noise {:.0}: {:?}",
                found.signal_to_noise,
                found.corners.points()
            ));
        };
        if let Ok(found) = locator.locate(&frames[0], &mut memory) {
            tell_of("alone", found);
        }
        for number in 1..FRAMES {
            let earlier: Vec<Frame> = frames[..number].iter().rev().copied().collect();
            if let Ok(found) = locator.locate_among(&frames[number], &earlier, &[], Effort::Share(seed), &mut memory, &mut ()) {
                tell_of("moved", found);
            }
        }
    }
    seen
}

fn frame(pixels: &[u8], [width, height]: [usize; 2]) -> Frame<'_> {
    Frame::new(pixels, width, height).expect("as many pixels as the frame has")
}
