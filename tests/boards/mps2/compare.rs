//! Compares the board with this computer.

use std::path::Path;

use link::camera::Camera;
use rx_pipeline::settings::TrackingSettings;

use crate::Images;
use crate::board;
use crate::film::Shots;
use crate::format::MethodChoice;
use crate::measure::{Costs, KMEANS_STACK_MAX, STACK_MAX};

/// Symbols per frame period of the shots.
const SYMBOLS_PER_FRAME: f32 = 0.9;
const PATIENCE_FRAMES: u32 = TrackingSettings::DEFAULT.patience_frames as u32;

/// Lets the board read regions of `side` px around the panel, and checks for the same bits, soft values and corners as on this computer,
/// and for the sent bits.
fn show(image: &Path, shots: &Shots, side: u16, method: MethodChoice) -> Costs {
    let film = shots.cut(side, method, Camera::default(), SYMBOLS_PER_FRAME);
    let mut costs = Costs::default();
    // Number of frames that show one symbol.
    let clear = film.sent.iter().flatten().count();
    let (mut read_clear, mut wrong) = (0, 0);
    for (number, report) in board::read(image, &film).iter().enumerate() {
        costs.add(report);
        assert_eq!(
            report.reading, film.readings[number],
            "frame {number}: the board's reading and this computer's"
        );
        if let (Some(reading), Some(sent)) = (report.reading, film.sent[number]) {
            read_clear += 1;
            wrong += (sent ^ reading.bits).count_ones();
        }
    }
    assert!(read_clear * 20 >= clear * 19, "{read_clear} of {clear}");
    assert_eq!(wrong, 0, "bits that are not those sent");
    costs.tell(&format!("{method:?}, {side} × {side} px"));
    costs
}

/// The paper's detector: at most 1.5 million instructions for half of the frames, and at most 1.8 million for each.
pub fn k_means_reads_as_on_this_computer(images: &Images) {
    show(&images.receiver, &Shots::draw(35.0, 30), 64, MethodChoice::KMeans).assert_within([1_500_000, 1_800_000], KMEANS_STACK_MAX);
}

/// The better detector: seven times the instructions of k-means for half of the frames, seventy times for a few.
pub fn maximum_likelihood_reads_as_on_this_computer(images: &Images) {
    let shots = Shots::draw(35.0, 20);
    show(&images.receiver, &shots, 64, MethodChoice::MaximumLikelihood).assert_within([9_000_000, 135_000_000], STACK_MAX);
}

/// Regions of 128×128 pixels, almost filled by the panel.
pub fn the_largest_region_is_read(images: &Images) {
    for (method, frames, instructions) in [
        (MethodChoice::KMeans, 8, [4_200_000, 6_200_000]),
        (MethodChoice::MaximumLikelihood, 4, [115_000_000, 115_000_000]),
    ] {
        show(&images.receiver, &Shots::draw(17.0, frames), 128, method).assert_within(instructions, STACK_MAX);
    }
}

/// Maximum instructions for a frame in which the panel is searched for around its place.
const SEARCH_MAX: u64 = 32_000_000;

/// A missing panel is searched for around its place until it is given up.
pub fn a_lost_panel_is_reported(images: &Images) {
    let shots = Shots::draw(35.0, 1).and_blank(PATIENCE_FRAMES as usize + 1);
    show(&images.receiver, &shots, 64, MethodChoice::KMeans).assert_within([SEARCH_MAX; 2], STACK_MAX);
}
