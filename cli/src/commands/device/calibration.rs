//! `vocc device calibration`: the measured properties of a transmitter's panel.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use fixed::traits::Fixed;
use fixed::types::U32F32;
use link::intensity::IntensityLimit;
use link::serial::{self, Measured, Request};
use serde::{Deserialize, Serialize};
use serde_json::json;
use sim::input;
use tx_firmware::calibration::{BENCH, Calibration, INTERVAL, LOW_CURRENT_SHARE, LUMINANCE_CD_M2, PWM_PERIOD_NS, REFLECTANCE, SENSOR_GAIN};

use super::limit;
use crate::files;
use crate::options::{Port, SharedOptions};
use crate::output::{self, Verdict, line};

/// The values in common units; `tx_firmware::calibration` has their ranges.
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
    /// Maximum luminous intensity of the panel, cd; only with the diameter of an LED.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_cd: Option<f64>,
    /// The diameter of an LED, m; without a limit, it only makes the panel announce its size.
    #[serde(skip_serializing_if = "Option::is_none")]
    led_diameter_m: Option<f64>,
}

/// The bench panel without its luminance, on which dimming and limit depend most: a transmitter rejects the unchanged template.
const UNMEASURED: Measured = Measured {
    luminance_full_cd_m2: U32F32::ZERO,
    ..BENCH
};

/// Prints the values, after writing those of the file if there is one.
pub fn run(port: &Port, file: Option<&Path>, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let wanted = file.map(read).transpose()?;
    let mut client = port.greet_transmitter()?;
    if let Some((measured, limit)) = wanted {
        // The change that makes the panel darker comes first.
        limit::set(&mut client, limit).with_context(|| port.name())?;
        let request = Request::WriteCalibration(measured);
        client
            .ask(&request, |answer| (answer == serial::Answer::Done).then_some(()))
            .with_context(|| port.name())?;
    }
    let measured = client
        .ask(&Request::ReadCalibration, |answer| match answer {
            serial::Answer::Calibration(measured) => Some(measured),
            _ => None,
        })
        .with_context(|| port.name())?;
    let limit = limit::in_use(&mut client).with_context(|| port.name())?;
    let values = Values::of(&measured).limited_to(limit);
    if shared.json {
        output::json(&values)?;
    } else {
        output::lines(&toml::to_string(&values)?)?;
    }
    Ok(Verdict::Yes)
}

/// Prints a template, or writes it if the file does not exist.
pub fn template(file: Option<&Path>, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    match file {
        None if shared.json => output::json(&Values::of(&UNMEASURED))?,
        None => output::lines(&filled_in(&UNMEASURED))?,
        Some(path) => {
            files::check_new(path)?;
            files::write(path, filled_in(&UNMEASURED))?;
            let file = path.display().to_string();
            if shared.json {
                output::json(&json!({ "file": file }))?;
            } else {
                line(&format!(
                    "{file}: replace the values with your own, then `vocc device calibration {file} --port P`"
                ))?;
            }
        }
    }
    Ok(Verdict::Yes)
}

/// A file of these values, with comments.
pub fn filled_in(measured: &Measured) -> String {
    let Values {
        luminance_full_cd_m2,
        shortest_pulse_ns,
        pwm_period_ns,
        reflectance,
        interval,
        sensor_gain,
        low_current_share,
        ..
    } = Values::of(measured);
    format!(
        "\
# What was measured of a transmitter's panel, for `vocc device calibration FILE --port P`.
# The values are those of the bench's panel of docs/hardware.md: replace each by your own. A full luminance of 0 is refused.

# Luminance of an On LED at full duty, with ambient light shut out: cd/m², {} to {}.
luminance_full_cd_m2 = {luminance_full_cd_m2:?}

# Shortest clean pulse of the LED driver, from which on luminance over duty is a straight line: ns, 0 to pwm_period_ns.
shortest_pulse_ns = {shortest_pulse_ns}

# Longest period of the dimming: ns, {} to {}; a twentieth of the longest exposure, so that frames do not flicker.
pwm_period_ns = {pwm_period_ns}

# Reflectance of an Off LED beside a grey card (0.18) in the same light: {} to {}.
reflectance = {reflectance:?}

# Gap between LEDs over their diameter: {} to {}.
interval = {interval:?}

# Lux of a meter beside the light sensor over the lux that the sensor reads: {} to {}; 1 where it reads right.
sensor_gain = {sensor_gain:?}

# Light of an On LED at the low current over that at the full one: {} to {}; 1 where the current is not switched.
low_current_share = {low_current_share:?}

# The width of one LED's bright disc in m, 0.0001 to 1: the panel then tells receivers how large it is, so that they know how far away.
# led_diameter_m = 0.03

# A limit, if there is to be one, with the width above: the most mean luminous intensity of the panel, straight ahead, in cd, 0.001 to
# 1000000. No light and no table takes the panel above it.
# max_cd = 100.0
",
        LUMINANCE_CD_M2.start(),
        LUMINANCE_CD_M2.end(),
        PWM_PERIOD_NS.start(),
        PWM_PERIOD_NS.end(),
        decimal(*REFLECTANCE.start()),
        REFLECTANCE.end(),
        INTERVAL.start(),
        INTERVAL.end(),
        decimal(*SENSOR_GAIN.start()),
        SENSOR_GAIN.end(),
        decimal(*LOW_CURRENT_SHARE.start()),
        LOW_CURRENT_SHARE.end(),
    )
}

fn read(path: &Path) -> anyhow::Result<(Measured, Option<IntensityLimit>)> {
    let text = input::read_text(path, input::SCENE_MAX).with_context(|| format!("cannot read the calibration {}", path.display()))?;
    let values: Values = toml::from_str(&text).with_context(|| format!("{} is not a calibration", path.display()))?;
    let measured = values
        .measured()
        .map_err(|key| anyhow!("{}: {key} is not a number that a transmitter can hold", path.display()))?;
    Calibration::new(measured).with_context(|| path.display().to_string())?;
    let limit = values.limit().with_context(|| path.display().to_string())?;
    Ok((measured, limit))
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
            max_cd: None,
            led_diameter_m: None,
        }
    }

    fn limited_to(self, limit: Option<IntensityLimit>) -> Self {
        Self {
            max_cd: limit.and_then(IntensityLimit::most_cd),
            led_diameter_m: limit.map(|limit| f64::from(limit.led_diameter_um()) / 1e6),
            ..self
        }
    }

    fn limit(&self) -> anyhow::Result<Option<IntensityLimit>> {
        match (self.max_cd, self.led_diameter_m) {
            (None, None) => Ok(None),
            (max_cd, Some(led_diameter_m)) => Ok(Some(IntensityLimit::from_cd(max_cd, led_diameter_m)?)),
            (Some(_), None) => bail!("max_cd needs led_diameter_m, the diameter of one LED's bright disc in m: give both"),
        }
    }

    /// The values in fixed point, or the name of the first one that is out of range.
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

/// The nearest number of a type, if it is in range.
fn fixed<T: Fixed>(value: f64) -> Option<T> {
    value.is_finite().then(|| T::checked_from_num(value))?
}

/// The shortest decimal fraction that rounds to this number.
fn decimal(number: impl Fixed) -> f64 {
    number.to_string().parse().unwrap_or(f64::NAN)
}
