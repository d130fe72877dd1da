//! Frames a second of render + features at 50 m and interval 1, on one thread, against the straightforward renderer.
//!
//! `cargo bench -p vocc-tests --bench frames`

use divan::{Bencher, black_box};
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use sim::accuracy::Level;
use sim::canvas::Canvas;
use sim::detectors::DetectorChoice;
use sim::evaluate::{Evaluator, Settings};
use sim::renderer::{Renderer, Shown};
use sim::scene::Scene;
use vocc_tests::straightforward::{Panel, render};

use link::panel::PanelFrame;

fn main() {
    divan::main();
}

const BITS: u64 = 0x9d2c_5680_efc6_0b3a;

fn scene() -> Scene {
    Scene::load("paper", &[]).expect("a preset")
}

fn settings(level: Level) -> Settings {
    Settings {
        frames: 1,
        seed: 1,
        random_reflectance: true,
        detector: DetectorChoice::KMeans,
        level,
    }
}

/// Render, read out, cell map at a new sub-pixel phase, AGR and GRI: one frame of the Monte Carlo.
#[divan::bench(args = [Level::Fast, Level::Fine])]
fn render_and_features(bencher: Bencher, level: Level) {
    let evaluator = Evaluator::new(&scene(), settings(level)).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let mut frame = 0;
    bencher.bench_local(|| {
        frame += 1;
        black_box(
            evaluator
                .read(frame, &mut workspace)
                .expect("a measurable frame")
                .features
                .gri,
        )
    });
}

/// The same with detection and statistics.
#[divan::bench]
fn evaluate(bencher: Bencher) {
    let evaluator = Evaluator::new(&scene(), settings(Level::Fast)).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let mut frame = 0;
    bencher.bench_local(|| {
        frame += 1;
        black_box(
            evaluator
                .evaluate(frame..frame + 1, &mut workspace)
                .expect("a measurable frame"),
        )
    });
}

/// Render and read out alone.
#[divan::bench(args = [Level::Fast, Level::Fine])]
fn render_only(bencher: Bencher, level: Level) {
    let renderer = Renderer::new(&scene(), level).expect("a visible scene");
    let mut canvas = Canvas::new(renderer.surroundings(0));
    let mut grey = vec![0; canvas.values().len()];
    let moment = renderer.moment(0);
    let mut shown = renderer.steady(0, PanelFrame::from_bits(BITS));
    bencher.bench_local(|| {
        shown = Shown {
            shift_px: [
                (shown.shift_px[0] + 0.37) % 1.0,
                (shown.shift_px[1] + 0.73) % 1.0,
            ],
            ..shown
        };
        renderer.draw(&moment, &[shown], &mut canvas);
        renderer.read_out(1, 0, &canvas, &mut grey);
        black_box(grey[0])
    });
}

/// The same frames by the straightforward renderer: the baseline.
#[divan::bench]
fn straightforward_render_and_features(bencher: Bencher) {
    let pitch_px = 0.06 * 25e-3 / 6.875e-6 / 50.0;
    let side = (8.0 * pitch_px) as usize + 16;
    let mut map = Box::new(CellMap::<{ 128 * 128 }>::empty());
    let mut shift = 0.0;
    bencher.bench_local(|| {
        shift = (shift + 0.37) % 1.0;
        let first_px = [7.0 + pitch_px / 2.0 + shift; 2];
        let panel = Panel {
            bits: BITS,
            first_px,
            pitch_px,
            radius_px: pitch_px / 4.0,
            off: 2.2,
            on: 16.0,
        };
        let grey = render(&panel, 1.5, 2.2, side);
        let [near, far] = [first_px[0] as f32, (first_px[0] + 7.0 * pitch_px) as f32];
        let corners =
            Corners::new([[near, near], [far, near], [far, far], [near, far]]).expect("a square");
        map.build(&corners, side, side)
            .expect("a panel in the picture");
        black_box(
            Features::measure(&Frame::new(&grey, side, side).expect("a picture"), &map)
                .expect("cells")
                .gri,
        )
    });
}
