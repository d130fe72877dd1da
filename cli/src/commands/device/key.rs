//! `vocc device key`: the key with which a transmitter signs its messages.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use link::framing::KeyId;
use link::serial::{Answer, Refusal, Request, Seed};
use reception::keys::OwnKey;
use serde_json::json;

use crate::device::DeviceError;
use crate::keys::counter_or_seconds;
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};

/// Arguments of `vocc device key`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    port: Port,
    /// Write this private key, made by `vocc keys new`: the transmitter then signs each message that it is sent. It never returns the key;
    /// `vocc keys show` prints the public key, which receivers need to trust it.
    #[arg(long, value_name = "KEY.toml", conflicts_with = "erase")]
    key: Option<PathBuf>,
    /// The counter of the key's first signature; a board that has this key already keeps its own counter if that is greater. Default: the
    /// seconds since 1970.
    #[arg(long, value_name = "N", requires = "key")]
    counter: Option<u32>,
    /// Erase the key: the transmitter stops signing.
    #[arg(long)]
    erase: bool,
}

/// Changes the key if requested, and prints the current one.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let key = arguments.key.as_deref().map(OwnKey::read).transpose()?;
    let counter = key.as_ref().map(|_| counter_or_seconds(arguments.counter)).transpose()?;
    let port = &arguments.port;
    let mut client = port.greet_transmitter()?;
    let seed = key.as_ref().map(OwnKey::seed);
    let request = match (&seed, counter) {
        (Some(seed), Some(counter)) => Request::WriteKey { seed: Seed(seed), counter },
        _ if arguments.erase => Request::EraseKey,
        _ => Request::ReadKey,
    };
    let found = ask(&mut client, &request)
        .map_err(|error| half_done(error, &request))
        .with_context(|| port.name())?;
    let (id, counter) = (found.map(|(id, _)| id.to_string()), found.map(|(_, counter)| counter));
    if shared.json {
        output::json(&json!({ "port": port.name(), "signer": id, "signer_counter": counter }))?;
    } else if let Some((id, counter)) = found {
        line(&format!("{}: signs with key {id}, the next counter is {counter}", port.name()))?;
    } else {
        line(&format!("{}: has no key, and signs no messages", port.name()))?;
    }
    Ok(Verdict::Yes)
}

/// The error, with the possible states after a change that may be incomplete.
fn half_done(error: DeviceError, request: &Request<'_>) -> anyhow::Error {
    const OPEN: &str = "the old key or the new one may be in use, and copies of the old one may remain: repeat the command";
    match (request, error) {
        (Request::ReadKey, error) => error.into(),
        (_, DeviceError::Refused(Refusal::Store)) => anyhow!("the transmitter's flash memory failed: {OPEN}"),
        (_, error @ (DeviceError::NoKey | DeviceError::Refused(_))) => error.into(),
        (_, error) => anyhow::Error::new(error).context(OPEN),
    }
}

/// The key in use and its next counter; none if there is no key, if it cannot be read, or if the firmware cannot sign.
pub fn in_use(client: &mut Connection) -> Result<Option<(KeyId, u32)>, DeviceError> {
    match ask(client, &Request::ReadKey) {
        Err(DeviceError::NoKey | DeviceError::Refused(Refusal::NoSigning | Refusal::Store)) => Ok(None),
        outcome => outcome,
    }
}

fn ask(client: &mut Connection, request: &Request<'_>) -> Result<Option<(KeyId, u32)>, DeviceError> {
    let outcome = client.ask(request, |answer| match answer {
        Answer::Key { id, counter } => Some(id.map(|id| (KeyId(id.to_be_bytes()), counter))),
        _ => None,
    });
    outcome.map_err(|error| error.if_unknown(DeviceError::NoKey))
}
