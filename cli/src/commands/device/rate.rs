//! `vocc device rate`: how many symbols a second a transmitter shows, or a receiver expects.

use anyhow::Context;
use link::serial::{self, Refusal, Request};
use link::symbol_rate::SymbolRate;
use serde_json::json;

use super::receiver;
use crate::device::DeviceError;
use crate::options::{Connection, Port, Shared};
use crate::output::{self, Verdict, line};

/// The rate that is wanted, if any.
#[derive(clap::Args)]
pub struct Wanted {
    /// Symbols a second from now on; without it, the rate in use is told. A transmitter takes 9 to 300, and stores them for good; a
    /// receiver takes up to as many as its camera takes frames, and forgets them when it is switched off.
    #[arg(value_name = "N", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// The rate for a camera of so many frames a second.
    #[arg(long, value_name = "FPS", conflicts_with = "rate")]
    camera_fps: Option<f64>,
    /// How long that camera exposes, in seconds.
    #[arg(long, value_name = "S", requires = "camera_fps", default_value_t = 0.001)]
    exposure: f64,
}

impl Wanted {
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

/// Tells the rate, after changing it if another one is wanted.
pub fn run(port: &Port, wanted: &Wanted, shared: &Shared) -> anyhow::Result<Verdict> {
    let wanted = wanted.hz()?;
    let client = port.greet()?;
    let rate_hz = if client.identity().is_receiver() {
        receiver::rate(client, port, wanted)?
    } else {
        of_transmitter(client, port, wanted)?
    };
    if shared.json {
        output::json(&json!({ "port": port.name(), "symbol_rate_hz": rate_hz }))?;
    } else {
        line(&format!("{}: {rate_hz} symbols a second", port.name()))?;
    }
    // Rates are told in thousandths.
    let other = wanted.filter(|wanted_hz| (wanted_hz - rate_hz).abs() > 1e-3);
    if let Some(wanted_hz) = other {
        output::tell(format_args!(
            "vocc: {}: {wanted_hz} symbols a second were asked for, and it keeps to {rate_hz}: update its firmware",
            port.name()
        ));
        return Ok(Verdict::No);
    }
    Ok(Verdict::Yes)
}

fn of_transmitter(client: Connection, port: &Port, wanted: Option<f64>) -> anyhow::Result<f64> {
    let wanted = wanted.map(SymbolRate::from_hz).transpose()?;
    let mut client = client.transmitter().with_context(|| port.name())?;
    let request = wanted.map_or(Request::ReadSymbolRate, |rate| Request::WriteSymbolRate {
        millihertz: rate.millihertz(),
    });
    ask(&mut client, &request).with_context(|| {
        let firmware = &client.identity().firmware;
        format!("{} (firmware {firmware})", port.name())
    })
}

/// The rate that a transmitter shows; none where its firmware is too old to say.
pub fn symbol_rate_hz(client: &mut Connection) -> Result<Option<f64>, DeviceError> {
    match ask(client, &Request::ReadSymbolRate) {
        Ok(rate) => Ok(Some(rate)),
        Err(DeviceError::NoSymbolRate) => Ok(None),
        Err(error) => Err(error),
    }
}

fn ask(client: &mut Connection, request: &Request<'_>) -> Result<f64, DeviceError> {
    let told = client.ask(request, |answer| match answer {
        serial::Answer::SymbolRate { millihertz } => Some(f64::from(millihertz) / 1e3),
        _ => None,
    });
    told.map_err(|error| match error {
        DeviceError::Refused(Refusal::Unknown) => DeviceError::NoSymbolRate,
        other => other,
    })
}
