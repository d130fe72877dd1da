//! The requests about the key that signs. Feature `signing`.

use link::serial::{Answer, Refusal, Request};

use crate::store::Memory;

/// Does what a request asks of the key, and says which there is then.
pub fn act(request: Request<'_>, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    match request {
        Request::WriteKey { seed, counter } => {
            let seed = seed.0.try_into().ok().filter(|seed| *seed != [0; 32]);
            memory.save_key(seed.ok_or(Refusal::Seed)?, counter)?;
        }
        Request::EraseKey => memory.erase_key()?,
        _ => {}
    }
    let key = memory.key()?;
    Ok(Answer::Key {
        id: key.map(|(id, _)| u32::from_be_bytes(id.0)),
        counter: key.map_or(0, |(_, counter)| counter),
    })
}
