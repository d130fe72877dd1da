//! `vocc device`: transmitters and receivers at serial ports.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, ensure};
use clap::Subcommand;
use link::framing::MESSAGE_MAX;
use link::serial::{self, Limit, Request, Status};
use serde_json::{Value, json};
use tx_firmware::dimming::Duty;

use crate::device::{DeviceError, port};
use crate::frames::cameras;
use crate::options::{Connection, Message, Port, SharedOptions, seconds};
use crate::output::{self, Verdict, line};
use crate::stop::stop;

mod bring_up;
mod calibrate;
mod calibration;
mod hello;
mod key;
mod limit;
mod lock;
pub mod rate;
mod receiver;
mod simulate;

/// Arguments of `vocc device`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

/// Arguments of `vocc device watch`.
#[derive(clap::Args)]
struct Watch {
    #[command(flatten)]
    port: Port,
    /// Seconds between two outputs, 0.05 to 3600.
    #[arg(long, default_value_t = 1.0, value_name = "S", value_parser = seconds::<50, 3_600_000>)]
    interval: f64,
    /// The number of outputs. Default: until Ctrl-C.
    #[arg(long)]
    count: Option<u64>,
    /// For a receiver, also print its last reading: LEDs, soft values, range.
    #[arg(long)]
    readings: bool,
}

impl Watch {
    fn interval(&self) -> Duration {
        Duration::from_secs_f64(self.interval)
    }
}

#[derive(Subcommand)]
enum Action {
    /// List the serial ports and the cameras of this computer.
    List,
    /// Name a board: its kind, its firmware's version and the hash of its program, which --image compares with a file's. See
    /// docs/releasing.md.
    Hello(hello::Arguments),
    /// Print the status of a transmitter or a receiver.
    Status {
        #[command(flatten)]
        port: Port,
    },
    /// Print the status repeatedly until Ctrl-C; for a receiver also each message as it comes.
    Watch(Watch),
    /// Save the picture of a receiver's camera as PNG: the panel's surroundings, or the whole frame.
    Snapshot(receiver::Snapshot),
    /// Print the calibration of a transmitter's panel, or write a file's values to it.
    Calibration {
        #[command(flatten)]
        port: Option<Port>,
        /// A TOML file as this command prints it; its values are checked, stored and used.
        file: Option<PathBuf>,
        /// Print a template of such a file, with units and ranges, or write it to FILE; this needs no transmitter.
        #[arg(long, value_name = "FILE", num_args = 0..=1, conflicts_with_all = ["file", "port"])]
        template: Option<Option<PathBuf>>,
    },
    /// Compute a panel's calibration from pictures of the panel and a grey card: see docs/calibration.md.
    Calibrate(calibrate::Arguments),
    /// Test a new board: its light sensor, its flash memory, and its LEDs by eye or by a camera. See docs/hardware/bring-up.md.
    Test(bring_up::Arguments),
    /// Simulate a transmitter: a serial port with the real firmware behind it, to try the other commands.
    Simulate(simulate::Arguments),
    /// Print or set the symbol rate, and a transmitter's carrier.
    Rate {
        #[command(flatten)]
        port: Port,
        #[command(flatten)]
        wanted: rate::RateOptions,
    },
    /// The key with which a transmitter signs its messages: show, set or erase it.
    Key(key::Arguments),
    /// Lock a transmitter's serial ports, or change the PIN: each command that changes something then needs it. See docs/serial.md.
    Lock(lock::Lock),
    /// Remove the lock of a transmitter's serial ports.
    Unlock(lock::Unlock),
    /// Send a transmitter a message to show.
    Send {
        #[command(flatten)]
        port: Port,
        #[command(flatten)]
        message: Message,
        /// Number of times to show the message. Default: until the next message.
        #[arg(long, value_name = "N")]
        repeats: Option<u32>,
        /// Stop the message, and show only beacons.
        #[arg(long, conflicts_with_all = ["message", "message_file", "repeats"])]
        stop: bool,
    },
}

