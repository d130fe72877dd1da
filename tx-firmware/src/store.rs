//! The table, the calibration, the symbol rate with its carrier, the intensity limit and the key that signs in flash memory, which lose
//! nothing when the power goes.
//!
//! All of them together are one record, and each save writes a whole one beside those before it:
//!
//! | bytes | what |
//! |---|---|
//! | 1 | the format: a record of another one is not read |
//! | 4 | a number: that of the record before, and one for each place from there on |
//! | 503 | the items, each at its place: its length in 2 bytes, and as many bytes as it may have at most; FF where there is none |
//! | 4 | CRC-32C of all before it |
//!
//! The whole record with the greatest number counts. It is never written to, and a save erases at most one unit, the next one, when this
//! one is full; a change of the key erases all others. Records stand at fixed places, so a torn one is left out, whatever was cut: a power
//! cut leaves the old value or the new, and what is saved after it is found. A test cuts the power at every byte: `cargo test -p
//! vocc-tx-firmware --test power_cut`.
//!
//! A memory that holds something else is taken over unit by unit, as the records reach it.
//!
//! The flash is anything that implements the blocking traits of [`embedded_storage`]. Two erase units of it are
//! enough; with more, each is erased more seldom.
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

#[cfg(feature = "signing")]
mod signing;
#[cfg(feature = "signing")]
pub use signing::RESERVED;

/// Bytes of a record: a multiple of any flash's words.
const RECORD: usize = 512;
type Record = [u8; RECORD];
const BLANK: Record = [0xff; RECORD];

const FORMAT_AT: usize = 0;
const NUMBER: Range<usize> = 1..5;
const TABLE: Range<usize> = item(NUMBER.end, IMAGE_MAX);
const CALIBRATION: Range<usize> = item(TABLE.end, 64);
const SYMBOL_TIMING: Range<usize> = item(CALIBRATION.end, 4);
const INTENSITY_LIMIT: Range<usize> = item(SYMBOL_TIMING.end, 8);
/// What a transmitter that signs keeps; others leave it as it is.
const SIGNING_KEY: Range<usize> = item(INTENSITY_LIMIT.end, 68);
const CRC_AT: usize = RECORD - 4;
const _: () = assert!(SIGNING_KEY.end <= CRC_AT);

/// The format of a record.
const FORMAT: u8 = 1;
/// The bits of a symbol rate; above them stand the carrier's cycles, which are 0 for panels that stand still.
const CYCLES_SHIFT: u32 = 20;
const _: () = assert!(SymbolRate::MAX.millihertz() < 1 << CYCLES_SHIFT && (Waveform::MAX_CYCLES as u32) < 1 << (32 - CYCLES_SHIFT));

/// Why the flash memory gave or took nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum StoreError {
    /// These addresses are none for a store.
    #[error("the flash from {start:#x} to {end:#x} is no place for a store: give 2 or more whole erase units")]
    Addresses {
        /// Its first address.
        start: u32,
        /// The address after its last.
        end: u32,
    },
    /// The flash memory reported an error.
    #[error("the flash memory failed: the old value stays in use; try again")]
    Flash,
    /// What is stored makes no sense.
    #[error("what the flash memory holds is damaged or no store's: write it again")]
    Damaged,
    /// There is no place for a key, or nothing that signs.
    #[error("this firmware signs no messages: build it with the feature `signing`")]
    NoSigning,
    /// The key's signatures have all been made.
    #[error("the key has no counter left to sign with: give it a new key")]
    NoCounter,
}

/// Where a transmitter keeps what it must not forget.
pub trait Memory {
    /// Keeps `table` in place of the one before: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the one before is then still there.
    fn save_table(&mut self, table: &L2aTable) -> Result<(), StoreError>;

    /// Keeps `calibration` in place of the one before: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the one before is then still there.
    fn save_calibration(&mut self, calibration: &Calibration) -> Result<(), StoreError>;

    /// Keeps `timing` in place of the one before: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the one before is then still there.
    fn save_timing(&mut self, timing: SymbolTiming) -> Result<(), StoreError>;

    /// Keeps `limit`, or that there is none, in place of the one before: wholly, or not at all.
    ///
    /// # Errors
    /// [`StoreError`]; the one before is then still there.
    fn save_intensity_limit(&mut self, limit: Option<IntensityLimit>) -> Result<(), StoreError>;

    /// The name of the key that signs, and the counter of its next signature; none where there is no key.
    ///
    /// # Errors
    /// [`StoreError::NoSigning`] where this memory keeps none; others when it cannot be read.
    fn key(&mut self) -> Result<Option<(KeyId, u32)>, StoreError> {
        Err(StoreError::NoSigning)
    }

    /// Keeps the key of this seed in place of the one before, whose every trace is erased. Its first signature has this counter; that of
    /// the key that is there already has the next one, where that is greater.
    ///
    /// # Errors
    /// [`StoreError`]; then the old key or the new is there, and traces of the old one may be: do it again.
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

    /// Signs a message; none where there is no key. No two signatures of a key have one counter, whenever the power goes.
    ///
    /// # Errors
    /// [`StoreError`]; then nothing was signed.
    fn sign(&mut self, _message: &[u8]) -> Result<Option<Signature>, StoreError> {
        Ok(None)
    }
}

