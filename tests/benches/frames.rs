//! Frames a second of rendering and features at 50 m and interval 1, on one thread, compared with the straightforward renderer and the
//! fully supersampled one. The last lines are the ratios of all of them, timed alternately.
//!
//! `cargo bench -p vocc-tests --bench frames`

use std::time::Instant;

use divan::{Bencher, black_box};
use rx_pipeline::cells::CellMap;
use rx_pipeline::corners::Corners;
use rx_pipeline::features::Features;
use rx_pipeline::frame::Frame;
use sim::accuracy::Level;
use sim::renderer::canvas::Canvas;
use sim::renderer::{PanelExposure, Renderer};
use sim::scene::Scene;
use studies::baselines::supersampled;
use studies::baselines::{Panel, straightforward};
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings};

use link::panel::PanelFrame;

fn main() {
    divan::main();
    print_ratios();
}

const BITS: u64 = 0x9d2c_5680_efc6_0b3a;

fn scene() -> Scene {
    Scene::load("paper", &[]).expect("a preset")
}

fn settings(level: Level) -> Settings {
    Settings {
        level,
        ..Settings::fast(1, 1, DetectorChoice::KMeans)
    }
}

/// One frame of the Monte Carlo.
#[divan::bench(args = [Level::Fast, Level::Fine])]
fn render_and_features(bencher: Bencher, level: Level) {
    let mut frame = evaluator_frame(level);
    bencher.bench_local(|| black_box(frame()));
}

/// The same frame with detection and statistics.
#[divan::bench]
fn evaluate(bencher: Bencher) {
    let evaluator = Evaluator::new(&scene(), settings(Level::Fast)).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let mut frame = 0;
    bencher.bench_local(|| {
        frame += 1;
        black_box(evaluator.evaluate(frame..frame + 1, &mut workspace).expect("a measurable frame"))
    });
}

/// Rendering and readout alone.
#[divan::bench(args = [Level::Fast, Level::Fine])]
fn render_only(bencher: Bencher, level: Level) {
    let renderer = Renderer::new(&scene(), level).expect("a visible scene");
    let mut canvas = Canvas::new(renderer.surroundings(0));
    let mut grey = vec![0; canvas.values().len()];
    let moment = renderer.moment(1, 0);
    let mut shown = renderer.steady(0, PanelFrame::from_bits(BITS));
    bencher.bench_local(|| {
        shown = PanelExposure {
            shift_px: [(shown.shift_px[0] + 0.37) % 1.0, (shown.shift_px[1] + 0.73) % 1.0],
            ..shown
        };
        renderer.draw(&moment, &[shown], &mut canvas);
        renderer.read_out(1, 0, &canvas, &mut grey);
        black_box(grey[0])
    });
}

/// The same frames by a baseline renderer.
#[divan::bench(args = BASELINES)]
fn baseline_render_and_features(bencher: Bencher, baseline: &Baseline) {
    let mut frame = baseline_frame(baseline.render);
    bencher.bench_local(|| black_box(frame()));
}

/// A renderer: a function of a [`Panel`], blur, gamma and side in px.
#[derive(Clone, Copy)]
struct Baseline {
    name: &'static str,
    render: fn(&Panel, f64, f64, usize) -> Vec<u8>,
}

impl std::fmt::Display for Baseline {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

const BASELINES: [Baseline; 3] = [
    Baseline {
        name: "straightforward",
        render: straightforward::render,
    },
    Baseline {
        name: "straightforward by raster",
        render: straightforward::render_by_raster,
    },
    Baseline {
        name: "supersampled",
        render: supersampled_by_8,
    },
];

/// The same on a raster eight times finer.
fn supersampled_by_8(panel: &Panel, sigma_px: f64, gamma: f64, side: usize) -> Vec<u8> {
    supersampled::render(panel, sigma_px, gamma, side, 8)
}

/// Renders the panel with its surroundings at another sub-pixel phase and measures the features.
fn baseline_frame(render: fn(&Panel, f64, f64, usize) -> Vec<u8>) -> impl FnMut() -> f32 {
    let pitch_px = 0.06 * 25e-3 / 6.875e-6 / 50.0;
    let side = (8.0 * pitch_px) as usize + 16;
    let mut map = Box::new(CellMap::<{ 128 * 128 }>::empty());
    let mut shift = 0.0;
    move || {
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
        let corners = Corners::new([[near, near], [far, near], [far, far], [near, far]]).expect("a square");
        map.build(&corners, side, side).expect("a panel in the picture");
        Features::measure(&Frame::new(&grey, side, side).expect("a picture"), &map)
            .expect("cells")
            .gri[0]
    }
}

/// Rendering, readout, cell map at another sub-pixel phase, AGR and GRI: one frame of the Monte Carlo.
fn evaluator_frame(level: Level) -> impl FnMut() -> f32 {
    let evaluator = Evaluator::new(&scene(), settings(level)).expect("a visible scene");
    let mut workspace = evaluator.workspace();
    let mut frame = 0;
    move || {
        frame += 1;
        let read = evaluator.observe(frame, &mut workspace);
        read.expect("a measurable frame").features.gri[0]
    }
}

/// A name, the number of frames per turn, and one frame.
type Contender = (&'static str, usize, Box<dyn FnMut() -> f32>);

/// Times all in turn and prints medians over the turns with their quartiles. The fastest frame of a turn counts, because nothing else used
/// the processor during it. A frame of many milliseconds, like the supersampled one, has the processor for itself only on an idle machine.
fn print_ratios() {
    let mut contenders: [Contender; 5] = [
        ("straightforward", 10, Box::new(baseline_frame(straightforward::render))),
        ("by raster", 10, Box::new(baseline_frame(straightforward::render_by_raster))),
        ("supersampled", 1, Box::new(baseline_frame(supersampled_by_8))),
        ("fine", 40, Box::new(evaluator_frame(Level::Fine))),
        ("fast", 40, Box::new(evaluator_frame(Level::Fast))),
    ];
    let mut micros = vec![Vec::new(); contenders.len()];
    for _ in 0..TURNS {
        for ((_, frames, frame), micros) in contenders.iter_mut().zip(&mut micros) {
            let turn = (0..*frames).map(|_| {
                let start = Instant::now();
                black_box(frame());
                start.elapsed().as_secs_f64() * 1e6
            });
            micros.push(turn.fold(f64::INFINITY, f64::min));
        }
    }
    println!("\nrender and features, median of {TURNS} turns (quartiles)");
    println!("{:>16} | {:^36} | {:^36}", "", "µs a frame", "times as fast as straightforward");
    for ((name, ..), own) in contenders.iter().zip(&micros) {
        let ratios = own.iter().zip(&micros[0]).map(|(own, baseline)| baseline / own);
        println!("{name:>16} | {} | {}", quartiles(own.clone()), quartiles(ratios.collect()));
    }
}

/// Number of turns.
const TURNS: usize = 41;

/// The median with the quartiles about it.
fn quartiles(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |quarter: usize| values[(values.len() - 1) * quarter / 4];
    format!("{:10.4} ({:10.4} to {:10.4})", at(2), at(1), at(3))
}
