//! The requests about the key that signs. Feature `signing`.

use link::serial::{Answer, Refusal, Request};

use crate::store::Memory;
use crate::transmitter::Transmitter;

use super::Device;

/// Executes a request about the key, and returns the current key. Content that was not signed with this key is no longer shown.
pub fn act(request: Request<'_>, device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    let before = memory.key().ok().flatten().map(|(id, _)| id);
    match request {
        Request::WriteKey { seed, counter } => {
            let seed = seed.0.try_into().ok().filter(|seed| *seed != [0; 32]);
            memory.save_key(seed.ok_or(Refusal::Seed)?, counter)?;
        }
        Request::EraseKey => memory.erase_key()?,
        _ => {}
    }
    let key = memory.key()?;
    if key.map(|(id, _)| id) != before && device.read(Transmitter::is_sending) {
        device.change(Transmitter::stop);
    }
    Ok(Answer::Key {
        id: key.map(|(id, _)| u32::from_be_bytes(id.0)),
        counter: key.map_or(0, |(_, counter)| counter),
    })
}
