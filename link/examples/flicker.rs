//! Measures the evenness of the panel's light: prints a markdown table for messages of several lengths.
//!
//! `cargo run --release -p vocc-link --example flicker`

use link::fec::Code;
use link::framing::{Framer, FramingError};
use link::panel::{LEDS, PanelFrame};

const TEXT: &[u8] = b"Slow down: road works ahead, the left lane is closed for 800 metres. ";
const REPEATS: u32 = 40;

fn longest_run(panels: &[PanelFrame], led: usize) -> usize {
    panels.chunk_by(|a, b| a.led(led) == b.led(led)).map(<[_]>::len).max().unwrap_or(0)
}

fn main() -> Result<(), FramingError> {
    println!(
        "| bytes | code | panels a repeat | mean On | spread a panel (standard deviation) \
         | LEDs On, least to most | longest run of one LED, panels |"
    );
    println!("|---|---|---|---|---|---|---|");
    for length in [8, 16, 32, 128, 1024] {
        let message: Vec<u8> = TEXT.iter().copied().cycle().take(length).collect();
        let code = Code::for_length(length);
        let mut framer = Framer::new(&message, code, false)?;
        let repeat = framer.panels_per_repeat();
        let panels: Vec<PanelFrame> = (0..REPEATS * repeat).map(|_| framer.next_panel()).collect();
        let count = panels.len() as f64;
        let on = || panels.iter().map(|panel| f64::from(panel.count_on()) / LEDS as f64);
        let mean = on().sum::<f64>() / count;
        let spread = (on().map(|on| (on - mean).powi(2)).sum::<f64>() / count).sqrt();
        let least = panels.iter().map(|panel| panel.count_on()).min().unwrap_or(0);
        let most = panels.iter().map(|panel| panel.count_on()).max().unwrap_or(0);
        let run = (0..LEDS).map(|led| longest_run(&panels, led)).max().unwrap_or(0);
        println!("| {length} | {code} | {repeat} | {mean:.4} | {spread:.4} | {least} to {most} | {run} |");
    }
    Ok(())
}
