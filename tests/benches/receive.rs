//! Times a cold search in full-HD frames and a followed frame: `cargo bench -p vocc-tests --bench receive`.

use std::path::Path;

use divan::{Bencher, black_box};
use link::camera::Camera;
use rx_pipeline::detect::{Detector, Method};
use rx_pipeline::frame::Frame;
use rx_pipeline::locate::{Effort, Locator, LocatorMemory};
use rx_pipeline::receiver::{FrameSearch, Receiver, ReceiverMemory, ReceiverSettings, SearchMemory};
use sim::road::{LinkSettings, Road};
use sim::scene::Scene;
use vocc_tests::sightings::{RandomScene, photographs};

fn main() {
    divan::main();
}

const SIZE: [usize; 2] = [1920, 1080];
const PIXELS: usize = 160 * 160;

/// Panels in front of photographs: dusk at 46 m, day at 35 m, night at 49 m.
const SEEDS: [u64; 3] = [1, 9, 19];

fn sighting(seed: u64) -> RandomScene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../studies/photographs");
    let photographs = photographs(&folder).expect("readable photographs");
    RandomScene::draw(seed, SIZE, 3, &photographs).expect("a scene that can be drawn")
}

fn frames(sighting: &RandomScene) -> Vec<Frame<'_>> {
    let frame = |pixels| Frame::new(pixels, sighting.width, sighting.height).expect("a frame");
    sighting.frames.iter().map(|pixels| frame(pixels.as_slice())).collect()
}

/// A noisy frame with clutter and the frame before it, while nothing is known of the panel.
#[divan::bench(args = SEEDS, max_time = 3)]
fn cold_locate(bencher: Bencher, seed: u64) {
    let sighting = sighting(seed);
    let frames = frames(&sighting);
    let locator = Locator::new(Camera::default()).expect("the default settings");
    let mut memory = Box::new(LocatorMemory::<PIXELS>::new());
    bencher.bench_local(|| locator.locate_among(black_box(&frames[1]), &frames[..1], &[], Effort::Share(1), &mut memory, &mut ()));
}

/// The same search in a single frame, which also has to examine the clutter's candidates.
#[divan::bench(args = SEEDS, max_time = 3)]
fn cold_locate_single_frame(bencher: Bencher, seed: u64) {
    let sighting = sighting(seed);
    let frames = frames(&sighting);
    let locator = Locator::new(Camera::default()).expect("the default settings");
    let mut memory = Box::new(LocatorMemory::<PIXELS>::new());
    bencher.bench_local(|| locator.locate_among(black_box(&frames[1]), &[], &[], Effort::Share(1), &mut memory, &mut ()));
}

/// A whole frame of a followed panel: track, cells, features, k-means, symbols and framing.
#[divan::bench(args = SEEDS, max_time = 3)]
fn followed_frame_k_means(bencher: Bencher, seed: u64) {
    followed_frame(bencher, seed, Detector::default().into());
}

/// The same frame with maximum likelihood.
#[divan::bench(args = SEEDS, max_time = 3)]
fn followed_frame_maximum_likelihood(bencher: Bencher, seed: u64) {
    followed_frame(bencher, seed, Method::default());
}

/// The same frame with k-means for near panels at this distance in metres; the first one fills the picture.
#[divan::bench(args = [2.0, 4.0, 8.0, 16.0, 32.0], max_time = 3)]
fn followed_frame_near(bencher: Bencher, distance_m: f64) {
    let pose = format!("pose.distance_m={distance_m}");
    let scene = Scene::load("day", &[pose]).expect("a valid scene");
    let settings = LinkSettings::new(b"lane closed".to_vec(), Detector::default().into(), 1);
    let mut road = Road::new(&scene, &settings).expect("a link");
    let film: Vec<Vec<u8>> = (0..3).map(|number| road.frame(number).expect("a frame").grey.to_vec()).collect();
    let frame = |pixels| Frame::new(pixels, SIZE[0], SIZE[1]).expect("a frame");
    let frames: Vec<Frame<'_>> = film.iter().map(|pixels| frame(pixels.as_slice())).collect();
    follow(bencher, &frames, Detector::default().into(), &format!("{distance_m} m"));
}

fn followed_frame(bencher: Bencher, seed: u64, method: Method) {
    let sighting = sighting(seed);
    follow(bencher, &frames(&sighting), method, &sighting.what);
}

fn follow(bencher: Bencher, frames: &[Frame<'_>], method: Method, what: &str) {
    let room = FrameSearch::<Box<SearchMemory>>::bytes(SIZE[0], SIZE[1]);
    let history = vec![0; room];
    let memory = Box::<ReceiverMemory<PIXELS>>::default();
    let settings = ReceiverSettings {
        method,
        ..ReceiverSettings::default()
    };
    let search = FrameSearch::with_history(Box::<SearchMemory>::default(), history);
    let mut receiver = Receiver::new(settings, memory, search).expect("the default settings");
    let mut number = 0;
    let mut next = || {
        number += 1;
        receiver.frame(number, black_box(&frames[(number % 3) as usize])).reading.is_ok()
    };
    for _ in 0..6 {
        next();
    }
    assert!(next(), "the panel is followed: {what}");
    bencher.bench_local(next);
}
