//! `vocc device rate`: the symbol rate and the carrier of a transmitter, or the rate that a receiver expects.

use anyhow::{Context, ensure};
use link::l2a_table::L2aTable;
use link::serial::{self, Request};
use link::symbol_rate::SymbolRate;
use link::waveform::{SymbolTiming, Waveform};
use serde_json::json;
use sim::l2a::{OtherWaveform, SHIPPED_FOR};
use studies::flicker::Practice;
use studies::signalling::parked_at;

use super::receiver;
use crate::device::DeviceError;
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};

/// The rate and the carrier to set, if any.
#[derive(clap::Args)]
pub struct RateOptions {
    /// Symbols a second to set. Without it, the rate in use is printed. A transmitter accepts 9 to 300 and stores the rate. A
    /// receiver accepts up to its camera's frame rate and forgets the rate at a restart.
    #[arg(value_name = "N", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Set the rate for a camera of this many frames a second.
    #[arg(long, value_name = "FPS", conflicts_with = "rate")]
    camera_fps: Option<f64>,
    /// That camera's exposure time in seconds.
    #[arg(long, value_name = "S", requires = "camera_fps", default_value_t = 0.001)]
    exposure: f64,
    /// Cycles of the carrier per symbol, so that the LEDs do not flicker visibly; the carrier must be 200 to 3000 Hz. 0: still panels.
    /// Default: no change. Without a stored value, a transmitter with shift registers shows a carrier.
    #[arg(long, value_name = "N")]
    carrier_cycles: Option<u32>,
}

impl RateOptions {
    fn hz(&self) -> anyhow::Result<Option<f64>> {
        if let Some(frames_hz) = self.camera_fps {
            let rate = SymbolRate::for_camera(frames_hz, self.exposure).with_context(|| {
                let exposure_s = self.exposure;
                format!("a camera of {frames_hz} frames a second that exposes for {exposure_s} s cannot follow a transmitter")
            })?;
            return Ok(Some(f64::from(rate.millihertz()) / 1e3));
        }
        Ok(self.rate)
    }
}

/// The rate of a board.
#[derive(Clone, Copy)]
pub struct BoardTiming {
    /// Symbols a second.
    pub symbol_rate_hz: f64,
    /// Cycles of the carrier per symbol, 0 for none; unknown for receivers, and for transmitters that do not know carriers.
    pub carrier_cycles: Option<u16>,
}

impl BoardTiming {
    /// The waveform; `None` if it is unknown.
    pub fn waveform(&self) -> Option<Waveform> {
        // Every board that reports cycles has checked them.
        Waveform::new(self.carrier_cycles?.into()).ok()
    }

    /// Cycles of the carrier per symbol, and its frequency in Hz, if there is one.
    pub fn carrier(&self) -> Option<(u16, f64)> {
        let cycles = self.carrier_cycles.filter(|&cycles| cycles > 0)?;
        Some((cycles, f64::from(cycles) * self.symbol_rate_hz))
    }
}

/// Changes the rate if requested, and prints the current one.
pub fn run(port: &Port, wanted: &RateOptions, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let hz = wanted.hz()?;
    let client = port.greet()?;
    let told = if client.identity().is_receiver() {
        ensure!(
            wanted.carrier_cycles.is_none(),
            "{}: this is a receiver, which finds a carrier by itself: omit --carrier-cycles",
            port.name()
        );
        BoardTiming {
            symbol_rate_hz: receiver::rate(client, port, hz)?,
            carrier_cycles: None,
        }
    } else {
        let (told, warning) = of_transmitter(client, port, hz, wanted.carrier_cycles)?;
        let is_changed = hz.is_some() || wanted.carrier_cycles.is_some();
        let carrier = told.carrier().filter(|_| is_changed);
        let parked = carrier.and_then(|(_, carrier_hz)| beside_cameras(carrier_hz));
        let slow = carrier.and_then(|(_, carrier_hz)| beside_eyes(told.symbol_rate_hz, carrier_hz));
        for warning in [warning, parked, slow].into_iter().flatten() {
            output::tell(format_args!("vocc: {}: {warning}", port.name()));
        }
        told
    };
    let BoardTiming {
        symbol_rate_hz,
        carrier_cycles,
    } = told;
    if shared.json {
        let mut values = json!({ "port": port.name(), "symbol_rate_hz": symbol_rate_hz });
        if let Some(cycles) = carrier_cycles {
            values["carrier_cycles"] = cycles.into();
        }
        output::json(&values)?;
    } else {
        let carrier = told.carrier();
        let carrier = carrier.map(|(cycles, carrier_hz)| format!(", each of {cycles} cycles of a carrier of {carrier_hz} Hz"));
        line(&format!(
            "{}: {symbol_rate_hz} symbols a second{}",
            port.name(),
            carrier.unwrap_or_default()
        ))?;
    }
    // Rates are sent in thousandths.
    let other_rate = hz.filter(|hz| (hz - symbol_rate_hz).abs() > 1e-3);
    let other_carrier = wanted
        .carrier_cycles
        .filter(|&cycles| carrier_cycles.map(u32::from) != Some(cycles));
    let others = [
        other_rate.map(|hz| format!("{hz} symbols a second")),
        other_carrier.map(|cycles| format!("{cycles} cycles of a carrier")),
    ];
    let others = others.into_iter().flatten().collect::<Vec<_>>();
    if !others.is_empty() {
        output::tell(format_args!(
            "vocc: {}: {} were asked for, but the board keeps what is shown above: its firmware may be too old, so flash the current one \
             (docs/hardware.md)",
            port.name(),
            others.join(" and ")
        ));
        return Ok(Verdict::No);
    }
    Ok(Verdict::Yes)
}

