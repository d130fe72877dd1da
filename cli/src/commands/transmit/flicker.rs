//! `vocc transmit --flicker`: the panel's flicker, its visibility, and the symbol rates that avoid it.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use link::symbol_rate::SymbolRate;
use link::waveform::{Waveform, WaveformError};
use serde::Serialize;
use studies::flicker::{Flicker, Measures, Practice, Spectrum, Visibility, manchester, panels};

use super::chart;
use crate::numbers::digits;
use crate::options::{SharedOptions, number_in};
use crate::output::{self, Verdict, line};
use crate::{outputs, plot};

/// Default symbol rates: those of common cameras, a transmitter's highest, and beyond.
const RATES_HZ: [f64; 8] = [5.0, 10.0, 27.0, 45.0, 90.0, 300.0, 1250.0, 10_000.0];
/// Valid symbol rates.
const RANGE_HZ: RangeInclusive<f64> = 0.1..=1e6;

/// Options of the flicker analysis.
#[derive(clap::Args)]
pub struct Options {
    /// Compute the panel's flicker by IEEE Std 1789-2015, with beacons if no message is given. With --carrier-cycles (0 to compare) also by
    /// IEEE Std 802.15.7, IEC TR 61547-1 and CIE TN 006.
    #[arg(long, conflicts_with_all = ["symbols", "count", "raw"])]
    pub flicker: bool,
    /// Symbols a second. With --flicker, one or more rates of 0.1 to 1000000, separated by commas.
    #[arg(
        long,
        value_name = "HZ",
        value_delimiter = ',',
        value_parser = rate_hz,
        allow_negative_numbers = true
    )]
    symbol_rate: Vec<f64>,
    /// Draw the modulation over the frequency, a chart for each rate, as NAME.svg and NAME.png.
    #[arg(long, value_name = "NAME", value_parser = plot::stem(), requires = "flicker")]
    plot: Option<PathBuf>,
}

impl Options {
    /// The single rate of a transmitter.
    pub fn one_rate(&self) -> anyhow::Result<SymbolRate> {
        match self.symbol_rate[..] {
            [] => Ok(SymbolRate::DEFAULT),
            [hz] => Ok(SymbolRate::from_hz(hz)?),
            _ => anyhow::bail!("several symbol rates are only for --flicker: give one"),
        }
    }

    /// The requested rates, or the default ones at which a transmitter can show the waveform.
    fn rates_hz(&self, waveform: Waveform) -> Result<Vec<f64>, WaveformError> {
        if !self.symbol_rate.is_empty() {
            self.symbol_rate.iter().try_for_each(|&hz| waveform.carrier_hz(hz).map(drop))?;
            return Ok(self.symbol_rate.clone());
        }
        let is_shown = |hz: &f64| waveform.is_still() || SymbolRate::from_hz(*hz).is_ok() && waveform.carrier_hz(*hz).is_ok();
        let rates_hz: Vec<f64> = RATES_HZ.into_iter().filter(is_shown).collect();
        if rates_hz.is_empty() {
            waveform.carrier_hz(SymbolRate::DEFAULT.hz())?;
        }
        Ok(rates_hz)
    }
}

fn rate_hz(text: &str) -> Result<f64, String> {
    number_in(text, RANGE_HZ, "symbols a second")
}

/// The results.
#[derive(Serialize)]
struct Report {
    /// Bytes of the message; `None` for beacons.
    message_bytes: Option<usize>,
    /// Period of the light in symbols.
    period_symbols: usize,
    /// Carrier cycles per symbol; `None` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    carrier_cycles: Option<u16>,
    rates: Vec<Rate>,
    lowest: Vec<LowestRates>,
}

/// Results at one symbol rate.
#[derive(Serialize)]
struct Rate {
    symbols_hz: f64,
    worst_led: FlickerSummary,
    usual_led: FlickerSummary,
    panel: FlickerSummary,
    /// If carrier cycles are given: the worst LED and all LEDs together, by all standards.
    #[serde(skip_serializing_if = "Option::is_none")]
    by_standards: Option<[Standards; 2]>,
}

