//! The cost of a frame of the Monte Carlo over distance, interval and number of frames, and the additional cost of each effect.
//!
//! `cargo bench -p vocc-tests --bench scaling`
//!
//! Each figure is the minimum of several rounds in which all settings take turns, so that other work of the machine affects all of them.
//! The tables have ratios to the setting that they name.

use std::time::Instant;

use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::{Evaluator, Settings, Workspace};

const DISTANCES_M: [f64; 5] = [30.0, 40.0, 50.0, 60.0, 70.0];
const INTERVALS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];
const ROUNDS: usize = 200;
/// So few frames that a batch ends before other work of the machine gets its turn.
const FRAMES: u64 = 20;

/// One effect at a time, in a scene at 50 m that activates it.
const EFFECTS: [(&str, &[&str]); 16] = [
    ("none but the blur", &[]),
    ("no blur either", &["effects.blur=\"off\""]),
    ("atmosphere", &["effects.atmosphere=\"on\""]),
    ("airlight", &["atmosphere.airlight=true", "atmosphere.transmission_at_70m=0.3"]),
    ("led_spread", &["panel.led_spread=0.1", "effects.led_spread=\"on\""]),
    ("pwm", &["panel.pwm_hz=20000", "effects.pwm=\"on\""]),
    ("scanning", &["panel.scan_rows=8", "panel.pwm_hz=20000", "effects.scanning=\"on\""]),
    (
        "symbol_change",
        &["link.phase=0.05", "link.symbol_rate_hz=90", "effects.symbol_change=\"on\""],
    ),
    ("carrier", &["link.carrier_cycles=16", "effects.carrier=\"on\""]),
    ("rolling_shutter", &["camera.readout_s=0.008", "effects.rolling_shutter=\"on\""]),
    ("board", &["panel.board_reflectance=0.05", "effects.board=\"on\""]),
    ("perspective", &["pose.yaw_deg=20", "effects.perspective=\"on\""]),
    (
        "distortion",
        &["camera.distortion_k1=-0.1", "pose.x_m=5", "effects.distortion=\"on\""],
    ),
    ("vignetting", &["camera.vignetting=true", "effects.vignetting=\"on\""]),
    ("flare", &["ambient.lamp_lx=30", "ambient.lamp_x_deg=20", "effects.flare=\"on\""]),
    ("noise", &["effects.noise=\"on\""]),
];

/// Frames of one setting, timed a batch at a time.
struct Course {
    evaluator: Evaluator,
    workspace: Workspace,
    least_s: f64,
}

impl Course {
    fn new(keys: &[String]) -> Self {
        let scene = Scene::load("paper", keys).expect("a valid scene");
        let settings = Settings {
            random_reflectance: false,
            ..Settings::fast(FRAMES, 1, DetectorChoice::KMeans)
        };
        let evaluator = Evaluator::new(&scene, settings).expect("a visible scene");
        Self {
            workspace: evaluator.workspace(),
            evaluator,
            least_s: f64::INFINITY,
        }
    }

    fn time(&mut self, frames: u64) {
        let start = Instant::now();
        for frame in 0..frames {
            let reading = self.evaluator.observe(frame, &mut self.workspace);
            std::hint::black_box(reading.expect("a measurable frame"));
        }
        let a_frame = start.elapsed().as_secs_f64() / frames as f64;
        self.least_s = self.least_s.min(a_frame);
    }

    fn pixels(&self) -> usize {
        let region = self.evaluator.renderer().cells_region(0);
        region.width * region.height
    }
}

fn run(courses: &mut [Course]) {
    for _ in 0..ROUNDS {
        courses.iter_mut().for_each(|course| course.time(FRAMES));
    }
}

