//! Storage in flash memory of the table, the calibration, the symbol rate with its carrier, the intensity limit, the signing key and the
//! lock. A power cut loses nothing.
//!
//! All of them together are one record, and each save writes a whole one after the earlier ones:
//!
//! | bytes | content |
//! |---|---|
//! | 1 | the format: records of other formats are not read |
//! | 4 | a sequence number: that of the last record, plus one for each place after it |
//! | 1015 | the items, each at its place: its length in 2 bytes, and room for its greatest number of bytes; FF if there is none |
//! | 4 | CRC-32C of all before it |
//!
//! The valid record with the greatest number is the current one. It is never overwritten, and a save erases at most one unit, the next one,
//! if the current one is full; a change of the key erases all others. Records are at fixed places, so a torn one is skipped, wherever it
//! was cut. A power cut leaves the old value or the new one, and later saves are found. A test cuts the power at every byte: `cargo test -p
//! vocc-tx-firmware --test power_cut`.
//!
//! Earlier records, of format 1, have 512 bytes and the same items without the lock. They are read if there is no later one.
//!
//! A memory with other content is overwritten unit by unit, as records reach it.
//!
//! The flash is any implementation of the blocking traits of [`embedded_storage`]. Two erase units suffice; with more, each is erased less
//! often.
//!
//! ```
//! # mod flash { include!("../tests/flash/mod.rs"); }
//! # use flash::Flash;
//! use link::l2a_table::L2aTable;
//! use tx_firmware::store::{Memory, Store};
//!
//! let mut store = Store::new(Flash::<4>::new(), 0..8192)?;
//! assert_eq!(store.table(), Ok(None));
//! store.save_table(&L2aTable::default())?;
//! assert_eq!(store.table(), Ok(Some(L2aTable::default())));
//! # Ok::<(), tx_firmware::store::StoreError>(())
//! ```

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;
use link::{
    checksum::crc32c,
    framing::{KeyId, Signature},
    intensity::IntensityLimit,
    l2a_table::{L2aTable, image::IMAGE_MAX},
    serial::{Faults, Measured},
    symbol_rate::SymbolRate,
    waveform::{SymbolTiming, Waveform},
};
use thiserror::Error;

use crate::calibration::Calibration;
use crate::matrix::LedMatrix;
use crate::program::ProgramHash;

#[cfg(feature = "signing")]
mod lock;
#[cfg(feature = "signing")]
mod signing;
#[cfg(feature = "signing")]
pub use signing::RESERVED;

/// Bytes of a record: a multiple of any flash's words.
const RECORD: usize = 1024;
type Record = [u8; RECORD];
const BLANK: Record = [0xff; RECORD];

const FORMAT_AT: usize = 0;
const NUMBER: Range<usize> = 1..5;
const TABLE: Range<usize> = item(NUMBER.end, IMAGE_MAX);
const CALIBRATION: Range<usize> = item(TABLE.end, 64);
const SYMBOL_TIMING: Range<usize> = item(CALIBRATION.end, 4);
const INTENSITY_LIMIT: Range<usize> = item(SYMBOL_TIMING.end, 8);
/// The item of a transmitter with signing; others leave it unchanged.
const SIGNING_KEY: Range<usize> = item(INTENSITY_LIMIT.end, 68);
/// The item of a transmitter with signing, too.
const LOCK: Range<usize> = item(SIGNING_KEY.end, 45);
const CRC_AT: usize = RECORD - 4;
const _: () = assert!(LOCK.end <= CRC_AT);

/// The format of a record.
const FORMAT: u8 = 2;
/// The earlier format, whose records end before the lock.
const EARLIER_FORMAT: u8 = 1;
const EARLIER_RECORD: usize = 512;
const _: () = assert!(SIGNING_KEY.end <= EARLIER_RECORD - 4);
/// The bits of a symbol rate; the carrier's cycles are above them, 0 for still panels.
const CYCLES_SHIFT: u32 = 20;
const _: () = assert!(SymbolRate::MAX.millihertz() < 1 << CYCLES_SHIFT && (Waveform::MAX_CYCLES as u32) < 1 << (32 - CYCLES_SHIFT));

