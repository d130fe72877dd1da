//! The best symbol rate for cameras and its net rate, over frame rate, readout and exposure.
//!
//! `cargo run --release -p vocc-studies --example signalling -- SCENE FRAMES_HZ READOUTS_MS EXPOSURES_MS [RUNS [BYTES]]`, for example
//! `phone 25,30,60 0,10,20 1,10 8 48`. Readouts longer than the frame period are omitted. The last column is the net rate relative to the
//! first readout, which should be 0: a global shutter.

use sim::scene::Scene;
use studies::signalling::{Search, exposed_for};
use studies::stop::Stop;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [preset, frames, readouts, exposures, ..] = &arguments[..] else {
        return Err("give SCENE FRAMES_HZ READOUTS_MS EXPOSURES_MS, such as phone 30,60 0,10 1,10".into());
    };
    let search = Search {
        runs: arguments.get(4).map_or(Ok(8), |given| given.parse())?,
        bytes: arguments.get(5).map_or(Ok(48), |given| given.parse())?,
        seed: 1,
    };
    println!(
        "| frames/s | exposure (ms) | readout (ms) | whole exposures to | best symbols/s | code | delivered | net bit/s | of all at once |\n\
         |---|---|---|---|---|---|---|---|---|"
    );
    for frames_hz in frames.split(',') {
        for exposure_ms in exposures.split(',') {
            let exposure_s = 1e-3 * exposure_ms.parse::<f64>()?;
            let mut at_once = None;
            for readout_ms in readouts.split(',') {
                let [hz, readout_s] = [frames_hz.parse::<f64>()?, 1e-3 * readout_ms.parse::<f64>()?];
                if readout_s > 1.0 / hz {
                    continue;
                }
                let overrides = [
                    format!("camera.frame_rate_hz={hz}"),
                    format!("camera.readout_s={readout_s}"),
                    format!("camera.exposure_max_s={exposure_s}"),
                    format!("link.symbol_rate_hz={}", 0.5 * hz),
                ];
                let scene = Scene::load(preset, &overrides)?;
                let scene = exposed_for(&scene, exposure_s)?;
                let advice = search.run(&scene, Stop::NEVER, || {}, |_| {})?;
                let best = advice.best();
                let reference = *at_once.get_or_insert(best.net_bit_s());
                println!(
                    "| {frames_hz} | {exposure_ms} | {readout_ms} | {:.1} | {:.1} | {} | {} of {} | {:.0} | {:.2} |",
                    advice.whole_exposures.hz(),
                    best.rate.hz(),
                    best.code,
                    best.delivered,
                    best.runs,
                    best.net_bit_s(),
                    best.net_bit_s() / reference
                );
            }
        }
    }
    Ok(())
}