/// A light by all standards.
#[derive(Serialize)]
struct Standards {
    light: &'static str,
    /// Maximum modulation relative to the limit of IEEE Std 1789-2015, by practices 1 to 3.
    low_risk_times: f64,
    no_effect_times: f64,
    no_seizures_times: f64,
    /// IEEE Std 802.15.7; limit 5 ms.
    longest_period_s: f64,
    /// IEC TR 61547-1; half of all people see a flicker of 1.
    pst_lm: f64,
    /// CIE TN 006:2016; 1 is the threshold of sight.
    svm: f64,
}

/// Visibility of a light's flicker, and its largest modulation relative to the low-risk practice.
#[derive(Serialize)]
struct FlickerSummary {
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

/// Lowest symbol rates that meet the practices.
#[derive(Serialize)]
struct LowestRates {
    light: &'static str,
    low_risk_hz: f64,
    no_effect_hz: f64,
    no_seizures_hz: f64,
}

/// Prints the flicker of a message, or of beacons if there is none, with `carrier_cycles` carrier cycles per symbol; `file` is the
/// message's file.
pub fn run(
    options: &Options,
    carrier_cycles: Option<u32>,
    message: Option<&[u8]>,
    file: Option<PathBuf>,
    shared: &SharedOptions,
) -> anyhow::Result<Verdict> {
    let stem = options.plot.as_deref();
    outputs::check(stem.map(plot::files_of).into_iter().flatten(), file)?;
    let panels = panels(message)?;
    let waveform = Waveform::new(carrier_cycles.unwrap_or(0))?;
    let rates_hz = options.rates_hz(waveform)?;
    let flicker = Flicker::with_waveform(&panels, waveform);
    if let Some(stem) = stem {
        plot::save(stem, &chart::draw(&flicker, &rates_hz)?)?;
    }
    let mut lowest = vec![
        LowestRates::of("the worst LED", &flicker.worst_led),
        LowestRates::of("all LEDs together", &flicker.panel),
    ];
    if waveform.is_still() {
        let coded = Flicker::of(&manchester(&panels));
        lowest.push(LowestRates::of("the worst LED, in Manchester code", &coded.worst_led));
        lowest.push(LowestRates::of("all LEDs together, in Manchester code", &coded.panel));
    }
    let report = Report {
        message_bytes: message.map(<[u8]>::len),
        period_symbols: panels.len(),
        carrier_cycles: carrier_cycles.map(|_| waveform.cycles()),
        rates: rates_hz
            .iter()
            .map(|&hz| Rate::of(&flicker, hz, carrier_cycles.is_some()))
            .collect(),
        lowest,
    };
    if shared.json {
        output::json(&report)?;
    } else {
        print(&report)?;
    }
    Ok(Verdict::Yes)
}

impl Rate {
    fn of(flicker: &Flicker, symbols_hz: f64, by_standards: bool) -> Self {
        let of = |light| FlickerSummary::of(light, symbols_hz);
        Self {
            symbols_hz,
            worst_led: of(&flicker.worst_led),
            usual_led: of(&flicker.usual_led),
            panel: of(&flicker.panel),
            by_standards: by_standards.then(|| {
                [
                    Standards::of(
                        "the worst LED",
                        &flicker.worst_led,
                        flicker.worst_led_measures(symbols_hz),
                        symbols_hz,
                    ),
                    Standards::of("all LEDs together", &flicker.panel, flicker.panel_measures(symbols_hz), symbols_hz),
                ]
            }),
        }
    }
}

impl FlickerSummary {
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

    /// The values as table columns.
    fn columns(&self) -> String {
        let Self { seen, worst } = self;
        let Some(worst) = worst else {
            return columns([seen, "-", "-", "-"]);
        };
        let [percent, hz, times] = [worst.percent, worst.hz, worst.times_limit].map(digits);
        columns([seen, &percent, &hz, &times])
    }
}

impl Standards {
    fn of(light: &'static str, spectrum: &Spectrum, measures: Measures, symbols_hz: f64) -> Self {
        let [low_risk_times, no_effect_times, no_seizures_times] = Practice::ALL.map(|practice| practice.times(spectrum, symbols_hz));
        Self {
            light,
            low_risk_times,
            no_effect_times,
            no_seizures_times,
            longest_period_s: measures.longest_period_s,
            pst_lm: measures.short_term,
            svm: measures.stroboscopic,
        }
    }