/// What a transmitter starts with.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembered {
    /// The calibration that was saved, or a typical one, with the intensity limit that was saved.
    pub calibration: Calibration,
    /// The table that was saved, or the shipped one.
    pub table: L2aTable,
    /// The symbol rate and the carrier that were saved, or the default.
    pub timing: SymbolTiming,
    /// What was not there, or could not be read.
    pub faults: Faults,
}

/// A store in a part of a flash memory.
pub struct Store<F: NorFlash> {
    flash: F,
    addresses: Range<u32>,
    /// What was found when it was first looked for, and has been saved since.
    found: Option<Found>,
    /// The record that counts, or a blank one.
    record: Record,
    /// Counters of signatures that are stored as used, and are not used yet.
    #[cfg(feature = "signing")]
    reserved: Range<u32>,
}

/// What a flash memory holds.
#[derive(Clone, Copy, Debug)]
enum Found {
    /// Nothing, or records of another format.
    Nothing,
    /// Something that no store has written.
    Foreign,
    /// A record that counts, at this address.
    Record(u32),
}

impl<F: NorFlash> Store<F> {
    /// A store in the addresses `addresses` of `flash`: two or more whole erase units. Reads nothing yet.
    ///
    /// # Errors
    /// [`StoreError::Addresses`] when they are no whole units, or fewer than two.
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
            #[cfg(feature = "signing")]
            reserved: 0..0,
        })
    }

    /// The table that was saved last; none when there never was one.
    ///
    /// # Errors
    /// [`StoreError`] when the flash cannot be read, or holds damaged values.
    pub fn table(&mut self) -> Result<Option<L2aTable>, StoreError> {
        self.load(TABLE)?
            .map(|image| L2aTable::from_image(image).map_err(|_| StoreError::Damaged))
            .transpose()
    }

    /// The calibration that was saved last, without a limit; none when there never was one.
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

    /// The symbol rate and the carrier that were saved last; none when there never were any.
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

    /// The limit of the luminous intensity that was saved last; none when that was none, or there never was one.
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

    /// All that was saved last, and `typical` where no calibration was.
    pub fn remembered(&mut self, typical: Calibration) -> Remembered {
        let mut faults = Faults::empty();
        let calibration = readable(self.calibration(), &mut faults);
        let table = readable(self.table(), &mut faults);
        let timing = readable(self.timing(), &mut faults);
        let limit = readable(self.intensity_limit(), &mut faults);
        faults.set(Faults::NO_CALIBRATION, calibration.is_none());
        faults.set(Faults::NO_TABLE, table.is_none());
        Remembered {
            calibration: calibration.unwrap_or(typical).limited_to(limit),
            table: table.unwrap_or_else(L2aTable::shipped),
            timing: timing.unwrap_or_default(),
            faults,
        }
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.flash
    }

    /// An item of the record that counts.
    fn load(&mut self, item: Range<usize>) -> Result<Option<&[u8]>, StoreError> {
        if let Found::Foreign = self.find()? {
            return Err(StoreError::Damaged);
        }
        let (length, value) = self.record[item].split_first_chunk().unwrap_or((&[0xff; 2], &[]));
        Ok(value.get(..u16::from_le_bytes(*length).into()))
    }

    /// Writes the record that counts with this item in it as the next one.
    fn save(&mut self, item: Range<usize>, value: &[u8]) -> Result<(), StoreError> {
        let found = self.find()?;
        let address = self.blank_place(found)?;
        self.write(found, address, item, Some(value))
    }

    /// Writes the record that counts with this item in it, or without it, at this address.
    fn write(&mut self, found: Found, address: u32, item: Range<usize>, value: Option<&[u8]>) -> Result<(), StoreError> {
        let mut record = self.record;
        // What is torn in between may read whole another time: it is older than this then.
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

    /// The first place behind the record that counts where nothing stands. The first of an erase unit is made one.
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

    /// How many places behind `from` another one, `to`, stands.
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

    /// Looks for the record that counts, the first time.
    fn find(&mut self) -> Result<Found, StoreError> {
        if let Some(found) = self.found {
            return Ok(found);
        }
        let (mut is_foreign, mut is_other_format, mut newest) = (false, false, None);
        for address in self.addresses.clone().step_by(RECORD) {
            let record = self.read(address)?;
            if record == BLANK {
                continue;
            }
            if record[CRC_AT..] != crc_of(&record) {
                // In the first unit it may be the first record of all, torn.
                is_foreign |= address >= self.addresses.start + F::ERASE_SIZE as u32;
            } else if record[FORMAT_AT] != FORMAT {
                is_other_format = true;
            } else if newest.is_none() || number(&record).wrapping_sub(number(&self.record)).cast_signed() > 0 {
                newest = Some(address);
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
}

/// What was found; nothing, and a fault, where it cannot be read.
fn readable<T>(found: Result<Option<T>, StoreError>, faults: &mut Faults) -> Option<T> {
    found.unwrap_or_else(|_| {
        faults.insert(Faults::STORE);
        None
    })
}

fn number(record: &Record) -> u32 {
    let [_, a, b, c, d, ..] = *record;
    u32::from_le_bytes([a, b, c, d])
}

fn crc_of(record: &Record) -> [u8; 4] {
    crc32c(&[&record[..CRC_AT]]).to_le_bytes()
}

/// The place of an item behind another: its length, and at most `most` bytes.
const fn item(behind: usize, most: usize) -> Range<usize> {
    behind..behind + 2 + most
}
