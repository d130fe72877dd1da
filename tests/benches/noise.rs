//! Times whole noisy frames of 1920 × 1080 pixels on one thread, compared with a Poisson and a normal number for each pixel.
//!
//! `cargo bench -p vocc-tests --bench noise`

use std::path::PathBuf;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use link::panel::PanelFrame;
use rand::Rng;
use rand_distr::{Distribution, Poisson};
use sim::accuracy::Level;
use sim::camera::curve::Curve;
use sim::camera::exposure::Exposure;
use sim::camera::grey::GammaEncoder;
use sim::camera::noise::{FlatNoise, Noise, PixelNoise};
use sim::random::{Purpose, normal, stream};
use sim::renderer::Renderer;
use sim::renderer::canvas::Canvas;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};

const PIXELS: usize = 1920 * 1080;

fn main() {
    divan::main();
}

/// A preset, `night` or `day`: unchanged, with a photograph of all grey levels behind, or with a vignetting lens.
#[derive(Clone, Copy, Debug)]
enum Behind {
    Plain,
    Photograph,
    Vignetting,
}

const CASES: [(&str, Behind); 6] = [
    ("night", Behind::Plain),
    ("day", Behind::Plain),
    ("night", Behind::Photograph),
    ("day", Behind::Photograph),
    ("night", Behind::Vignetting),
    ("day", Behind::Vignetting),
];

fn scene((preset, behind): (&str, Behind)) -> Scene {
    let setting = match behind {
        Behind::Plain => "camera.vignetting=false".into(),
        Behind::Vignetting => "camera.vignetting=true".into(),
        Behind::Photograph => format!("ambient.background_image={:?}", photograph()),
    };
    Scene::load(preset, &[setting]).expect("a preset")
}

/// A slanted ramp with some texture, as a file.
fn photograph() -> PathBuf {
    let path = std::env::temp_dir().join(format!("vocc-bench-{}.png", std::process::id()));
    if !path.exists() {
        let mut random = stream(1, 0, Purpose::Bits);
        let level = |x: u32, y: u32, texture: u32| (40 + (x + y) * 180 / 3000 + texture % 16) as u8;
        image::GrayImage::from_fn(1920, 1080, |x, y| image::Luma([level(x, y, random.next_u32())]))
            .save(&path)
            .expect("room for a picture");
    }
    path
}

/// A whole frame: drawing the panel and reading out all pixels.
#[divan::bench(args = CASES)]
fn whole_frame(bencher: Bencher, case: (&str, Behind)) {
    let renderer = Renderer::new(&scene(case), Level::Fast).expect("a visible scene");
    let mut canvas = Canvas::new(renderer.lit_region());
    let mut grey = vec![0; PIXELS];
    let shown = [renderer.steady(0, PanelFrame::from_bits(0x9d2c_5680_efc6_0b3a))];
    let mut frame = 0;
    bencher.counter(ItemsCount::new(PIXELS)).bench_local(|| {
        frame += 1;
        renderer.frame(1, &renderer.moment(1, frame), &shown, &mut canvas, &mut grey);
        black_box(grey[0])
    });
}

/// The baseline: the linear image of the same frame, with a Poisson and a normal number for each pixel.
#[divan::bench(args = CASES, sample_count = 10)]
fn number_by_number(bencher: Bencher, case: (&str, Behind)) {
    let scene = scene(case);
    let renderer = Renderer::new(&scene, Level::Fast).expect("a visible scene");
    let mut canvas = Canvas::new(renderer.sensor());
    let shown = [renderer.steady(0, PanelFrame::from_bits(0x9d2c_5680_efc6_0b3a))];
    renderer.draw(&renderer.moment(1, 0), &shown, &mut canvas);
    let (mut grey, mut frame) = (vec![0; PIXELS], 0);
    let encoder = GammaEncoder::new(scene.camera.gamma);
    let iso = Exposure::of(&scene).iso;
    let electrons_per_linear = scene.camera.full_well_e * 100.0 / iso / sim::camera::grey::linear(255.0, scene.camera.gamma);
    bencher.counter(ItemsCount::new(PIXELS)).bench_local(|| {
        frame += 1;
        let mut random = stream(1, frame, Purpose::Noise);
        for (grey, &linear) in grey.iter_mut().zip(canvas.values()) {
            let expected = f64::from(linear) * electrons_per_linear;
            let caught = Poisson::new(expected).map_or(0.0, |poisson| poisson.sample(&mut random));
            let read = caught + scene.camera.read_noise_e * normal(&mut random);
            *grey = encoder.grey((read / electrons_per_linear) as f32);
        }
        black_box(grey[0])
    });
}

/// The limit: the random bits of a frame, 2 bytes a pixel over a plain background, 4 over a picture.
#[divan::bench(args = [2, 4])]
fn random_bits_alone(bencher: Bencher, bytes_a_pixel: usize) {
    let mut bytes = [0; 1024];
    let mut frame = 0;
    bencher.counter(ItemsCount::new(PIXELS)).bench_local(|| {
        frame += 1;
        let mut random = stream(1, frame, Purpose::Noise);
        for _ in 0..PIXELS * bytes_a_pixel / bytes.len() {
            random.fill_bytes(&mut bytes);
            black_box(&mut bytes);
        }
    });
}

fn noise(preset: &str) -> Noise {
    let scene = Scene::load(preset, &[]).expect("a preset");
    Noise::new(&scene, &Exposure::of(&scene), Curve::of(&scene.camera))
}

/// A frame with equal pixels.
#[divan::bench(args = ["night", "day"])]
fn pixels_of_one_value(bencher: Bencher, preset: &str) {
    let flat = FlatNoise::new(&noise(preset), 1.0);
    let (mut grey, mut random) = (vec![0; PIXELS], stream(1, 0, Purpose::Background));
    bencher
        .counter(ItemsCount::new(PIXELS))
        .bench_local(|| flat.fill(&mut grey, &mut random));
}

/// A frame with arbitrary pixels.
#[divan::bench(args = ["night", "day"])]
fn pixels_of_any_value(bencher: Bencher, preset: &str) {
    let pixels = PixelNoise::new(&noise(preset));
    let linear: Vec<f32> = (0..PIXELS).map(|i| (i * 7919 % 5000) as f32 * 1e-3).collect();
    let (mut grey, mut random) = (vec![0; PIXELS], stream(1, 0, Purpose::Noise));
    bencher
        .counter(ItemsCount::new(PIXELS))
        .bench_local(|| pixels.read(&linear, &mut random, &mut grey));
}

/// The cost of a renderer's tables, once per renderer.
#[divan::bench(args = ["night", "day"])]
fn tables(bencher: Bencher, preset: &str) {
    let noise = noise(preset);
    bencher.bench_local(|| PixelNoise::new(&noise));
}

/// One frame of the Monte Carlo with noise and without.
#[divan::bench(args = ["auto", "off"])]
fn evaluate_night(bencher: Bencher, noise: &str) {
    let scene = Scene::load("night", &[format!("effects.noise={noise}")]).expect("a preset");
    let settings = Settings::fast(1, 1, DetectorChoice::KMeans);
    let evaluator = Evaluator::new(&scene, settings).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let mut frame = 0;
    bencher.bench_local(|| {
        frame += 1;
        black_box(evaluator.evaluate(frame..frame + 1, &mut workspace).expect("a measurable frame"))
    });
}
