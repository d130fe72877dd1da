//! The symbol rates that a camera can follow: the table of `docs/hardware/reference.md`.

use link::symbol_rate::{SymbolRate, SymbolRateError};

fn main() -> Result<(), SymbolRateError> {
    println!("| camera, frames a second | exposure 1/1000 s | 1/250 s | 1/60 s |");
    println!("|---|---|---|---|");
    for frames_hz in [25.0, 30.0, 60.0, 100.0, 120.0, 240.0] {
        print!("| {frames_hz} |");
        for exposure_s in [1.0 / 1000.0, 1.0 / 250.0, 1.0 / 60.0] {
            if exposure_s * frames_hz > 1.0 {
                print!(" |");
            } else {
                print!(" {} |", SymbolRate::for_camera(frames_hz, exposure_s)?);
            }
        }
        println!();
    }
    Ok(())
}