/// Lists ports, queries or configures a board.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    match &arguments.action {
        Action::List => list(shared),
        Action::Hello(arguments) => hello::run(arguments, shared),
        Action::Status { port } => {
            let client = port.greet()?;
            if client.identity().is_receiver() {
                return receiver::status(client, port, shared);
            }
            let mut client = client.transmitter().with_context(|| port.name())?;
            report(&status(&mut client, port)?, &mut client, port, shared)?;
            Ok(Verdict::Yes)
        }
        Action::Watch(arguments) => watch(arguments, shared),
        Action::Snapshot(arguments) => receiver::snapshot(arguments, shared),
        Action::Calibration { template: Some(file), .. } => calibration::template(file.as_deref(), shared),
        Action::Calibration { port, file, .. } => {
            let port = port.as_ref().context("give the port with --port")?;
            calibration::run(port, file.as_deref(), shared)
        }
        Action::Calibrate(arguments) => calibrate::run(arguments, shared),
        Action::Test(arguments) => bring_up::run(arguments, shared),
        Action::Simulate(arguments) => simulate::run(arguments, shared),
        Action::Rate { port, wanted } => rate::run(port, wanted, shared),
        Action::Key(arguments) => key::run(arguments, shared),
        Action::Lock(arguments) => lock::lock(arguments, shared),
        Action::Unlock(arguments) => lock::unlock(arguments, shared),
        Action::Send { port, stop, .. } if *stop => done(port, &Request::StopSending, shared),
        Action::Send {
            port, message, repeats, ..
        } => {
            let message = message
                .bytes()?
                .context("give a message with --message or --message-file, or --stop")?;
            let length = message.len();
            ensure!(
                (1..=MESSAGE_MAX).contains(&length),
                "the message has {length} bytes: give 1 to {MESSAGE_MAX}"
            );
            let (repeats, message) = (*repeats, &message[..]);
            done(port, &Request::Send { repeats, message }, shared)
        }
    }
}

fn list(shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let ports = port::list().context("cannot list the serial ports")?;
    for listed in &ports {
        if shared.json {
            output::json(listed)?;
        } else {
            let product = listed.product.as_deref().unwrap_or("");
            line(&format!("{:<20} {:<10} {product}", listed.port, listed.bus))?;
        }
    }
    let cameras = cameras::list();
    for camera in &cameras {
        if shared.json {
            output::json(camera)?;
        } else {
            line(&format!("{:<20} {:<10} {}", camera.camera.display(), "camera", camera.name))?;
        }
    }
    if ports.is_empty() {
        output::tell("no serial ports: plug a transmitter in");
    }
    Ok(if ports.is_empty() && cameras.is_empty() {
        Verdict::No
    } else {
        Verdict::Yes
    })
}

fn watch(arguments: &Watch, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    const NAP: Duration = Duration::from_millis(50);
    let Watch { port, count, readings, .. } = arguments;
    let (stop, interval) = (stop(), arguments.interval());
    let client = port.greet()?;
    if client.identity().is_receiver() {
        return receiver::watch(client, arguments, shared);
    }
    ensure!(
        !readings,
        "{}: this is a transmitter, and --readings is for receivers: omit it",
        port.name()
    );
    let mut client = client.transmitter().with_context(|| port.name())?;
    let mut told = 0;
    while !stop.is_asked() && !output::is_unread() && count.is_none_or(|count| told < count) {
        let asked = std::time::Instant::now();
        let status = status(&mut client, port)?;
        if shared.json {
            report(&status, &mut client, port, shared)?;
        } else {
            line(&short(&status))?;
        }
        told += 1;
        while !stop.is_asked() && *count != Some(told) && asked.elapsed() < interval {
            std::thread::sleep(NAP.min(interval.saturating_sub(asked.elapsed())));
        }
    }
    Ok(Verdict::Yes)
}

