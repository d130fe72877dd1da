//! The performance of a link: the number of delivered runs and the net rate, over symbol rates and codes.
//!
//! `cargo run --release -p vocc-studies --example net_rate -- SCENE RATES CODES [RUNS [BYTES [corners]] ]`, for example `day 50,90,100
//! TM1280,TM1536 20 1024`. With `corners` the receiver knows the panel's place. A run films at most three repeats of the message; its net
//! rate is measured from its first frame to the one that completed the message.

use link::fec::Code;
use link::waveform::Waveform;
use sim::scene::Scene;
use studies::signalling::Trial;
use studies::stop::Stop;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [preset, rates, codes, ..] = &arguments[..] else {
        return Err("give SCENE RATES CODES, such as day 50,90 TM1280,TM1536".into());
    };
    let number = |at: usize, default: usize| arguments.get(at).map_or(Ok(default), |given| given.parse());
    let (runs, bytes) = (number(3, 20)?, number(4, 1024)?);
    let true_corners = arguments.get(5).is_some_and(|word| word == "corners");
    println!("| scene | symbols/s | code | delivered | net bit/s | raw BER |\n|---|---|---|---|---|---|");
    let scene = Scene::load(preset, &[])?;
    for rate in rates.split(',') {
        for name in codes.split(',') {
            let code = Code::ALL.into_iter().find(|code| code.to_string() == name);
            let code = code.ok_or_else(|| format!("no code {name:?}"))?;
            let (mut delivered, mut net, mut errors, mut bits) = (0, 0.0, 0, 0);
            for seed in 1..=runs as u64 {
                let trial = Trial {
                    code,
                    bytes,
                    rate_hz: rate.parse()?,
                    waveform: Waveform::STILL,
                    phase: (0.37 * seed as f64) % 1.0,
                    seed,
                    true_corners,
                };
                let run = trial.run(&scene, Stop::NEVER)?;
                if let Some(received) = run.received {
                    delivered += 1;
                    let frames = (received.last_frame - received.first_frame + 1) as f64;
                    net += 8.0 * bytes as f64 * scene.camera.frame_rate_hz / frames;
                }
                errors += run.errors.errors();
                bits += run.errors.bits();
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
