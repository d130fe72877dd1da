//! `vocc device hello`: the identity of a board, and whether it runs the program in a file.

use std::path::PathBuf;

use anyhow::Context;
use link::serial::{Answer, Request, SCHEMA};
use reception::bytes::hex;
use serde_json::json;
use tx_firmware::program::ProgramHash;

use crate::device::{DeviceError, program_file};
use crate::options::{Connection, Port, SharedOptions};
use crate::output::{self, Verdict, line};

/// Arguments of `vocc device hello`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    port: Option<Port>,
    /// Compare the board's program with that of an ELF file, such as a released one; exit status 1 if it is another.
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Print the hash of the file's program, without a board.
    #[arg(long, requires = "image", conflicts_with = "port")]
    no_board: bool,
}

/// Prints a board's identity, the hash of its program and of that in a file.
pub fn run(arguments: &Arguments, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let file = match &arguments.image {
        Some(path) => {
            let name = path.display().to_string();
            let hash = program_file::hash(path).with_context(|| name.clone())?;
            Some((name, hash))
        }
        None => None,
    };
    match (&arguments.port, file) {
        (Some(port), file) => greet(port, file, shared),
        (None, Some((name, hash))) => {
            match shared.json {
                true => output::json(&json!({ "file_bytes": hash.length, "file_sha256": hex(&hash.sha256) }))?,
                false => line(&format!("{name}: {}", words(&hash)))?,
            }
            Ok(Verdict::Yes)
        }
        (None, None) => anyhow::bail!("name the port with --port, or a file with --image"),
    }
}

fn greet(port: &Port, file: Option<(String, ProgramHash)>, shared: &SharedOptions) -> anyhow::Result<Verdict> {
    let mut client = port.greet()?;
    let identity = client.identity().clone();
    let found = program_hash(&mut client).with_context(|| port.name())?;
    let is_same = match &file {
        Some((_, hash)) => Some(found.ok_or(DeviceError::NoProgramHash).with_context(|| port.name())? == *hash),
        None => None,
    };
    if shared.json {
        output::json(&json!({
            "port": port.name(),
            "board": identity.board,
            "firmware": identity.firmware,
            "schema": format!("{:08x}", identity.schema),
            "program_bytes": found.map(|hash| hash.length),
            "program_sha256": found.map(|hash| hex(&hash.sha256)),
            "file_bytes": file.as_ref().map(|(_, hash)| hash.length),
            "file_sha256": file.as_ref().map(|(_, hash)| hex(&hash.sha256)),
            "same": is_same,
        }))?;
    } else {
        let program = found.as_ref().map_or_else(|| "not reported".into(), words);
        line(&format!(
            "{}: {}, firmware {}, program: {program}",
            port.name(),
            identity.board,
            identity.firmware
        ))?;
        if let (Some((name, hash)), Some(is_same)) = (&file, is_same) {
            match is_same {
                true => line(&format!("{name}: the board runs this program"))?,
                false => line(&format!("{name}: another program: {}", words(hash)))?,
            }
        }
    }
    Ok(if is_same == Some(false) { Verdict::No } else { Verdict::Yes })
}

/// The hash of the board's program; none if it is a receiver, or if its firmware does not know it.
fn program_hash(client: &mut Connection) -> Result<Option<ProgramHash>, DeviceError> {
    let identity = client.identity();
    if identity.is_receiver() || identity.schema != SCHEMA {
        return Ok(None);
    }
    let outcome = client.ask(&Request::ReadProgramHash, |answer| match answer {
        Answer::ProgramHash { length, sha256 } => Some(ProgramHash {
            length,
            sha256: sha256.try_into().ok()?,
        }),
        _ => None,
    });
    match outcome.map_err(|error| error.if_unknown(DeviceError::NoProgramHash)) {
        Err(DeviceError::NoProgramHash) => Ok(None),
        outcome => outcome.map(Some),
    }
}

fn words(hash: &ProgramHash) -> String {
    format!("{} bytes, SHA-256 {}", hash.length, hex(&hash.sha256))
}
