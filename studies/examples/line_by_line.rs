//! Delivery by cameras that read their lines one after another: the number of successful runs by readout, exposure and symbol rate.
//!
//! `cargo run --release -p vocc-studies --example line_by_line -- SCENE DISTANCES_M READOUTS_MS EXPOSURES_MS RATES [RUNS [BYTES [SECONDS [at-once]]]]`
//!
//! For example `phone 12,50 0,10,20 0.1,1,10 5,15,27 20 48 3`; `-` stands for the scene's own value. Each run has another phase. The
//! aperture sets the exposure, like a grey filter, up to f/1.4; beyond, the ISO does. With `at-once` the receiver is configured for a
//! global shutter and does not search for a share per row.

use link::fec::Code;
use sim::accuracy::Level;
use sim::camera::exposure::Exposure;
use sim::road::{LinkSettings, Road};
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::receiving_method;
use studies::signalling::exposed_for;
use studies::statistics::FrameErrors;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [preset, distances, readouts, exposures, rates, ..] = &arguments[..] else {
        return Err("give SCENE DISTANCES_M READOUTS_MS EXPOSURES_MS RATES, such as phone 50 0,20 1 27".into());
    };
    let number = |at: usize, default: usize| arguments.get(at).map_or(Ok(default), |given| given.parse());
    let (runs, bytes, seconds) = (number(5, 20)?, number(6, 48)?, number(7, 3)?);
    let at_once = arguments.get(8).is_some_and(|word| word == "at-once");
    println!(
        "| scene | m | readout (ms) | exposure (ms) | symbols/s | delivered | mean frames | raw BER |\n|---|---|---|---|---|---|---|---|"
    );
    for distance in distances.split(',') {
        for readout in readouts.split(',') {
            for exposure in exposures.split(',') {
                for rate in rates.split(',') {
                    let mut sum = Sum::default();
                    let mut shown = None;
                    for seed in 1..=runs as u64 {
                        let scene = scene(preset, [distance, readout, exposure, rate], seed)?;
                        sum.add(run(&scene, seed, bytes, seconds, at_once)?);
                        shown = Some(scene);
                    }
                    let Some(scene) = shown else { continue };
                    println!(
                        "| {preset} | {:.0} | {:.1} | {:.2} | {:.0} | {} of {runs} | {:.0} | {:.1e} |",
                        scene.pose.distance_m,
                        1e3 * scene.camera.readout_s,
                        1e3 * Exposure::of(&scene).time_s,
                        scene.link.symbol_rate_hz,
                        sum.delivered,
                        sum.frames as f64 / f64::from(sum.delivered.max(1)),
                        sum.errors as f64 / sum.bits.max(1) as f64
                    );
                }
            }
        }
    }
    Ok(())
}

#[derive(Default)]
struct Sum {
    delivered: u32,
    frames: u64,
    errors: u64,
    bits: u64,
}

impl Sum {
    fn add(&mut self, (last_frame, errors): (Option<u64>, FrameErrors)) {
        self.delivered += u32::from(last_frame.is_some());
        self.frames += last_frame.map_or(0, |last| last + 1);
        self.errors += errors.errors();
        self.bits += errors.bits();
    }
}

fn scene(preset: &str, settings: [&str; 4], seed: u64) -> Result<Scene, Box<dyn std::error::Error>> {
    let [distance, readout, exposure, rate] = settings.map(|word| (word != "-").then(|| word.parse::<f64>()).transpose());
    let mut overrides = vec![format!("link.phase={}", (0.37 * seed as f64) % 1.0)];
    overrides.extend(distance?.map(|metres| format!("pose.distance_m={metres}")));
    overrides.extend(readout?.map(|ms| format!("camera.readout_s={}", 1e-3 * ms)));
    overrides.extend(rate?.map(|hz| format!("link.symbol_rate_hz={hz}")));
    let scene = Scene::load(preset, &overrides)?;
    Ok(match exposure? {
        Some(ms) => exposed_for(&scene, 1e-3 * ms)?,
        None => scene,
    })
}

/// The frame that completed the message, and the bit errors until then.
fn run(
    scene: &Scene,
    seed: u64,
    bytes: usize,
    seconds: usize,
    at_once: bool,
) -> Result<(Option<u64>, FrameErrors), Box<dyn std::error::Error>> {
    let message: Vec<u8> = (0..bytes as u64)
        .map(|i| link::scramble::split_mix64(seed << 32 | i) as u8)
        .collect();
    let settings = LinkSettings {
        code: Some(Code::for_length(bytes)),
        ..LinkSettings::new(
            message.clone(),
            receiving_method(scene, DetectorChoice::Best, seed, Level::Fast)?,
            seed,
        )
    };
    let (mut road, mut errors) = (Road::new(scene, &settings)?, FrameErrors::default());
    if at_once {
        road.set_line_delay(0.0);
    }
    let frames = (seconds as f64 * scene.camera.frame_rate_hz).ceil() as u64;
    for frame in 0..frames {
        let report = road.frame(frame)?;
        errors.push(report.bit_errors);
        if report.delivered.is_some_and(|received| received.message == message) {
            return Ok((Some(frame), errors));
        }
    }
    Ok((None, errors))
}