    /// The last table columns.
    fn columns(&self) -> [String; 6] {
        [
            self.low_risk_times,
            self.no_effect_times,
            self.no_seizures_times,
            self.longest_period_s * 1e3,
            self.pst_lm,
            self.svm,
        ]
        .map(digits)
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
    line(&format!("{shown}: the light repeats after {period} symbols"))?;
    line("")?;
    line(&format!("           {:44}all LEDs together", "the worst LED"))?;
    let names = columns(["a passer-by sees", "%", "at Hz", "times"]);
    line(&format!("symbols/s  {names}  {names}"))?;
    for rate in &report.rates {
        let (led, panel) = (rate.worst_led.columns(), rate.panel.columns());
        line(&format!("{:>9}  {led}  {panel}", rate.symbols_hz))?;
    }
    line("%: the modulation that is largest relative to the low-risk limit of IEEE Std 1789-2015; times: that ratio, low risk up to 1")?;
    line("")?;
    if let Some(cycles) = report.carrier_cycles {
        print_standards(report, cycles)?;
    }
    let row = |cells: [&str; 4]| {
        let [light, low_risk, no_effect, no_seizures] = cells;
        format!("{light:38} {low_risk:>9} {no_effect:>10} {no_seizures:>12}")
    };
    let [low_risk, no_effect, no_seizures] = Practice::ALL.map(|practice| practice.to_string());
    line(&row(["lowest symbol rate that meets it", &low_risk, &no_effect, &no_seizures]))?;
    for lowest in &report.lowest {
        let rates_hz = [lowest.low_risk_hz, lowest.no_effect_hz, lowest.no_seizures_hz];
        let [low_risk, no_effect, no_seizures] = rates_hz.map(|hz| format!("{:.0}", hz.ceil()));
        line(&row([lowest.light, &low_risk, &no_effect, &no_seizures]))?;
    }
    if report.carrier_cycles.is_some_and(|cycles| cycles > 0) {
        return line(&format!("a transmitter shows {} to {}", SymbolRate::MIN, SymbolRate::MAX));
    }
    line(&format!(
        "a transmitter shows {} to {}; Manchester code, each panel and its complement, carries half of the data",
        SymbolRate::MIN,
        SymbolRate::MAX
    ))
}

/// Prints the table of all standards.
fn print_standards(report: &Report, cycles: u16) -> anyhow::Result<()> {
    let row = |first: [&str; 3], [low_risk, no_effect, no_seizures, period, pst_lm, svm]: [&str; 6]| {
        let [rate, carrier, light] = first;
        format!("{rate:>9}  {carrier:>10}  {light:18}{low_risk:>9} {no_effect:>10} {no_seizures:>12} {period:>10} {pst_lm:>8} {svm:>7}")
    };
    let [low_risk, no_effect, no_seizures] = Practice::ALL.map(|practice| practice.to_string());
    let names = [&low_risk, &no_effect, &no_seizures, "period, ms", "PstLM", "SVM"];
    line(&row(["symbols/s", "carrier/Hz", "by all standards"], names))?;
    for rate in &report.rates {
        let carrier = (f64::from(cycles) * rate.symbols_hz).to_string();
        for standards in rate.by_standards.iter().flatten() {
            let columns = standards.columns();
            line(&row(
                [&rate.symbols_hz.to_string(), &carrier, standards.light],
                columns.each_ref().map(String::as_str),
            ))?;
        }
    }
    line("low risk, no effect, no seizures: relative to the limits of IEEE Std 1789-2015. Longest period: IEEE Std 802.15.7 allows 5 ms.")?;
    line("PstLM: IEC TR 61547-1; half of all people see a flicker of 1. SVM: CIE TN 006:2016; 1 is the threshold of sight.")?;
    line("")
}