fn geometry() {
    let keys = |distance: f64, interval: f64| [format!("pose.distance_m={distance}"), format!("panel.interval={interval}")];
    let mut courses: Vec<Course> = DISTANCES_M
        .iter()
        .flat_map(|&distance| INTERVALS.map(|interval| Course::new(&keys(distance, interval))))
        .collect();
    run(&mut courses);
    let base = &courses[2 * INTERVALS.len() + 1];
    let (base_s, base_pixels) = (base.least_s, base.pixels());
    println!(
        "\nRender, AGR and GRI, `fast`; 1 is d = 50 m, i = 1: {:.2} µs for {base_pixels} pixels\n",
        base_s * 1e6
    );
    println!("| d | {} |", INTERVALS.map(|i| format!("i = {i}")).join(" | "));
    println!("|---|{}", "---|".repeat(INTERVALS.len()));
    for (distance, row) in DISTANCES_M.iter().zip(courses.chunks(INTERVALS.len())) {
        let cells: Vec<String> = row
            .iter()
            .map(|course| {
                let (time, pixels) = (course.least_s / base_s, course.pixels() as f64 / base_pixels as f64);
                format!("{time:.2} ({pixels:.2} of the pixels)")
            })
            .collect();
        println!("| {distance} m | {} |", cells.join(" | "));
    }
}

fn effects() {
    let mut courses: Vec<Course> = EFFECTS
        .iter()
        .map(|(_, keys)| {
            let keys: Vec<String> = keys.iter().map(|&key| key.to_owned()).collect();
            Course::new(&keys)
        })
        .collect();
    run(&mut courses);
    let base_s = courses[0].least_s;
    println!("\nOne effect more, at d = 50 m, i = 1\n");
    println!("| effect | time of a frame |\n|---|---|");
    for ((name, _), course) in EFFECTS.iter().zip(&courses) {
        println!("| {name} | {:.2} |", course.least_s / base_s);
    }
}

fn frames() {
    let mut course = Course::new(&[]);
    println!("\nFrames of one run\n\n| frames | time of one |\n|---|---|");
    let mut first_s = None;
    for frames in [1_000, 10_000, 100_000] {
        course.least_s = f64::INFINITY;
        (0..3).for_each(|_| course.time(frames));
        let first_s = *first_s.get_or_insert(course.least_s);
        println!("| {frames} | {:.2} |", course.least_s / first_s);
    }
}

/// Floating-point operations of a frame at d = 50 m, i = 1, counted from the loops' operations per value.
fn operations(pixels: f64, width: f64) -> f64 {
    // Two terms; eight columns add to each of eight rows of LEDs, which spread over 16 pixel rows each.
    let draw = 2.0 * 8.0 * (8.0 + 16.0) * width * 2.0;
    // Two polynomials of degree 7 and 6, and splitting and joining of the exponent.
    let encode = pixels * (2.0 * 13.0 + 8.0);
    // The vector to the LED, its inverse length by three Newton steps, and the gradient along it.
    let measure = pixels * (4.0 + 3.0 * 4.0 + 2.0 + 7.0);
    draw + encode + measure
}

/// The time of the arithmetic alone: multiplications and additions on values in registers.
fn least_s_an_operation() -> f64 {
    const VALUES: usize = 128;
    const TURNS: usize = 20_000;
    #[inline(always)]
    fn turns(values: &mut [f32; VALUES], factor: f32, summand: f32) {
        for _ in 0..TURNS {
            for value in values.iter_mut() {
                *value = *value * factor + summand;
            }
        }
    }
    let mut values = [1.0f32; VALUES];
    let mut least_s = f64::INFINITY;
    for _ in 0..50 {
        let (factor, summand) = std::hint::black_box((0.999, 0.001));
        let start = Instant::now();
        fearless_simd::dispatch!(fearless_simd::Level::new(), _simd => turns(&mut values, factor, summand));
        least_s = least_s.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&values);
    }
    least_s / (2 * VALUES * TURNS) as f64
}

fn limit() {
    let mut course = Course::new(&[]);
    run(std::slice::from_mut(&mut course));
    let region = course.evaluator.renderer().cells_region(0);
    let operations = operations(course.pixels() as f64, region.width as f64);
    let limit_s = operations * least_s_an_operation();
    println!(
        "\nA frame at d = 50 m, i = 1 takes {:.0} operations on f32, {:.2} µs at the rate of multiplications and additions in \
         registers: the time is {:.1} times that",
        operations,
        limit_s * 1e6,
        course.least_s / limit_s
    );
}

fn main() {
    geometry();
    effects();
    frames();
    limit();
}