/// The rate and the carrier after the changes. If a carrier was set, also a warning if the table in use may not be made for it.
fn of_transmitter(client: Connection, port: &Port, hz: Option<f64>, cycles: Option<u32>) -> anyhow::Result<(BoardTiming, Option<String>)> {
    let rate = hz.map(SymbolRate::from_hz).transpose()?;
    let waveform = cycles.map(Waveform::new).transpose()?;
    let mut client = client.transmitter().with_context(|| port.name())?;
    let told = tell(&mut client, rate, waveform).with_context(|| {
        let firmware = &client.identity().firmware;
        format!("{} (firmware {firmware})", port.name())
    })?;
    let warning = waveform.and_then(|_| beside_table(&mut client, told.waveform()?));
    Ok((told, warning))
}

/// A warning if usual cameras see the phase of a carrier change slowly.
fn beside_cameras(carrier_hz: f64) -> Option<String> {
    let cameras: Vec<String> = parked_at(carrier_hz).map(|hz| hz.to_string()).collect();
    (!cameras.is_empty()).then(|| {
        format!(
            "cameras of {} frames a second see the phase of {carrier_hz} Hz change slowly, and may read nothing for seconds: it is near a \
             multiple of half their frame rate. `vocc plan --camera` recommends a rate and a carrier for your camera",
            cameras.join(", ")
        )
    })
}

/// A warning if a carrier is so slow that it may not be of low risk, as one that is kept at another symbol rate.
fn beside_eyes(symbol_rate_hz: f64, carrier_hz: f64) -> Option<String> {
    let least_hz = Practice::LowRisk.lowest_carrier_hz();
    let faster = (least_hz / symbol_rate_hz).ceil() as u32..=(Waveform::MAX_HZ / symbol_rate_hz) as u32;
    let apart = |&cycles: &u32| parked_at(f64::from(cycles) * symbol_rate_hz).next().is_none();
    (carrier_hz < least_hz).then(|| {
        let advice = match faster.clone().find(apart).or(faster.clone().next()) {
            Some(cycles) => format!("--carrier-cycles {cycles} makes it {} Hz", f64::from(cycles) * symbol_rate_hz),
            None => "`vocc plan --camera` recommends a rate and a carrier for your camera".into(),
        };
        format!("a carrier of {carrier_hz} Hz may flicker at more than low risk, which is from {least_hz:.0} Hz on: {advice}")
    })
}

/// A warning if a carrier is shown with the shipped table, which is made for still panels; for other tables, which do not record their
/// waveform, the command that compares.
fn beside_table(client: &mut Connection, shown: Waveform) -> Option<String> {
    let crc = client.ask(&Request::Status, |answer| match answer {
        serial::Answer::Status(status) => Some(status.table_crc),
        _ => None,
    });
    // Skip what the transmitter does not report.
    let crc = crc.ok()?;
    if crc == L2aTable::shipped().crc() {
        return OtherWaveform::if_any(SHIPPED_FOR, shown).map(|other| other.to_string());
    }
    (!shown.is_still()).then(|| {
        format!(
            "table {crc:08x} in use carries no note of the waveform that it is made for; `vocc table verify FILE --port P` warns if FILE, which it \
             was pushed from, is made for another"
        )
    })
}

fn tell(client: &mut Connection, rate: Option<SymbolRate>, waveform: Option<Waveform>) -> anyhow::Result<BoardTiming> {
    let Some(waveform) = waveform else {
        if let Some(rate) = rate {
            let millihertz = rate.millihertz();
            ask_rate(client, &Request::WriteSymbolRate { millihertz })?;
        }
        return Ok(in_use(client)?);
    };
    let rate = match rate {
        Some(rate) => rate,
        None => SymbolRate::from_hz(ask_carrier(client, &Request::ReadCarrier)?.symbol_rate_hz)?,
    };
    SymbolTiming::new(rate, waveform)?;
    let request = Request::WriteCarrier {
        millihertz: rate.millihertz(),
        cycles: waveform.cycles(),
    };
    Ok(ask_carrier(client, &request)?)
}

/// The rate and carrier of a transmitter.
pub fn in_use(client: &mut Connection) -> Result<BoardTiming, DeviceError> {
    match ask_carrier(client, &Request::ReadCarrier) {
        Err(DeviceError::NoCarrier) => Ok(BoardTiming {
            symbol_rate_hz: ask_rate(client, &Request::ReadSymbolRate)?,
            carrier_cycles: None,
        }),
        outcome => outcome,
    }
}

fn ask_carrier(client: &mut Connection, request: &Request<'_>) -> Result<BoardTiming, DeviceError> {
    let told = client.ask(request, |answer| match answer {
        serial::Answer::Carrier { millihertz, cycles } => Some(BoardTiming {
            symbol_rate_hz: f64::from(millihertz) / 1e3,
            carrier_cycles: Some(cycles),
        }),
        _ => None,
    });
    told.map_err(|error| error.if_unknown(DeviceError::NoCarrier))
}

fn ask_rate(client: &mut Connection, request: &Request<'_>) -> Result<f64, DeviceError> {
    let told = client.ask(request, |answer| match answer {
        serial::Answer::SymbolRate { millihertz } => Some(f64::from(millihertz) / 1e3),
        _ => None,
    });
    told.map_err(|error| error.if_unknown(DeviceError::NoSymbolRate))
}