fn done(port: &Port, request: &Request<'_>, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let mut client = port.greet_transmitter()?;
    client
        .ask(request, |answer| (answer == serial::Answer::Done).then_some(()))
        .with_context(|| port.name())?;
    if shared.json {
        output::json(&json!({ "port": port.name(), "done": true }))?;
    } else {
        line(&format!("{}: done", port.name()))?;
    }
    Ok(Verdict::Yes)
}

fn status(client: &mut Connection, port: &Port) -> anyhow::Result<Status> {
    client
        .ask(&Request::Status, |answer| match answer {
            serial::Answer::Status(status) => Some(status),
            _ => None,
        })
        .with_context(|| port.name())
}

fn lux(status: &Status) -> Option<f64> {
    status.illuminance_lx.map(|lx| lx.to_num())
}

fn faults(status: &Status) -> Vec<String> {
    let names = status.faults.iter_names();
    names.map(|(name, _)| name.to_lowercase()).collect()
}

fn limited(status: &Status) -> Option<&'static str> {
    status.limited.map(|limit| match limit {
        // At maximum luminance the duty is 1.
        Limit::Top if status.duty < Duty::MAX => "intensity",
        Limit::Top => "top",
        Limit::Floor => "floor",
        Limit::Off => "off",
    })
}

fn as_json(status: &Status) -> Value {
    json!({
        "uptime_s": status.uptime_s,
        "light": format!("{:?}", status.light).to_lowercase(),
        "illuminance_lx": lux(status),
        "l2a": status.l2a.to_num::<f64>(),
        "luminance_cd_m2": status.luminance_cd_m2.to_num::<f64>(),
        "duty": status.duty.to_num::<f64>(),
        "limited": limited(status),
        "faults": faults(status),
        "table_crc": format!("{:08x}", status.table_crc),
        "sending": status.sending,
        "frames": status.counters.frames,
        "bad_frames": status.counters.bad_frames,
        "refusals": status.counters.refusals,
        "symbols": status.counters.symbols,
        "lost_symbols": status.counters.lost_symbols,
        "readings": status.counters.readings,
        "missed_readings": status.counters.missed_readings,
    })
}

/// One line of `watch`.
fn short(status: &Status) -> String {
    let light = lux(status).map_or_else(|| "dark".into(), |lx| format!("{lx:.2} lx"));
    format!(
        "{:>8} s  {light:>14}  L2A {:.3}  {:>10.2} cd/m²  duty {:.4}  {}{}",
        status.uptime_s,
        status.l2a.to_num::<f64>(),
        status.luminance_cd_m2.to_num::<f64>(),
        status.duty.to_num::<f64>(),
        if status.sending { "sending" } else { "idle" },
        faults(status).iter().map(|fault| format!("  {fault}!")).collect::<String>()
    )
}

fn report(status: &Status, client: &mut Connection, port: &Port, shared: &SharedOptions) -> anyhow::Result<()> {
    let mut values = as_json(status);
    let told = match rate::in_use(client) {
        // The firmware is too old to report it.
        Err(DeviceError::NoSymbolRate) => None,
        outcome => Some(outcome.with_context(|| port.name())?),
    };
    values["symbol_rate_hz"] = told.map(|told| told.symbol_rate_hz).into();
    values["carrier_cycles"] = told.and_then(|told| told.carrier_cycles).into();
    let key = key::in_use(client).with_context(|| port.name())?;
    values["signer"] = key.map(|(id, _)| id.to_string()).into();
    values["signer_counter"] = key.map(|(_, counter)| counter).into();
    values["locked"] = lock::is_locked(client).with_context(|| port.name())?.into();
    let identity = client.identity();
    values["port"] = port.name().into();
    values["board"] = identity.board.clone().into();
    values["firmware"] = identity.firmware.clone().into();
    if shared.json {
        return output::json(&values);
    }
    for (key, value) in values.as_object().into_iter().flatten() {
        let value = match value {
            Value::String(text) => text.clone(),
            Value::Null => "none".into(),
            Value::Array(names) if names.is_empty() => "none".into(),
            other => other.to_string(),
        };
        line(&format!("{key:<16} {value}"))?;
    }
    Ok(())
}
