//! `vocc device lock` and `unlock`: the PIN of a transmitter's serial ports.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use link::serial::{Answer, Refusal, Request};
use serde_json::json;

use crate::device::DeviceError;
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};
use crate::pin::Pin;

/// Arguments of `vocc device lock`.
#[derive(clap::Args)]
pub struct Lock {
    #[command(flatten)]
    port: Port,
    /// The file whose first line is the new PIN, 6 to 128 bytes, or `-` for standard input. Without it, the PIN is asked for at the
    /// terminal, twice.
    #[arg(long, value_name = "FILE")]
    new_pin_file: Option<PathBuf>,
}

/// Arguments of `vocc device unlock`.
#[derive(clap::Args)]
pub struct Unlock {
    #[command(flatten)]
    port: Port,
}

/// Locks a transmitter, or changes its PIN.
pub fn lock(arguments: &Lock, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let Lock { port, new_pin_file } = arguments;
    if port.takes_standard_input() && new_pin_file.as_deref() == Some(Path::new("-")) {
        bail!("standard input is one PIN, not two: give --pin-file or --new-pin-file a file");
    }
    let given = new_pin_file.as_deref().map(Pin::read).transpose()?;
    let mut client = port.greet_transmitter()?;
    // Firmware without a lock is found before anybody types.
    ask(&mut client, &Request::ReadLock).with_context(|| port.name())?;
    let pin = match given {
        Some(pin) => pin,
        None => Pin::ask_new()?,
    };
    let mut salt = [0; 8];
    getrandom::fill(&mut salt).context("this system provides no random numbers for a lock")?;
    let salt = u64::from_le_bytes(salt);
    let key = pin.key(salt)?.public().to_bytes();
    change(&mut client, &Request::WriteLock { key: &key, salt }, port)?;
    report(port, true, shared)
}

/// Removes the lock, if there is one.
pub fn unlock(arguments: &Unlock, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let port = &arguments.port;
    let mut client = port.greet_transmitter()?;
    if ask(&mut client, &Request::ReadLock).with_context(|| port.name())? {
        change(&mut client, &Request::RemoveLock, port)?;
    }
    report(port, false, shared)
}

/// Whether a transmitter is locked; `None` if its firmware has no lock, or if its memory cannot be read.
pub fn is_locked(client: &mut Connection) -> Result<Option<bool>, DeviceError> {
    match ask(client, &Request::ReadLock) {
        Err(DeviceError::NoLock | DeviceError::Refused(Refusal::NoLock | Refusal::Store)) => Ok(None),
        outcome => outcome.map(Some),
    }
}

fn change(client: &mut Connection, request: &Request<'_>, port: &Port) -> anyhow::Result<()> {
    let outcome = ask(client, request);
    let is_open = matches!(
        outcome,
        Err(DeviceError::Silent { .. } | DeviceError::NoTransmitter { .. } | DeviceError::Disconnected { .. })
    );
    let outcome = outcome.map(drop).with_context(|| port.name());
    if is_open {
        outcome.context("the old PIN or the new one may be in use, or none: `vocc device status` shows whether it is locked")
    } else {
        outcome
    }
}

fn report(port: &Port, is_locked: bool, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    if shared.json {
        output::json(&json!({ "port": port.name(), "locked": is_locked }))?;
    } else if is_locked {
        line(&format!("{}: locked: changes need the PIN", port.name()))?;
    } else {
        line(&format!("{}: not locked", port.name()))?;
    }
    Ok(Verdict::Yes)
}

/// Whether it is locked.
fn ask(client: &mut Connection, request: &Request<'_>) -> Result<bool, DeviceError> {
    let outcome = client.ask(request, |answer| match answer {
        Answer::Lock { salt, .. } => Some(salt.is_some()),
        _ => None,
    });
    outcome.map_err(|error| error.if_unknown(DeviceError::NoLock))
}