/// Why an access to the flash memory failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StoreError {
    /// The addresses do not suit a store.
    #[error("the flash from {start:#x} to {end:#x} is not a place for a store: give 2 or more whole erase units")]
    Addresses {
        /// Its first address.
        start: u32,
        /// The address after its last.
        end: u32,
    },
    /// The flash memory reported an error.
    #[error("the flash memory failed: the old value stays in use; try again")]
    Flash,
    /// A stored value is invalid.
    #[error("the content of the flash memory is damaged or not a store's: write it again")]
    Damaged,
    /// The memory does not support signing.
    #[error("this firmware signs no messages: build it with the feature `signing`")]
    NoSigning,
    /// The counter of the key's signatures is exhausted.
    #[error("the key has used all its counters: store a new key")]
    NoCounter,
    /// The memory does not support locks.
    #[error("this firmware has no lock: build it with the feature `signing`")]
    NoLock,
}

/// Why a permit was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PermitError {
    /// The memory failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// It is for another challenge, and was not verified.
    #[error("the permit is for another challenge: read the lock, and make a new one")]
    Challenge,
    /// Its signature is not that of the lock's key.
    #[error("the permit is wrong: the next one is verified in {wait_s} s")]
    Wrong {
        /// Seconds until the next one is verified.
        wait_s: u16,
    },
    /// It was not verified, because too many before it were wrong.
    #[error("too many permits were wrong: the next one is verified in {wait_s} s")]
    Wait {
        /// Seconds until the next one is verified.
        wait_s: u16,
    },
}

/// The state of a lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LockState {
    /// The random salt from which, with the PIN, its key is derived.
    pub salt: u64,
    /// The number that the next permit contains.
    pub challenge: u32,
    /// Seconds until the next permit is verified.
    pub wait_s: u16,
}

/// A permit for one request.
#[derive(Clone, Copy, Debug)]
pub struct Permit<'a> {
    /// The challenge that it answers.
    pub challenge: u32,
    /// Its signature.
    pub signature: &'a [u8; 64],
    /// The sequence number of the request.
    pub sequence: u32,
    /// The body of the request.
    pub body: &'a [u8],
}

/// The persistent memory of a transmitter.
pub trait Memory {
    /// Replaces the stored table: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is then still there.
    fn save_table(&mut self, table: &L2aTable) -> Result<(), StoreError>;

    /// Replaces the stored calibration: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is then still there.
    fn save_calibration(&mut self, calibration: &Calibration) -> Result<(), StoreError>;

    /// Replaces the stored timing: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is then still there.
    fn save_timing(&mut self, timing: SymbolTiming) -> Result<(), StoreError>;

    /// Replaces the stored limit, or removes it: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is then still there.
    fn save_intensity_limit(&mut self, limit: Option<IntensityLimit>) -> Result<(), StoreError>;

    /// The name of the signing key, and the counter of its next signature; `None` without a key.
    ///
    /// # Errors
    /// [`StoreError::NoSigning`] if this memory does not support signing; others if it cannot be read.
    fn key(&mut self) -> Result<Option<(KeyId, u32)>, StoreError> {
        Err(StoreError::NoSigning)
    }

    /// Stores the key of this seed, and erases every trace of the old one. Its first signature has this counter. If the key is already
    /// stored, the greater of this and the next counter applies.
    ///
    /// # Errors
    /// [`StoreError`]; then either key is stored, and traces of the old one may remain: call it again.
    fn save_key(&mut self, _seed: [u8; 32], _counter: u32) -> Result<(), StoreError> {
        Err(StoreError::NoSigning)
    }

    /// Erases every trace of the key.
    ///
    /// # Errors
    /// As [`save_key`](Self::save_key).
    fn erase_key(&mut self) -> Result<(), StoreError> {
        Err(StoreError::NoSigning)
    }

    /// Signs a message; `None` without a key. No two signatures of a key have the same counter, even after a power cut.
    ///
    /// # Errors
    /// [`StoreError`]; then nothing was signed.
    fn sign(&mut self, _message: &[u8]) -> Result<Option<Signature>, StoreError> {
        Ok(None)
    }

