//! `vocc device rate`: how many symbols a second a transmitter shows.

use anyhow::Context;
use link::serial::{Answer as Told, Refusal, Request};
use link::symbol_rate::SymbolRate;
use serde_json::json;

use crate::device::DeviceError;
use crate::options::{Connection, Port, Shared};
use crate::output::{self, Answer, line};

/// The rate that is wanted, if any.
#[derive(clap::Args)]
pub struct Wanted {
    /// Symbols a second to show from now on, 9 to 300, stored for good; without it, the rate in use is told.
    #[arg(value_name = "N", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// The rate for a camera of so many frames a second.
    #[arg(long, value_name = "FPS", conflicts_with = "rate")]
    camera_fps: Option<f64>,
    /// How long that camera exposes, in seconds.
    #[arg(
        long,
        value_name = "S",
        requires = "camera_fps",
        default_value_t = 0.001
    )]
    exposure: f64,
}

impl Wanted {
    fn rate(&self) -> anyhow::Result<Option<SymbolRate>> {
        if let Some(frames_hz) = self.camera_fps {
            let rate = SymbolRate::for_camera(frames_hz, self.exposure).with_context(|| {
                let exposure_s = self.exposure;
                format!(
                    "a camera of {frames_hz} frames a second that exposes for {exposure_s} s cannot follow a transmitter"
                )
            })?;
            return Ok(Some(rate));
        }
        Ok(self.rate.map(SymbolRate::from_hz).transpose()?)
    }
}

/// Tells the rate, after changing it if another one is wanted.
pub fn run(port: &Port, wanted: &Wanted, shared: &Shared) -> anyhow::Result<Answer> {
    let wanted = wanted.rate()?;
    let mut client = port.greet()?;
    let request = wanted.map_or(Request::ReadSymbolRate, |rate| Request::WriteSymbolRate {
        millihertz: rate.millihertz(),
    });
    let shown = ask(&mut client, &request).with_context(|| {
        let firmware = &client.identity().firmware;
        format!("{} (firmware {firmware})", port.name())
    })?;
    if shared.json {
        output::json(&json!({ "port": port.name(), "symbol_rate_hz": shown }))?;
    } else {
        line(&format!("{}: {shown} symbols a second", port.name()))?;
    }
    Ok(Answer::Yes)
}

/// The rate that a transmitter shows; none where its firmware is too old to say.
pub fn shown(client: &mut Connection) -> Result<Option<f64>, DeviceError> {
    match ask(client, &Request::ReadSymbolRate) {
        Ok(rate) => Ok(Some(rate)),
        Err(DeviceError::NoSymbolRate) => Ok(None),
        Err(error) => Err(error),
    }
}

fn ask(client: &mut Connection, request: &Request<'_>) -> Result<f64, DeviceError> {
    let told = client.ask(request, |answer| match answer {
        Told::SymbolRate { millihertz } => Some(f64::from(millihertz) / 1e3),
        _ => None,
    });
    told.map_err(|error| match error {
        DeviceError::Refused(Refusal::Unknown) => DeviceError::NoSymbolRate,
        other => other,
    })
}
