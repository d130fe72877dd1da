//! What a link delivers: how many of its runs, and at which net rate, over symbol rates and codes.
//!
//! `cargo run --release -p vocc-studies --example net_rate -- SCENE RATES CODES [RUNS [BYTES [corners]] ]`, for instance
//! `day 50,90,100 TM1280,TM1536 20 1024`. With `corners` the receiver is told where the panel is. A run films at most three
//! repeats of the message; its net rate is that from its first frame to that in which the message was whole.

use link::fec::Code;
use link::framing::Framer;
use sim::accuracy::Level;
use sim::road::{LinkSettings, Received, Road};
use sim::scene::Scene;
use studies::detectors::DetectorChoice;
use studies::monte_carlo::receiving_method;
use studies::statistics::FrameErrors;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [preset, rates, codes, ..] = &arguments[..] else {
        return Err("give SCENE RATES CODES, such as day 50,90 TM1280,TM1536".into());
    };
    let number =
        |at: usize, default: usize| arguments.get(at).map_or(Ok(default), |given| given.parse());
    let (runs, bytes) = (number(3, 20)?, number(4, 1024)?);
    let true_corners = arguments.get(5).is_some_and(|word| word == "corners");
    println!(
        "| scene | symbols/s | code | delivered | net bit/s | raw BER |\n|---|---|---|---|---|---|"
    );
    for rate in rates.split(',') {
        for name in codes.split(',') {
            let code = Code::ALL.into_iter().find(|code| code.to_string() == name);
            let code = code.ok_or_else(|| format!("no code {name:?}"))?;
            let (mut delivered, mut net, mut errors, mut bits) = (0, 0.0, 0, 0);
            for seed in 1..=runs as u64 {
                let overrides = [
                    format!("link.symbol_rate_hz={rate}"),
                    format!("link.phase={}", (0.37 * seed as f64) % 1.0),
                ];
                let scene = Scene::load(preset, &overrides)?;
                let (received, counted, message) = run(&scene, seed, code, bytes, true_corners)?;
                if let Some(received) = received.filter(|received| received.message == message) {
                    delivered += 1;
                    let frames = (received.last_frame - received.first_frame + 1) as f64;
                    net += 8.0 * bytes as f64 * scene.camera.frame_rate_hz / frames;
                }
                errors += counted.errors();
                bits += counted.bits();
            }
            println!(
                "| {preset} | {rate} | {code} | {delivered} of {runs} | {:.0} | {:.1e} |",
                net / f64::from(delivered.max(1)),
                errors as f64 / bits as f64
            );
        }
    }
    Ok(())
}

/// What arrived, the bit errors, and what was sent.
type Run = (Option<Received>, FrameErrors, Vec<u8>);

fn run(
    scene: &Scene,
    seed: u64,
    code: Code,
    bytes: usize,
    true_corners: bool,
) -> Result<Run, Box<dyn std::error::Error>> {
    let message: Vec<u8> = (0..bytes as u64)
        .map(|i| link::scramble::split_mix64(seed << 32 | i) as u8)
        .collect();
    let settings = LinkSettings {
        message: message.clone(),
        method: receiving_method(scene, DetectorChoice::Best, seed, Level::Fast)?,
        seed,
        level: Level::Fast,
        code: Some(code),
        camera: link::camera::Camera::default(),
        true_corners,
    };
    let (mut road, mut errors) = (Road::new(scene, &settings)?, FrameErrors::default());
    let panels = Framer::new(&message, code, false)?.panels_per_repeat();
    let frames = 3.0 * f64::from(panels) * scene.camera.frame_rate_hz / scene.link.symbol_rate_hz;
    for frame in 0..frames.ceil() as u64 {
        let report = road.frame(frame)?;
        errors.push(report.bit_errors);
        if let Some(received) = report.delivered {
            return Ok((Some(received), errors, message));
        }
    }
    Ok((road.finish(), errors, message))
}
