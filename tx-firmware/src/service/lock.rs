//! The requests about the lock, and permits for others. Feature `signing`.

use link::serial::{Answer, Frame, Refusal, Request};
use link::signing::PublicKey;

use crate::store::{Memory, Permit, PermitError, StoreError};
use crate::transmitter::Transmitter;

use super::{Conversation, Device};

/// One port's permits.
#[derive(Debug)]
pub struct Permits {
    /// The last challenge and signature, for the next request that changes something.
    next: Option<(u32, [u8; 64])>,
    /// The number and the outcome of the last executed request: it may be repeated, although its permit is used up.
    last: Option<(u32, Result<Answer<'static>, Refusal>)>,
}

impl Permits {
    pub const NONE: Self = Self { next: None, last: None };

    /// Keeps a permit for the next request.
    pub fn announce(&mut self, challenge: u32, signature: &[u8]) -> Result<Answer<'static>, Refusal> {
        let signature = signature.try_into().map_err(|_| Refusal::Locked)?;
        self.next = Some((challenge, signature));
        Ok(Answer::Done)
    }
}

impl Conversation {
    /// Executes a request if the ports are open, if it changes nothing, or if it has a permit.
    pub fn act_if_permitted(
        &mut self,
        frame: &Frame<'_>,
        request: Request<'_>,
        device: &mut impl Device,
        memory: &mut impl Memory,
    ) -> Result<Answer<'static>, Refusal> {
        let sequence = frame.sequence();
        if !request.changes() {
            return self.act(sequence, request, device, memory);
        }
        let uptime_s = uptime_s(device);
        if is_locked(memory, uptime_s)? {
            if let Some((last, outcome)) = self.permits.last
                && last == sequence
            {
                return outcome;
            }
            let (challenge, signature) = self.permits.next.take().ok_or(Refusal::Locked)?;
            let permit = Permit {
                challenge,
                signature: &signature,
                sequence,
                body: frame.body(),
            };
            memory.permit(&permit, uptime_s)?;
        }
        let outcome = self.act(sequence, request, device, memory);
        self.permits.last = Some((sequence, outcome));
        outcome
    }
}

/// A memory that cannot be read may be locked.
fn is_locked(memory: &mut impl Memory, uptime_s: u32) -> Result<bool, StoreError> {
    match memory.lock(uptime_s) {
        Err(StoreError::NoLock) => Ok(false),
        lock => lock.map(|lock| lock.is_some()),
    }
}

/// Executes a request about the lock, and returns the state of the lock.
pub fn act(request: Request<'_>, device: &mut impl Device, memory: &mut impl Memory) -> Result<Answer<'static>, Refusal> {
    match request {
        Request::WriteLock { key, salt } => {
            let key: [u8; 32] = key.try_into().map_err(|_| Refusal::LockKey)?;
            PublicKey::from_bytes(key).map_err(|_| Refusal::LockKey)?;
            memory.save_lock(Some((key, salt)))?;
        }
        Request::RemoveLock => memory.save_lock(None)?,
        _ => {}
    }
    let lock = memory.lock(uptime_s(device))?;
    Ok(Answer::Lock {
        salt: lock.map(|lock| lock.salt),
        challenge: lock.map_or(0, |lock| lock.challenge),
        wait_s: lock.map_or(0, |lock| lock.wait_s),
    })
}

fn uptime_s(device: &impl Device) -> u32 {
    device.read(Transmitter::status).uptime_s
}

impl From<PermitError> for Refusal {
    fn from(error: PermitError) -> Self {
        match error {
            PermitError::Store(error) => error.into(),
            PermitError::Challenge => Self::Locked,
            PermitError::Wrong { wait_s } => Self::WrongPermit { wait_s },
            PermitError::Wait { wait_s } => Self::Wait { wait_s },
        }
    }
}