    /// The lock at this time since the start; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError::NoLock`] if this memory does not support locks; others if it cannot be read.
    fn lock(&mut self, _uptime_s: u32) -> Result<Option<LockState>, StoreError> {
        Err(StoreError::NoLock)
    }

    /// Replaces the lock by one with this public key, which is valid, and this salt, or removes it: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the old one is then still there.
    fn save_lock(&mut self, _lock: Option<([u8; 32], u64)>) -> Result<(), StoreError> {
        Err(StoreError::NoLock)
    }

    /// Verifies a permit. The attempt is stored first, so that a power cut does not undo it. Its challenge is never used again, even after
    /// a power cut. Without a lock, everything is permitted.
    ///
    /// # Errors
    /// [`PermitError`]; then the request is not permitted.
    fn permit(&mut self, _permit: &Permit<'_>, _uptime_s: u32) -> Result<(), PermitError> {
        Ok(())
    }

    /// The hash of the program that runs; `None` if this memory does not hold it, or cannot be read.
    fn program_hash(&mut self) -> Option<ProgramHash> {
        None
    }
}

/// The settings at the start of a transmitter with certain LEDs.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembered {
    /// The stored calibration, or a typical one, with the stored intensity limit.
    pub calibration: Calibration,
    /// The stored table, or the shipped one.
    pub table: L2aTable,
    /// The stored symbol rate and carrier, or the default of these LEDs.
    pub timing: SymbolTiming,
    /// Faults for values that are missing or unreadable.
    pub faults: Faults,
}

/// A store in a part of a flash memory.
pub struct Store<F: NorFlash> {
    flash: F,
    addresses: Range<u32>,
    /// The content of the memory, once it was read or saved.
    found: Option<Found>,
    /// The current record, or a blank one.
    record: Record,
    /// The addresses of the program, if it is in the same flash.
    program: Range<u32>,
    /// Its hash, once it was computed.
    program_hash: Option<ProgramHash>,
    /// Reserved counters of signatures that are not used yet.
    #[cfg(feature = "signing")]
    reserved: Range<u32>,
    /// The unlock attempts since the start.
    #[cfg(feature = "signing")]
    tries: lock::Tries,
}

/// The content of a flash memory.
#[derive(Clone, Copy, Debug)]
enum Found {
    /// Nothing, or records of another format.
    Nothing,
    /// Content that no store has written.
    Foreign,
    /// The current record is at this address.
    Record(u32),
}

impl<F: NorFlash> Store<F> {
    /// A store in the addresses `addresses` of `flash`: two or more whole erase units. Reads nothing yet.
    ///
    /// # Errors
    /// [`StoreError::Addresses`] if they are not whole units, or fewer than two.
    pub fn new(flash: F, addresses: Range<u32>) -> Result<Self, StoreError> {
        const { assert!(F::ERASE_SIZE.is_multiple_of(RECORD) && RECORD.is_multiple_of(F::WRITE_SIZE) && RECORD.is_multiple_of(F::READ_SIZE)) };
        let (start, end) = (addresses.start, addresses.end);
        let unit = F::ERASE_SIZE as u32;
        let is_whole = start.is_multiple_of(unit) && end.is_multiple_of(unit);
        if !is_whole || end.saturating_sub(start) < 2 * unit {
            return Err(StoreError::Addresses { start, end });
        }
        Ok(Self {
            flash,
            addresses,
            found: None,
            record: BLANK,
            program: 0..0,
            program_hash: None,
            #[cfg(feature = "signing")]
            reserved: 0..0,
            #[cfg(feature = "signing")]
            tries: lock::Tries::NONE,
        })
    }

    /// This store, in a flash that holds the running program at `addresses`.
    #[must_use]
    pub fn beside_program(self, addresses: Range<u32>) -> Self {
        Self {
            program: addresses,
            ..self
        }
    }

    /// The last saved table; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError`] if the flash cannot be read, or holds damaged values.
    pub fn table(&mut self) -> Result<Option<L2aTable>, StoreError> {
        self.load(TABLE)?
            .map(|image| L2aTable::from_image(image).map_err(|_| StoreError::Damaged))
            .transpose()
    }

