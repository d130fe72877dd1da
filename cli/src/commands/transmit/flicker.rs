//! `vocc transmit --flicker`: how much the panel flickers, what people see of it, and what would have to change.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use link::symbol_rate::SymbolRate;
use serde::Serialize;
use studies::flicker::{Flicker, Practice, Spectrum, Visibility, manchester, panels};

use super::chart;
use crate::numbers::digits;
use crate::options::Shared;
use crate::output::{self, Verdict, line};
use crate::{outputs, plot};

/// Symbol rates that are looked at where none is given: those of usual cameras, the highest of a transmitter, and beyond.
const RATES_HZ: [f64; 8] = [5.0, 10.0, 27.0, 45.0, 90.0, 300.0, 1250.0, 10_000.0];
/// Symbol rates that may be asked for.
const RANGE_HZ: RangeInclusive<f64> = 0.1..=1e6;

/// Whether and how the flicker is looked at.
#[derive(clap::Args)]
pub struct Options {
    /// How much the panel flickers, against IEEE Std 1789-2015; with beacons where no message is given.
    #[arg(long, conflicts_with_all = ["symbols", "count", "raw"])]
    pub flicker: bool,
    /// Symbols a second that --flicker looks at, 0.1 to 1000000, with commas between them.
    #[arg(
        long,
        value_name = "HZ",
        value_delimiter = ',',
        value_parser = rate_hz,
        requires = "flicker",
        allow_negative_numbers = true
    )]
    symbol_rate: Vec<f64>,
    /// Draw the modulation over the frequency, a chart for each rate, as NAME.svg and NAME.png.
    #[arg(long, value_name = "NAME", value_parser = plot::stem, requires = "flicker")]
    plot: Option<PathBuf>,
}

fn rate_hz(text: &str) -> Result<f64, String> {
    let (least, most) = (RANGE_HZ.start(), RANGE_HZ.end());
    match text.parse() {
        Ok(rate_hz) if RANGE_HZ.contains(&rate_hz) => Ok(rate_hz),
        _ => Err(format!("give {least} to {most} symbols a second")),
    }
}

/// What is found.
#[derive(Serialize)]
struct Report {
    /// Bytes of the message; none for beacons.
    message_bytes: Option<usize>,
    /// Symbols after which the light comes again.
    period_symbols: usize,
    rates: Vec<Rate>,
    lowest: Vec<LowestRates>,
}

/// At one symbol rate.
#[derive(Serialize)]
struct Rate {
    symbols_hz: f64,
    worst_led: Sight,
    usual_led: Sight,
    panel: Sight,
}

/// What people see of a light, and where it is farthest above or nearest to the low-risk practice.
#[derive(Serialize)]
struct Sight {
    seen: String,
    #[serde(flatten)]
    worst: Option<ModulationLimit>,
}

#[derive(Serialize)]
struct ModulationLimit {
    hz: f64,
    percent: f64,
    limit_percent: f64,
    times_limit: f64,
}

/// The symbol rates from which on the practices are met.
#[derive(Serialize)]
struct LowestRates {
    light: &'static str,
    low_risk_hz: f64,
    no_effect_hz: f64,
    no_seizures_hz: f64,
}

/// Prints what is seen of a message, or of beacons where there is none; `file` is that which the message comes from.
pub fn run(options: &Options, message: Option<&[u8]>, file: Option<PathBuf>, shared: &Shared) -> anyhow::Result<Verdict> {
    let stem = options.plot.as_deref();
    outputs::check(stem.map(plot::files_of).into_iter().flatten(), file)?;
    let panels = panels(message)?;
    let (plain, coded) = (Flicker::of(&panels), Flicker::of(&manchester(&panels)));
    let rates_hz = match options.symbol_rate.as_slice() {
        [] => &RATES_HZ,
        asked => asked,
    };
    if let Some(stem) = stem {
        plot::save(stem, &chart::draw(&plain, rates_hz)?)?;
    }
    let report = Report {
        message_bytes: message.map(<[u8]>::len),
        period_symbols: panels.len(),
        rates: rates_hz.iter().map(|&hz| Rate::of(&plain, hz)).collect(),
        lowest: vec![
            LowestRates::of("the worst LED", &plain.worst_led),
            LowestRates::of("all LEDs together", &plain.panel),
            LowestRates::of("the worst LED, in Manchester code", &coded.worst_led),
            LowestRates::of("all LEDs together, in Manchester code", &coded.panel),
        ],
    };
    if shared.json {
        output::json(&report)?;
    } else {
        print(&report)?;
    }
    Ok(Verdict::Yes)
}

