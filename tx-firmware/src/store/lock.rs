//! The lock, and the attempts to open it. Feature `signing`.
//!
//! The record holds the public key, the salt, the first challenge that is not reserved, and the number of wrong permits in succession.
//! Challenges are reserved like the counters of signatures: [`RESERVED`] by one record, before the first of them is used.
//!
//! The record counts a permit as wrong until it is verified, so that neither a power cut nor a restart undoes an attempt. One wrong
//! attempt stays in the record while the right PIN is in use, which saves two records per permit.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use link::{lock::Challenge, signing::PublicKey};

use super::{Found, LOCK, LockState, Permit, PermitError, RESERVED, Store, StoreError};

/// Key, salt, challenge, wrong permits.
const BYTES: usize = 32 + 8 + 4 + 1;
const _: () = assert!(LOCK.end - LOCK.start == 2 + BYTES);

/// Successive wrong permits without a wait; each further one doubles the wait, from 1 s.
const FREE_TRIES: u8 = 3;
/// Longest wait for the next permit, s: a stranger's attempts cannot lock the owner out for longer.
const WAIT_MAX_S: u32 = 600;

/// The unlock attempts since the start.
#[derive(Debug)]
pub struct Tries {
    /// Reserved challenges that are not used yet.
    challenges: Range<u32>,
    /// Wrong permits in succession; `None` if there was no permit since the start.
    wrong: Option<u8>,
    /// Time of the last wrong one, or of the start.
    last_s: u32,
}

impl Tries {
    pub const NONE: Self = Self {
        challenges: 0..0,
        wrong: None,
        last_s: 0,
    };
}

/// The lock in the current record.
#[derive(Clone, Copy, PartialEq, Eq)]
struct StoredLock {
    key: [u8; 32],
    salt: u64,
    /// The first challenge that is not reserved.
    challenge: u32,
    /// Wrong permits in succession, at least.
    wrong: u8,
}

impl StoredLock {
    fn to_bytes(self) -> [u8; BYTES] {
        let mut bytes = [0; BYTES];
        let numbers = self.salt.to_le_bytes().into_iter().chain(self.challenge.to_le_bytes());
        let parts = self.key.into_iter().chain(numbers).chain([self.wrong]);
        bytes.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
        bytes
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&key, bytes) = bytes.split_first_chunk()?;
        let (&salt, bytes) = bytes.split_first_chunk()?;
        let (&challenge, bytes) = bytes.split_first_chunk()?;
        let &[wrong] = bytes else { return None };
        Some(Self {
            key,
            salt: u64::from_le_bytes(salt),
            challenge: u32::from_le_bytes(challenge),
            wrong,
        })
    }
}

impl<F: NorFlash> Store<F> {
    pub(super) fn lock_in_use(&mut self, uptime_s: u32) -> Result<Option<LockState>, StoreError> {
        Ok(self.stored_lock()?.map(|lock| LockState {
            salt: lock.salt,
            challenge: self.challenge(&lock),
            wait_s: self.wait_s(&lock, uptime_s),
        }))
    }

    pub(super) fn replace_lock(&mut self, lock: Option<([u8; 32], u64)>) -> Result<(), StoreError> {
        let old = self.stored_lock()?.map(|old| (old.key, old.salt));
        if old == lock {
            // The challenges continue.
            return Ok(());
        }
        let new = lock.map(|(key, salt)| {
            let lock = StoredLock {
                key,
                salt,
                challenge: 0,
                wrong: 0,
            };
            lock.to_bytes()
        });
        self.save_or_remove(LOCK, new.as_ref().map(|bytes| &bytes[..]))?;
        self.tries = Tries::NONE;
        Ok(())
    }

    pub(super) fn verify_permit(&mut self, permit: &Permit<'_>, uptime_s: u32) -> Result<(), PermitError> {
        let Some(mut lock) = self.stored_lock()? else {
            return Ok(());
        };
        let wait_s = self.wait_s(&lock, uptime_s);
        if wait_s > 0 {
            return Err(PermitError::Wait { wait_s });
        }
        let number = self.challenge(&lock);
        if permit.challenge != number {
            return Err(PermitError::Challenge);
        }
        let before = self.tries.wrong.unwrap_or(lock.wrong);
        let wrong = before.saturating_add(1);
        let is_reserved = !self.tries.challenges.is_empty();
        if !is_reserved || lock.wrong < wrong {
            if !is_reserved {
                lock.challenge = number.checked_add(RESERVED).ok_or(StoreError::NoCounter)?;
            }
            lock.wrong = wrong.max(lock.wrong);
            self.save(LOCK, &lock.to_bytes())?;
            if !is_reserved {
                self.tries.challenges = number..lock.challenge;
            }
        }
        self.tries.challenges.next();
        self.tries.wrong = Some(wrong);
        self.tries.last_s = uptime_s;
        let challenge = Challenge { salt: lock.salt, number };
        if !PublicKey::from_checked_bytes(lock.key).has_permitted(challenge, permit.sequence, permit.body, permit.signature) {
            return Err(PermitError::Wrong {
                wait_s: self.wait_s(&lock, uptime_s),
            });
        }
        self.tries.wrong = Some(0);
        if lock.wrong > 1 {
            lock.wrong = 1;
            self.save(LOCK, &lock.to_bytes())?;
        }
        Ok(())
    }

    fn stored_lock(&mut self) -> Result<Option<StoredLock>, StoreError> {
        if let Found::Foreign = self.find()? {
            return Ok(None);
        }
        self.load(LOCK)?
            .map(|bytes| StoredLock::from_bytes(bytes).ok_or(StoreError::Damaged))
            .transpose()
    }

    /// The number of the next challenge.
    fn challenge(&self, lock: &StoredLock) -> u32 {
        self.tries.challenges.clone().next().unwrap_or(lock.challenge)
    }

    /// Seconds until the next permit is verified.
    fn wait_s(&self, lock: &StoredLock, uptime_s: u32) -> u16 {
        let wrong = self.tries.wrong.unwrap_or(lock.wrong);
        let wait_s = match wrong.checked_sub(FREE_TRIES + 1) {
            None => 0,
            Some(doublings) => WAIT_MAX_S.min(1_u32.checked_shl(doublings.into()).unwrap_or(WAIT_MAX_S)),
        };
        (self.tries.last_s.saturating_add(wait_s)).saturating_sub(uptime_s) as u16
    }
}