    /// The last saved calibration, without a limit; `None` if there is none.
    ///
    /// # Errors
    /// As [`Self::table`].
    pub fn calibration(&mut self) -> Result<Option<Calibration>, StoreError> {
        self.load(CALIBRATION)?
            .map(|bytes| {
                let measured: Measured = postcard::from_bytes(bytes).map_err(|_| StoreError::Damaged)?;
                Calibration::new(measured).map_err(|_| StoreError::Damaged)
            })
            .transpose()
    }

    /// The last saved symbol rate and carrier; `None` if there are none.
    ///
    /// # Errors
    /// As [`Self::table`].
    pub fn timing(&mut self) -> Result<Option<SymbolTiming>, StoreError> {
        self.load(SYMBOL_TIMING)?
            .map(|bytes| {
                let word = u32::from_le_bytes(bytes.try_into().map_err(|_| StoreError::Damaged)?);
                let rate = SymbolRate::from_millihertz(word % (1 << CYCLES_SHIFT)).map_err(|_| StoreError::Damaged)?;
                let waveform = Waveform::new(word >> CYCLES_SHIFT).map_err(|_| StoreError::Damaged)?;
                SymbolTiming::new(rate, waveform).map_err(|_| StoreError::Damaged)
            })
            .transpose()
    }

    /// The last saved limit of the luminous intensity; `None` if there is none.
    ///
    /// # Errors
    /// As [`Self::table`].
    pub fn intensity_limit(&mut self) -> Result<Option<IntensityLimit>, StoreError> {
        let Some(bytes) = self.load(INTENSITY_LIMIT)? else {
            return Ok(None);
        };
        let bytes: [u8; 8] = bytes.try_into().map_err(|_| StoreError::Damaged)?;
        let [a, b, c, d, e, f, g, h] = bytes;
        let numbers = [[a, b, c, d], [e, f, g, h]].map(u32::from_le_bytes);
        IntensityLimit::from_numbers(numbers).map_err(|_| StoreError::Damaged)
    }

    /// All last saved values for these LEDs, with `typical` in place of a missing calibration. LEDs that show no carrier keep only the rate of
    /// one: the program before may have driven others.
    pub fn remembered<M: LedMatrix>(&mut self, typical: Calibration) -> Remembered {
        let mut faults = Faults::empty();
        let calibration = readable(self.calibration(), &mut faults);
        let table = readable(self.table(), &mut faults);
        let timing = readable(self.timing(), &mut faults).unwrap_or(M::DEFAULT_TIMING);
        let limit = readable(self.intensity_limit(), &mut faults);
        faults.set(Faults::NO_CALIBRATION, calibration.is_none());
        faults.set(Faults::NO_TABLE, table.is_none());
        Remembered {
            calibration: calibration.unwrap_or(typical).limited_to(limit),
            table: table.unwrap_or_else(L2aTable::shipped),
            timing: if M::SHOWS_CARRIER {
                timing
            } else {
                SymbolTiming::still(timing.rate())
            },
            faults,
        }
    }

    /// Returns the flash.
    pub fn release(self) -> F {
        self.flash
    }

    /// An item of the current record.
    fn load(&mut self, item: Range<usize>) -> Result<Option<&[u8]>, StoreError> {
        if let Found::Foreign = self.find()? {
            return Err(StoreError::Damaged);
        }
        let (length, value) = self.record[item].split_first_chunk().unwrap_or((&[0xff; 2], &[]));
        Ok(value.get(..u16::from_le_bytes(*length).into()))
    }

    /// Writes the current record with this item as the next record.
    fn save(&mut self, item: Range<usize>, value: &[u8]) -> Result<(), StoreError> {
        self.save_or_remove(item, Some(value))
    }

    /// Writes the current record with this item, or without it, as the next record.
    fn save_or_remove(&mut self, item: Range<usize>, value: Option<&[u8]>) -> Result<(), StoreError> {
        let found = self.find()?;
        let address = self.blank_place(found)?;
        self.write(found, address, item, value)
    }

