//! The signing key, and the counters of its signatures. Feature `signing`.
//!
//! The record holds the key and the first counter that is not reserved. A signature takes a counter that was reserved since the last start;
//! if there is none, a record first reserves the next [`RESERVED`]. A power cut loses the reserved counters, and no counter is used twice.
//!
//! An old record still holds its key. So a change or removal of the key starts a new unit, and all other units are erased.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use link::{
    framing::{KeyId, Signature},
    signing::{SECRET_BYTES, SecretKey},
};

use super::{BLANK, Found, RECORD, SIGNING_KEY, Store, StoreError};

/// Counters reserved by one record: a start loses at most this many, and one write serves this many signatures.
pub const RESERVED: u32 = 64;

/// Counter, 4 bytes, after the key.
const _: () = assert!(SIGNING_KEY.end - SIGNING_KEY.start == 2 + SECRET_BYTES + 4);

/// The key in the current record.
struct StoredKey {
    secret: SecretKey,
    /// The first counter that is not reserved.
    counter: u32,
}

impl StoredKey {
    fn to_bytes(&self) -> [u8; SECRET_BYTES + 4] {
        let mut bytes = [0; SECRET_BYTES + 4];
        let parts = self.secret.to_bytes().into_iter().chain(self.counter.to_le_bytes());
        bytes.iter_mut().zip(parts).for_each(|(to, from)| *to = from);
        bytes
    }
}

impl<F: NorFlash> Store<F> {
    pub(super) fn key_in_use(&mut self) -> Result<Option<(KeyId, u32)>, StoreError> {
        let next = self.reserved.clone().next();
        let key = self.stored_key()?;
        Ok(key.map(|key| (key.secret.public().id(), next.unwrap_or(key.counter))))
    }

    pub(super) fn replace_key(&mut self, seed: [u8; 32], counter: u32) -> Result<(), StoreError> {
        counter.checked_add(RESERVED).ok_or(StoreError::NoCounter)?;
        let secret = SecretKey::from_seed(seed).map_err(|_| StoreError::Damaged)?;
        let same = self.stored_key()?.filter(|old| old.secret.public() == secret.public());
        let key = StoredKey { secret, counter };
        match same {
            Some(old) if old.counter >= counter => {
                let Range { start, end } = self.reserved;
                self.reserved = start.max(counter).min(end)..end;
            }
            // Not in another unit: a torn record there may read as valid another time, and must be older than all later ones.
            Some(_) => {
                self.reserved = 0..0;
                self.save(SIGNING_KEY, &key.to_bytes())?;
            }
            None => self.save_alone(Some(&key.to_bytes()))?,
        }
        self.erase_others()
    }

    pub(super) fn remove_key(&mut self) -> Result<(), StoreError> {
        let is_without = matches!(self.find()?, Found::Record(_)) && self.stored_key()?.is_none();
        if !is_without {
            self.save_alone(None)?;
        }
        self.erase_others()
    }

    pub(super) fn signature(&mut self, message: &[u8]) -> Result<Option<Signature>, StoreError> {
        let Some(mut key) = self.stored_key()? else {
            return Ok(None);
        };
        if self.reserved.is_empty() {
            let first = key.counter;
            key.counter = first.checked_add(RESERVED).ok_or(StoreError::NoCounter)?;
            self.save(SIGNING_KEY, &key.to_bytes())?;
            self.reserved = first..key.counter;
        }
        let counter = self.reserved.next();
        Ok(counter.map(|counter| key.secret.sign(message, counter)))
    }

    fn stored_key(&mut self) -> Result<Option<StoredKey>, StoreError> {
        if let Found::Foreign = self.find()? {
            return Ok(None);
        }
        let Some(bytes) = self.load(SIGNING_KEY)? else {
            return Ok(None);
        };
        let (secret, counter) = bytes.split_first_chunk::<SECRET_BYTES>().ok_or(StoreError::Damaged)?;
        Ok(Some(StoredKey {
            secret: SecretKey::from_bytes(*secret),
            counter: u32::from_le_bytes(counter.try_into().map_err(|_| StoreError::Damaged)?),
        }))
    }

    /// Writes the current record with this key, or without one, at the start of the next erase unit.
    fn save_alone(&mut self, key: Option<&[u8]>) -> Result<(), StoreError> {
        let found = self.find()?;
        let Range { start, end } = self.addresses;
        let unit = F::ERASE_SIZE as u32;
        let address = match found {
            Found::Record(last) if last - last % unit + unit < end => last - last % unit + unit,
            Found::Record(_) | Found::Nothing | Found::Foreign => start,
        };
        self.erase_unit(address)?;
        self.reserved = 0..0;
        self.write(found, address, SIGNING_KEY, key)
    }

    /// Erases all non-blank units except that of the current record.
    fn erase_others(&mut self) -> Result<(), StoreError> {
        let Found::Record(counts) = self.find()? else {
            return Ok(());
        };
        let Range { start, end } = self.addresses;
        let unit = F::ERASE_SIZE as u32;
        for other in (start..end).step_by(F::ERASE_SIZE).filter(|&other| other != counts - counts % unit) {
            let mut is_used = false;
            for place in (other..other + unit).step_by(RECORD) {
                is_used = is_used || self.read(place)? != BLANK;
            }
            if is_used {
                self.erase_unit(other)?;
            }
        }
        Ok(())
    }
}
