//! The cost of a signature, by length and code of the message: the number of panels and the net bits a second, without and with a
//! signature. The code that transmitters use for a length is bold.
//!
//! `cargo run --release -p vocc-link --example signature_cost [symbols a second]`

use link::fec::Code;
use link::framing::{Layout, SIGNATURE_PANELS};

/// Bytes of the messages.
const LENGTHS: [usize; 7] = [8, 16, 32, 64, 128, 256, 1024];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let symbol_rate_hz: f64 = std::env::args().nth(1).map_or(Ok(90.0), |given| given.parse())?;
    let names: Vec<String> = Code::ALL.iter().map(Code::to_string).collect();
    println!("| bytes | {} |", names.join(" | "));
    println!("|---|{}", "---|".repeat(names.len()));
    for length in LENGTHS {
        let cell = |code: Code| {
            let panels = Layout::new(code, length).panels();
            let signed = panels + SIGNATURE_PANELS;
            let rate = |panels: usize| 8.0 * length as f64 * symbol_rate_hz / panels as f64;
            let mark = if code == Code::for_length(length) { "**" } else { "" };
            format!("{mark}{panels} → {signed}{mark}: {:.0} → {:.0} bit/s", rate(panels), rate(signed))
        };
        let cells: Vec<String> = Code::ALL.into_iter().map(cell).collect();
        println!("| {length} | {} |", cells.join(" | "));
    }
    Ok(())
}
