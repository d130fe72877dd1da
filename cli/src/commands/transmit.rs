//! `vocc transmit`: the panels that the transmitter shows, and their flicker.

mod chart;
mod flicker;

use std::path::PathBuf;

use anyhow::Context;
use link::fec::Code;
use link::framing::{Framer, SignedFramer};
use link::geometry::Geometry;
use link::l2a_table::Interval;
use link::panel::PanelFrame;
use link::raw;
use link::waveform::Waveform;

use crate::files;
use crate::keys::SigningArguments;
use crate::options::{Message, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::outputs;

/// Maximum number of panels, so that a typing error does not fill the disk.
const COUNT_MAX: i64 = 1 << 24;

/// Arguments of `vocc transmit`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    message: Message,
    /// Write the panels to this file instead of standard output.
    #[arg(long, value_name = "F")]
    symbols: Option<PathBuf>,
    /// Number of panels, up to 16777216: 285 MB of text, or 46 hours at 100 symbols a second. Default: one repeat of the message.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=COUNT_MAX))]
    count: Option<u32>,
    /// Send 64 payload bits per panel, without framing or error correction, as the paper does.
    #[arg(long)]
    raw: bool,
    /// Diameter of the panel's LEDs in metres. With --interval, the panel transmits its size after the first of every 16 repeats.
    #[arg(long, value_name = "M", requires = "interval", conflicts_with_all = ["raw", "flicker"])]
    led_diameter: Option<f64>,
    /// The gap between LEDs in LED diameters.
    #[arg(long, value_name = "I", requires = "led_diameter")]
    interval: Option<f64>,
    /// Cycles of the carrier per symbol, as link.carrier_cycles in a scene; 0: still panels.
    #[arg(long, value_name = "N")]
    carrier_cycles: Option<u32>,
    #[command(flatten)]
    signing: SigningArguments,
    #[command(flatten)]
    flickering: flicker::Options,
}

impl Arguments {
    /// The size in the panels' headers.
    fn geometry(&self) -> anyhow::Result<Option<Geometry>> {
        let Some((led_diameter_m, interval)) = self.led_diameter.zip(self.interval) else {
            return Ok(None);
        };
        let interval = Interval::checked_from_num(interval)
            .with_context(|| format!("an interval of {interval} is outside 0 to 16: give the gap between LEDs over their diameter"))?;
        let geometry = Geometry::new((led_diameter_m * 1e6).round() as u32, interval);
        let geometry = geometry.with_context(|| format!("--led-diameter {led_diameter_m}"))?;
        Ok(Some(geometry))
    }
}

/// Prints the panels, one 16-digit hexadecimal word per line, or their flicker. With a carrier, the bits are the state of the LEDs at the
/// start of the symbol, which is the first quarter of a cycle.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let message = arguments.message.bytes()?;
    let is_framed = !arguments.raw && !arguments.flickering.flicker;
    anyhow::ensure!(
        is_framed || arguments.signing.file().is_none(),
        "--sign cannot be used with --raw, which has no room for a signature, nor with --flicker, which is for unsigned panels"
    );
    if arguments.flickering.flicker {
        let file = arguments.message.file();
        return flicker::run(&arguments.flickering, arguments.carrier_cycles, message.as_deref(), file, shared);
    }
    let message = message.context("give a message with --message or --message-file")?;
    outputs::check(
        arguments.symbols.clone(),
        arguments.message.file().into_iter().chain(arguments.signing.file()),
    )?;
    let rate = arguments.flickering.one_rate()?;
    let waveform = Waveform::new(arguments.carrier_cycles.unwrap_or(0))?;
    waveform.carrier_hz(rate.hz())?;
    let panels = panels(&message, arguments)?;
    let Some(path) = &arguments.symbols else {
        for panel in panels {
            if shared.json {
                let bits = panel.to_string();
                output::json(&serde_json::json!({
                    "bits": bits,
                    "panel": bits,
                    "carrier_cycles": waveform.cycles(),
                    "symbol_s": rate.hz().recip(),
                }))?;
            } else {
                line(&panel.to_string())?;
            }
            if output::is_unread() {
                break;
            }
        }
        return Ok(Verdict::Yes);
    };
    files::write_with(path, |file| {
        for panel in panels {
            writeln!(file, "{panel}")?;
        }
        Ok(())
    })?;
    Ok(Verdict::Yes)
}

/// The requested number of consecutive panels, by default one message.
fn panels(message: &[u8], arguments: &Arguments) -> anyhow::Result<Box<dyn Iterator<Item = PanelFrame>>> {
    if arguments.raw {
        anyhow::ensure!(!message.is_empty(), "the message is empty: give at least 1 byte");
        let once: Vec<PanelFrame> = raw::panels(message).collect();
        let count = arguments.count.map_or(once.len(), |count| count as usize);
        return Ok(Box::new(once.into_iter().cycle().take(count)));
    }
    let code = Code::for_length(message.len());
    let mut framer = Framer::new(message, code, false)?;
    let geometry = arguments.geometry()?;
    if let Some((key, counter)) = arguments.signing.key()? {
        let mut framer = SignedFramer::new(message, code, false, key.sign(message, counter))?;
        let count = arguments.count.unwrap_or_else(|| framer.panels_per_repeat());
        return Ok(Box::new((0..count).map(move |_| framer.next_panel_of(geometry))));
    }
    let count = arguments.count.unwrap_or_else(|| framer.panels_per_repeat());
    Ok(Box::new((0..count).map(move |_| framer.next_panel_of(geometry))))
}