    /// Writes the current record with this item, or without it, to this address.
    fn write(&mut self, found: Found, address: u32, item: Range<usize>, value: Option<&[u8]>) -> Result<(), StoreError> {
        let mut record = self.record;
        // A torn record in between may read as valid another time: it is then older than this one.
        let number = match found {
            Found::Record(last) => number(&record).wrapping_add(self.places_on(last, address)),
            Found::Nothing | Found::Foreign => 0,
        };
        record[FORMAT_AT] = FORMAT;
        record[NUMBER].copy_from_slice(&number.to_le_bytes());
        match value {
            Some(value) => {
                let length = (value.len() as u16).to_le_bytes();
                for (place, byte) in record[item].iter_mut().zip(length.iter().chain(value)) {
                    *place = *byte;
                }
            }
            None => record[item].fill(0xff),
        }
        let crc = crc_of(&record);
        record[CRC_AT..].copy_from_slice(&crc);
        self.flash.write(address, &record).map_err(|_| StoreError::Flash)?;
        if self.read(address)? != record {
            return Err(StoreError::Flash);
        }
        self.record = record;
        self.found = Some(Found::Record(address));
        Ok(())
    }

    /// The first blank place in the rest of the current record's unit; without one, the first place of the next unit, which is erased.
    fn blank_place(&mut self, found: Found) -> Result<u32, StoreError> {
        let mut address = self.addresses.start;
        if let Found::Record(last) = found {
            address = self.next(last);
        }
        let unit = F::ERASE_SIZE as u32;
        while !address.is_multiple_of(unit) {
            if self.read(address)? == BLANK {
                return Ok(address);
            }
            address = self.next(address);
        }
        self.erase_unit(address)?;
        Ok(address)
    }

    fn erase_unit(&mut self, address: u32) -> Result<(), StoreError> {
        let end = address + F::ERASE_SIZE as u32;
        self.flash.erase(address, end).map_err(|_| StoreError::Flash)
    }

    /// The number of places from `from` to `to`.
    fn places_on(&self, from: u32, to: u32) -> u32 {
        let Range { start, end } = self.addresses;
        let bytes = if to > from { to - from } else { end - start - (from - to) };
        bytes / RECORD as u32
    }

    fn next(&self, address: u32) -> u32 {
        match address + RECORD as u32 {
            next if next == self.addresses.end => self.addresses.start,
            next => next,
        }
    }

    /// Finds the current record, on the first call.
    fn find(&mut self) -> Result<Found, StoreError> {
        if let Some(found) = self.found {
            return Ok(found);
        }
        let (mut is_foreign, mut is_other_format, mut newest, mut is_earlier) = (false, false, None, false);
        for address in self.addresses.clone().step_by(RECORD) {
            let record = self.read(address)?;
            if record == BLANK {
                continue;
            }
            if let Some(earlier) = earlier_record(&record) {
                // A record of the present format counts, whatever its number.
                let counts = newest.is_none() || is_earlier && is_newer(&earlier, &self.record);
                if counts {
                    (newest, is_earlier) = (Some(address), true);
                    self.record = earlier;
                }
            } else if record[CRC_AT..] != crc_of(&record) {
                // In the first unit it may be the first record of all, torn.
                is_foreign |= address >= self.addresses.start + F::ERASE_SIZE as u32;
            } else if record[FORMAT_AT] != FORMAT {
                is_other_format = true;
            } else if newest.is_none() || is_earlier || is_newer(&record, &self.record) {
                (newest, is_earlier) = (Some(address), false);
                self.record = record;
            }
        }
        let found = match newest {
            Some(address) => Found::Record(address),
            None if is_foreign && !is_other_format => Found::Foreign,
            None => Found::Nothing,
        };
        self.found = Some(found);
        Ok(found)
    }

    fn read(&mut self, address: u32) -> Result<Record, StoreError> {
        let mut record = BLANK;
        self.flash.read(address, &mut record).map_err(|_| StoreError::Flash)?;
        Ok(record)
    }
}

impl<F: NorFlash> Memory for Store<F> {
    fn save_table(&mut self, table: &L2aTable) -> Result<(), StoreError> {
        self.save(TABLE, table.image())
    }