impl Rate {
    fn of(flicker: &Flicker, symbols_hz: f64) -> Self {
        let of = |light| Sight::of(light, symbols_hz);
        Self {
            symbols_hz,
            worst_led: of(&flicker.worst_led),
            usual_led: of(&flicker.usual_led),
            panel: of(&flicker.panel),
        }
    }
}

impl Sight {
    fn of(light: &Spectrum, symbols_hz: f64) -> Self {
        let worst = Practice::LowRisk.worst(light, symbols_hz);
        Self {
            seen: Visibility::of(light, symbols_hz).to_string(),
            worst: worst.map(|worst| ModulationLimit {
                hz: worst.hz,
                percent: worst.percent,
                limit_percent: worst.limit_percent,
                times_limit: worst.times_limit(),
            }),
        }
    }

    /// As columns of a table.
    fn columns(&self) -> String {
        let Self { seen, worst } = self;
        let Some(worst) = worst else {
            return columns([seen, "-", "-", "-"]);
        };
        let [percent, hz, times] = [worst.percent, worst.hz, worst.times_limit].map(digits);
        columns([seen, &percent, &hz, &times])
    }
}

impl LowestRates {
    fn of(light: &'static str, spectrum: &Spectrum) -> Self {
        let [low_risk_hz, no_effect_hz, no_seizures_hz] = Practice::ALL.map(|practice| practice.lowest_rate_hz(spectrum));
        Self {
            light,
            low_risk_hz,
            no_effect_hz,
            no_seizures_hz,
        }
    }
}

fn columns([seen, percent, hz, times]: [&str; 4]) -> String {
    format!("{seen:17} {percent:>7} {hz:>7} {times:>7}")
}

fn print(report: &Report) -> anyhow::Result<()> {
    let shown = match report.message_bytes {
        Some(bytes) => format!("a message of {bytes} bytes"),
        None => "beacons".into(),
    };
    let period = report.period_symbols;
    line(&format!("{shown}: the light comes again after {period} symbols"))?;
    line("")?;
    line(&format!("           {:44}all LEDs together", "the worst LED"))?;
    let names = columns(["a passer-by sees", "%", "at Hz", "times"]);
    line(&format!("symbols/s  {names}  {names}"))?;
    for rate in &report.rates {
        let (led, panel) = (rate.worst_led.columns(), rate.panel.columns());
        line(&format!("{:>9}  {led}  {panel}", rate.symbols_hz))?;
    }
    line("%: the modulation that is most times what is of low risk (IEEE Std 1789-2015), which is met up to 1 times")?;
    line("")?;
    let row = |cells: [&str; 4]| {
        let [light, low_risk, no_effect, no_seizures] = cells;
        format!("{light:38} {low_risk:>9} {no_effect:>10} {no_seizures:>12}")
    };
    let [low_risk, no_effect, no_seizures] = Practice::ALL.map(|practice| practice.to_string());
    line(&row(["met from so many symbols a second on", &low_risk, &no_effect, &no_seizures]))?;
    for lowest in &report.lowest {
        let rates_hz = [lowest.low_risk_hz, lowest.no_effect_hz, lowest.no_seizures_hz];
        let [low_risk, no_effect, no_seizures] = rates_hz.map(|hz| format!("{:.0}", hz.ceil()));
        line(&row([lowest.light, &low_risk, &no_effect, &no_seizures]))?;
    }
    line(&format!(
        "a transmitter shows {} to {}; Manchester code, each panel and its complement, carries half of the data",
        SymbolRate::MIN,
        SymbolRate::MAX
    ))
}
