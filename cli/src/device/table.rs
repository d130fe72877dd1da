//! Transfers tables to and from a transmitter.

use std::io::{Read, Write};

use link::checksum::crc32c;
use link::l2a_table::L2aTable;
use link::serial::{Answer, Refusal, Request};

use super::{Client, DeviceError};

/// Maximum number of attempts.
const ATTEMPTS: u32 = 5;

/// Writes a table: the transmitter stores it, uses it, and returns the same bytes. Calls `progress` with the bytes written so far.
///
/// # Errors
/// [`DeviceError`]; the transmitter then has either the previous table or this one in full.
pub fn push<P: Read + Write>(client: &mut Client<P>, table: &L2aTable, mut progress: impl FnMut(usize)) -> Result<(), DeviceError> {
    let (image, crc) = (table.image(), table.crc());
    let mut last = String::new();
    for _ in 0..ATTEMPTS {
        match stage(client, image, crc, &mut progress)
            .and_then(|()| commit(client, crc))
            .and_then(|()| pull(client))
        {
            Ok(found) if found == *table => return Ok(()),
            Ok(_) => last = "another table came back".into(),
            Err(DeviceError::Refused(refusal)) if is_passing(refusal) => last = refusal.to_string(),
            Err(error) => return Err(error),
        }
    }
    Err(DeviceError::Table { attempts: ATTEMPTS, last })
}

/// Whether a restart of the transfer may succeed: the transmitter restarted, or another client wrote at the same time.
fn is_passing(refusal: Refusal) -> bool {
    matches!(
        refusal,
        Refusal::NotBegun | Refusal::Offset { .. } | Refusal::Incomplete { .. } | Refusal::TableCrc { .. }
    )
}

fn stage<P: Read + Write>(client: &mut Client<P>, image: &[u8], crc: u32, progress: &mut impl FnMut(usize)) -> Result<(), DeviceError> {
    let staged = |answer: Answer<'_>| match answer {
        Answer::Staged { received } => Some(usize::from(received)),
        _ => None,
    };
    let length = image.len() as u16;
    let mut received = client.ask(&Request::BeginTable { length, crc }, staged)?;
    while let Some(rest @ [_, ..]) = image.get(received..) {
        let bytes = &rest[..rest.len().min(client.identity().chunk_max)];
        let offset = received as u16;
        let after = client.ask(&Request::WriteTable { offset, bytes }, staged)?;
        if after <= received {
            return Err(DeviceError::Unexpected);
        }
        received = after;
        progress(received);
    }
    Ok(())
}

fn commit<P: Read + Write>(client: &mut Client<P>, crc: u32) -> Result<(), DeviceError> {
    let committed = |answer: Answer<'_>| (answer == Answer::Committed { crc }).then_some(());
    client.ask(&Request::CommitTable { crc }, committed)
}

/// Reads the current table.
///
/// # Errors
/// [`DeviceError`] if the table does not arrive in full.
pub fn pull<P: Read + Write>(client: &mut Client<P>) -> Result<L2aTable, DeviceError> {
    let mut image: Vec<u8> = Vec::new();
    let mut of = None;
    for _ in 0..ATTEMPTS * u32::from(u8::MAX) {
        let offset = image.len() as u16;
        let (length, crc, bytes) = client.ask(&Request::ReadTable { offset }, |answer| match answer {
            Answer::Table(part) if part.offset == offset => Some((part.length, part.crc, part.bytes.to_vec())),
            _ => None,
        })?;
        if *of.get_or_insert((length, crc)) != (length, crc) {
            // The table changed during the transfer.
            (image, of) = (Vec::new(), None);
            continue;
        }
        if bytes.is_empty() {
            return Err(DeviceError::Unexpected);
        }
        image.extend(bytes);
        if image.len() >= usize::from(length) {
            return if crc32c(&[&image]) == crc {
                Ok(L2aTable::from_image(&image)?)
            } else {
                Err(DeviceError::Unexpected)
            };
        }
    }
    Err(DeviceError::Unexpected)
}
