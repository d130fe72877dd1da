//! `vocc device calibration`: what was measured of a transmitter's panel.

use std::path::Path;

use anyhow::{Context, anyhow};
use fixed::traits::Fixed;
use link::serial::{Answer as Told, Measured, Request};
use serde::{Deserialize, Serialize};
use sim::input;
use tx_firmware::calibration::Calibration;

use crate::options::{Port, Shared};
use crate::output::{self, Answer, line};

/// The values in numbers that people read; `tx_firmware::calibration` knows their ranges.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Values {
    luminance_full_cd_m2: f64,
    shortest_pulse_ns: u32,
    pwm_period_ns: u32,
    reflectance: f64,
    interval: f64,
    sensor_gain: f64,
    low_current_share: f64,
}

/// Prints the values, after writing those of the file if there is one.
pub fn run(port: &Port, file: Option<&Path>, shared: &Shared) -> anyhow::Result<Answer> {
    let wanted = file.map(read).transpose()?;
    let mut client = port.greet()?;
    if let Some(measured) = wanted {
        let request = Request::WriteCalibration(measured);
        client
            .ask(&request, |answer| (answer == Told::Done).then_some(()))
            .with_context(|| port.name())?;
    }
    let measured = client
        .ask(&Request::ReadCalibration, |answer| match answer {
            Told::Calibration(measured) => Some(measured),
            _ => None,
        })
        .with_context(|| port.name())?;
    let values = Values::of(&measured);
    if shared.json {
        output::json(&values)?;
    } else {
        line(toml::to_string(&values)?.trim_end())?;
    }
    Ok(Answer::Yes)
}

fn read(path: &Path) -> anyhow::Result<Measured> {
    let text = input::read_text(path, input::SCENE_MAX)
        .with_context(|| format!("cannot read the calibration {}", path.display()))?;
    let values: Values = toml::from_str(&text)
        .with_context(|| format!("{} holds no calibration", path.display()))?;
    let measured = values.measured().map_err(|key| {
        anyhow!(
            "{}: {key} is no number that a transmitter can hold",
            path.display()
        )
    })?;
    Calibration::new(measured).with_context(|| path.display().to_string())?;
    Ok(measured)
}

impl Values {
    fn of(measured: &Measured) -> Self {
        Self {
            luminance_full_cd_m2: decimal(measured.luminance_full_cd_m2),
            shortest_pulse_ns: measured.shortest_pulse_ns,
            pwm_period_ns: measured.pwm_period_ns,
            reflectance: decimal(measured.reflectance),
            interval: decimal(measured.interval),
            sensor_gain: decimal(measured.sensor_gain),
            low_current_share: decimal(measured.low_current_share),
        }
    }

    /// The values in fixed point, or the name of the first that has no place there.
    fn measured(&self) -> Result<Measured, &'static str> {
        Ok(Measured {
            luminance_full_cd_m2: fixed(self.luminance_full_cd_m2).ok_or("luminance_full_cd_m2")?,
            shortest_pulse_ns: self.shortest_pulse_ns,
            pwm_period_ns: self.pwm_period_ns,
            reflectance: fixed(self.reflectance).ok_or("reflectance")?,
            interval: fixed(self.interval).ok_or("interval")?,
            sensor_gain: fixed(self.sensor_gain).ok_or("sensor_gain")?,
            low_current_share: fixed(self.low_current_share).ok_or("low_current_share")?,
        })
    }
}

/// The nearest number of a type, if it has room for it.
fn fixed<T: Fixed>(value: f64) -> Option<T> {
    value.is_finite().then(|| T::checked_from_num(value))?
}

/// The shortest decimal fraction that is rounded to this number.
fn decimal(number: impl Fixed) -> f64 {
    number.to_string().parse().unwrap_or(f64::NAN)
}
