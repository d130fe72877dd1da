//! The motion of the panel's image from frame to frame with a vibrating camera, for `docs/physics.md`.

use std::error::Error;

use sim::accuracy::Level;
use sim::renderer::Renderer;
use sim::scene::Scene;

const FRAMES: u64 = 300;
const RUNS: u64 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "| camera | lens | frames a second | from its place at rest | from frame to frame | during an exposure |\n|---|---|---|---|---|---|"
    );
    for (camera, keys) in [
        ("passenger car", &[][..]),
        ("truck", &["shake_deg=0.2", "shake_roll_deg=0.2", "shake_highest_hz=20"]),
        ("hand-held", &["shake_deg=0.2", "shake_roll_deg=0.2", "shake_highest_hz=12"]),
    ] {
        for lens_mm in [25, 12] {
            for rate_hz in [100, 30] {
                let lens = [
                    format!("camera.focal_length_mm={lens_mm}"),
                    format!("camera.frame_rate_hz={rate_hz}"),
                ];
                let keys = keys.iter().map(|key| format!("camera.{key}"));
                let scene = Scene::load("day-driving", &lens.into_iter().chain(keys).collect::<Vec<_>>())?;
                let [rest, step, way] = rms_px(&Renderer::new(&scene, Level::Fast)?);
                println!("| {camera} | {lens_mm} mm | {rate_hz} | {rest:.1} px | {step:.2} px | {way:.2} px |");
            }
        }
    }
    Ok(())
}

/// Root mean squares, in px: of the panel's distance from its place at rest, of its step from frame to frame, and of its motion during an
/// exposure.
fn rms_px(renderer: &Renderer) -> [f64; 3] {
    let exposure_s = renderer.view().exposure.time_s;
    let (mut squares, mut count) = ([0.0; 3], 0.0);
    for seed in 0..RUNS {
        let place = |frame: u64, after_s: f64| {
            let mut moment = renderer.moment(seed, frame);
            moment.start_s += after_s;
            renderer.shaken_px(&moment)
        };
        let mut before = place(0, 0.0);
        for frame in 1..FRAMES {
            let [at, end] = [0.0, exposure_s].map(|after_s| place(frame, after_s));
            let square = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
            for (sum, square) in squares.iter_mut().zip([square(at, [0.0; 2]), square(at, before), square(end, at)]) {
                *sum += square;
            }
            (before, count) = (at, count + 1.0);
        }
    }
    squares.map(|sum| f64::sqrt(sum / count))
}
