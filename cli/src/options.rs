//! Options that several commands share.

use std::ffi::OsStr;
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, SystemTime};

use anyhow::{Context, anyhow};
use clap::Args;
use link::framing::MESSAGE_MAX;
use rx_pipeline::detect::Method;
use serialport::SerialPort;
use sim::scene::Scene;
use studies::detectors::DetectorChoice;

use crate::device::{Client, port};
use crate::pin::Pin;

/// Up to this number a `f64` holds each whole number.
const EXACT_MAX: f64 = (1u64 << 53) as f64;

/// Options of every command.
#[derive(Args)]
pub struct SharedOptions {
    /// Override a scene key, such as pose.distance_m=70 (repeatable); KEY=none unsets it.
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    pub set: Vec<String>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1, global = true)]
    pub seed: u64,
    /// Number of threads, 1 to 1024. Default: all processors.
    #[arg(long, global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print JSON and nothing else on standard output.
    #[arg(long, global = true)]
    pub json: bool,
}

impl SharedOptions {
    /// The scene of that name or file, with the overrides applied.
    pub fn scene(&self, name: impl AsRef<OsStr>) -> anyhow::Result<Scene> {
        let name = name.as_ref();
        Scene::load(name, &self.set).map_err(|error| {
            if name.to_str().is_some_and(|name| name.parse::<f64>().is_ok()) {
                anyhow!("{error}; separate the values of an option by commas, such as 0.5,1")
            } else {
                error.into()
            }
        })
    }
}

/// A parser of whole numbers within `range`, also such as 1e6 and 1_000_000.
pub fn whole(range: RangeInclusive<u64>) -> impl Fn(&str) -> Result<u64, String> + Clone {
    move |text| {
        let digits = text.replace('_', "");
        let exact = |value: f64| (value.fract() == 0.0 && (0.0..=EXACT_MAX).contains(&value)).then_some(value as u64);
        let number = digits.parse().ok().or_else(|| exact(digits.parse().ok()?));
        number.filter(|number| range.contains(number)).ok_or_else(|| match *range.end() {
            u64::MAX => format!("give a whole number from {} on", range.start()),
            most => format!("give a whole number from {} to {most}", range.start()),
        })
    }
}

/// A message, from the command line or from a file.
#[derive(Args)]
#[group(multiple = false)]
pub struct Message {
    /// The message, 1 to 1024 bytes.
    #[arg(long, value_name = "T")]
    message: Option<String>,
    /// A file with the message, 1 to 1024 bytes of any kind.
    #[arg(long, value_name = "FILE")]
    message_file: Option<PathBuf>,
}

impl Message {
    /// The message's file, if it has one.
    pub fn file(&self) -> Option<PathBuf> {
        self.message_file.clone()
    }

    /// The message's bytes; `None` if no message is given.
    pub fn bytes(&self) -> anyhow::Result<Option<Vec<u8>>> {
        match (&self.message, &self.message_file) {
            (Some(text), _) => Ok(Some(text.clone().into_bytes())),
            (None, Some(path)) => {
                let mut bytes = Vec::new();
                // One byte over the limit suffices to reject it.
                let limit = MESSAGE_MAX as u64 + 1;
                File::open(path)
                    .and_then(|file| file.take(limit).read_to_end(&mut bytes))
                    .with_context(|| format!("cannot read the message from {}", path.display()))?;
                Ok(Some(bytes))
            }
            (None, None) => Ok(None),
        }
    }
}

/// The detection method of a choice that needs no training frames.
pub fn untrained(choice: DetectorChoice) -> anyhow::Result<Method> {
    choice.untrained().context(
        "this detector needs frames with known bits (fisher and fisher-ngr learn from them, the genie knows everything else too), and \
         there are none here: choose ml, kmeans, kmeans-raw or otsu, or run `vocc link` or `vocc evaluate`",
    )
}

/// The serial port of a transmitter or a receiver.
#[derive(Args)]
pub struct Port {
    /// The serial port, or a pseudo-terminal.
    #[arg(long, value_name = "P")]
    port: String,
    /// Baud rate of a UART; USB ignores it.
    #[arg(long, default_value_t = 115_200, value_name = "B", value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,
    /// Seconds to wait for an answer before repeating the request, 0.05 to 60.
    #[arg(long, default_value_t = 1.0, value_name = "S", value_parser = seconds::<50, 60_000>)]
    timeout: f64,
    /// The file whose first line is the PIN of a locked transmitter, or `-` for standard input. Only changes need it. Without this option,
    /// the PIN is asked for at the terminal.
    #[arg(long, value_name = "FILE")]
    pin_file: Option<PathBuf>,
}

/// A session at a serial port.
pub type Connection = Client<Box<dyn SerialPort>>;

impl Port {
    /// The port's name.
    pub fn name(&self) -> String {
        self.port.clone()
    }

    /// Connects to the transmitter at this port.
    pub fn greet_transmitter(&self) -> anyhow::Result<Connection> {
        self.greet()?.transmitter().with_context(|| self.name())
    }

    /// Connects to the receiver at this port.
    pub fn greet_receiver(&self) -> anyhow::Result<Connection> {
        self.greet()?.receiver().with_context(|| self.name())
    }

    /// Connects to the transmitter or the receiver at this port.
    pub fn greet(&self) -> anyhow::Result<Connection> {
        let mut pin = self.pin_file.as_deref().map(Pin::read).transpose()?;
        let patience = Duration::from_secs_f64(self.timeout);
        let port = port::open(&self.port, self.baud, patience)?;
        // Two runs with the same first number would be indistinguishable.
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        // A clock that was never set may be before 1970.
        let away = now.unwrap_or_else(|early| early.duration());
        let sequence = away.as_nanos() as u32;
        let client = Client::greet(port, patience, sequence).with_context(|| self.name())?;
        Ok(client.opened_by(Box::new(move |salt| {
            let known = pin.take().map_or_else(|| Pin::ask("PIN of the transmitter"), Ok)?;
            Ok(pin.insert(known).key(salt)?)
        })))
    }

    /// Whether this is the PIN's source.
    pub fn takes_standard_input(&self) -> bool {
        self.pin_file.as_deref() == Some(Path::new("-"))
    }
}

/// Parses a number of seconds, with bounds in milliseconds.
pub fn seconds<const LEAST_MS: u64, const MOST_MS: u64>(text: &str) -> Result<f64, String> {
    number_in(text, LEAST_MS as f64 / 1000.0..=MOST_MS as f64 / 1000.0, "seconds")
}

/// Parses a number within a range; the refusal names the range and the unit.
pub fn number_in<T: FromStr + PartialOrd + Display>(text: &str, range: RangeInclusive<T>, unit: &str) -> Result<T, String> {
    match text.parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => {
            let refusal = format!("give {} to {} {unit}", range.start(), range.end());
            Err(refusal.trim_end().into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_have_an_exponent() {
        let count = whole(1..=1_000_000);
        for (text, number) in [("7", 7), ("1e6", 1_000_000), ("2.5e3", 2500), ("10_000", 10_000)] {
            assert_eq!(count(text), Ok(number), "{text}");
        }
        for text in ["0", "1e7", "1.5", "-3", "many", "", "1e400", "nan"] {
            assert_eq!(count(text), Err("give a whole number from 1 to 1000000".into()), "{text}");
        }
        assert_eq!(whole(0..=u64::MAX)("18446744073709551615"), Ok(u64::MAX));
    }
}