    fn save_calibration(&mut self, calibration: &Calibration) -> Result<(), StoreError> {
        let mut bytes = [0; 64];
        let bytes = postcard::to_slice(calibration.measured(), &mut bytes).map_err(|_| StoreError::Damaged)?;
        self.save(CALIBRATION, bytes)
    }

    fn save_timing(&mut self, timing: SymbolTiming) -> Result<(), StoreError> {
        let cycles = u32::from(timing.waveform().cycles());
        let word = cycles << CYCLES_SHIFT | timing.rate().millihertz();
        self.save(SYMBOL_TIMING, &word.to_le_bytes())
    }

    fn save_intensity_limit(&mut self, limit: Option<IntensityLimit>) -> Result<(), StoreError> {
        let numbers = IntensityLimit::numbers(limit);
        self.save(INTENSITY_LIMIT, numbers.map(u32::to_le_bytes).as_flattened())
    }

    #[cfg(feature = "signing")]
    fn key(&mut self) -> Result<Option<(KeyId, u32)>, StoreError> {
        self.key_in_use()
    }

    #[cfg(feature = "signing")]
    fn save_key(&mut self, seed: [u8; 32], counter: u32) -> Result<(), StoreError> {
        self.replace_key(seed, counter)
    }

    #[cfg(feature = "signing")]
    fn erase_key(&mut self) -> Result<(), StoreError> {
        self.remove_key()
    }

    #[cfg(feature = "signing")]
    fn sign(&mut self, message: &[u8]) -> Result<Option<Signature>, StoreError> {
        self.signature(message)
    }

    #[cfg(feature = "signing")]
    fn lock(&mut self, uptime_s: u32) -> Result<Option<LockState>, StoreError> {
        self.lock_in_use(uptime_s)
    }

    #[cfg(feature = "signing")]
    fn save_lock(&mut self, lock: Option<([u8; 32], u64)>) -> Result<(), StoreError> {
        self.replace_lock(lock)
    }

    #[cfg(feature = "signing")]
    fn permit(&mut self, permit: &Permit<'_>, uptime_s: u32) -> Result<(), PermitError> {
        self.verify_permit(permit, uptime_s)
    }

    fn program_hash(&mut self) -> Option<ProgramHash> {
        if self.program_hash.is_none() && !self.program.is_empty() {
            self.program_hash = ProgramHash::read(&mut self.flash, self.program.clone()).ok();
        }
        self.program_hash
    }
}

/// The value, or `None` and a fault if it cannot be read.
fn readable<T>(found: Result<Option<T>, StoreError>, faults: &mut Faults) -> Option<T> {
    found.unwrap_or_else(|_error| {
        #[cfg(feature = "defmt")]
        defmt::error!("store: {}", _error);
        faults.insert(Faults::STORE);
        None
    })
}

/// The newest record of the earlier format in these bytes, with the present layout.
fn earlier_record(bytes: &Record) -> Option<Record> {
    let (halves, _) = bytes.as_chunks::<EARLIER_RECORD>();
    let valid = halves.iter().filter_map(|half| {
        let (content, crc) = half.split_last_chunk()?;
        let is_valid = half[FORMAT_AT] == EARLIER_FORMAT && *crc == crc32c(&[content]).to_le_bytes();
        is_valid.then(|| {
            let mut record = BLANK;
            record[..SIGNING_KEY.end].copy_from_slice(&half[..SIGNING_KEY.end]);
            record
        })
    });
    valid.reduce(|one, other| if is_newer(&other, &one) { other } else { one })
}

fn is_newer(record: &Record, than: &Record) -> bool {
    number(record).wrapping_sub(number(than)).cast_signed() > 0
}

fn number(record: &Record) -> u32 {
    let [_, a, b, c, d, ..] = *record;
    u32::from_le_bytes([a, b, c, d])
}

fn crc_of(record: &Record) -> [u8; 4] {
    crc32c(&[&record[..CRC_AT]]).to_le_bytes()
}

/// The place of an item after another: its length, and at most `most` bytes.
const fn item(behind: usize, most: usize) -> Range<usize> {
    behind..behind + 2 + most
}
