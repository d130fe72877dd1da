//! The table, the calibration, the symbol rate with its carrier and the intensity limit in flash memory, which lose nothing when the power
//! goes.
//!
//! Each is one item of a [`sequential_storage`] map: a new value is written beside the old one, and counts from
//! the moment it is whole. A power cut at any moment leaves the old value or the new; a test cuts it at every
//! single word and erase of updates, with torn words, and looks: `cargo test -p vocc-tx-firmware --test power_cut`.
//!
//! A place that holds something else, so that nothing of a store is found in it, is erased by the first save.
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

use embassy_futures::block_on;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use link::{
    checksum::crc32c,
    intensity::IntensityLimit,
    l2a_table::{L2aTable, image::IMAGE_MAX},
    serial::{Faults, Measured},
    symbol_rate::SymbolRate,
    waveform::{SymbolTiming, Waveform},
};
use sequential_storage::{
    Error,
    cache::{Cache, Uncached},
    map::{MapConfig, MapStorage},
};
use thiserror::Error;

use crate::calibration::Calibration;

/// The format of what is stored, before each value; another one is taken for nothing stored.
const FORMAT: u8 = 1;
const TABLE: u8 = 1;
const CALIBRATION: u8 = 2;
const SYMBOL_TIMING: u8 = 3;
const INTENSITY_LIMIT: u8 = 4;
/// The bits of a symbol rate; above them stand the carrier's cycles, which are 0 for panels that stand still.
const CYCLES_SHIFT: u32 = 20;
const _: () = assert!(SymbolRate::MAX.millihertz() < 1 << CYCLES_SHIFT && (Waveform::MAX_CYCLES as u32) < 1 << (32 - CYCLES_SHIFT));

/// Format, the longest value, CRC; rounded up to any flash's word of at most 32 bytes, and 1 byte of key.
const BUFFER: usize = (1 + 1 + IMAGE_MAX + 4).next_multiple_of(32);

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
    #[error("what the flash memory holds is damaged: write it again")]
    Damaged,
    /// There is no room for it.
    #[error("the store is full: give it more erase units")]
    Full,
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
    map: MapStorage<u8, Awaited<F>, Cache<Uncached, Uncached, Uncached, u8>>,
    buffer: [u8; BUFFER],
}

impl<F: NorFlash> Store<F> {
    /// A store in the addresses `addresses` of `flash`: two or more whole erase units. Reads nothing yet.
    ///
    /// # Errors
    /// [`StoreError::Addresses`] when they are no whole units, or fewer than two.
    pub fn new(flash: F, addresses: Range<u32>) -> Result<Self, StoreError> {
        let (start, end) = (addresses.start, addresses.end);
        if start > end {
            return Err(StoreError::Addresses { start, end });
        }
        let config = MapConfig::try_new(addresses).map_err(|_| StoreError::Addresses { start, end })?;
        Ok(Self {
            map: MapStorage::new(Awaited(flash), config, Cache::new_uncached()),
            buffer: [0; BUFFER],
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
        self.map.destroy().0.0
    }

    /// The content of an item: what stands between its format and its CRC.
    fn load(&mut self, key: u8) -> Result<Option<&[u8]>, StoreError> {
        let item: Option<&[u8]> = block_on(self.map.fetch_item(&mut self.buffer, &key)).map_err(|error| store_error(&error))?;
        item.map(|item| {
            let (content, crc) = item.split_last_chunk().ok_or(StoreError::Damaged)?;
            match content.split_first() {
                Some((&FORMAT, value)) if crc32c(&[content]) == u32::from_le_bytes(*crc) => Ok(value),
                _ => Err(StoreError::Damaged),
            }
        })
        .transpose()
    }

    fn save(&mut self, key: u8, value: &[u8]) -> Result<(), StoreError> {
        let mut item = heapless::Vec::<u8, BUFFER>::new();
        let mut append = |bytes: &[u8]| item.extend_from_slice(bytes).map_err(|_| StoreError::Full);
        append(&[FORMAT])?;
        append(value)?;
        let crc = crc32c(&[&item]);
        item.extend_from_slice(&crc.to_le_bytes()).map_err(|_| StoreError::Full)?;
        match self.put(key, &item) {
            Err(StoreError::Damaged) if self.is_foreign() => {
                block_on(self.map.erase_all()).map_err(|error| store_error(&error))?;
                self.put(key, &item)
            }
            done => done,
        }
    }

    fn put(&mut self, key: u8, item: &[u8]) -> Result<(), StoreError> {
        block_on(self.map.store_item(&mut self.buffer, &key, &item)).map_err(|error| store_error(&error))
    }

    /// Whether there is nothing in it that could be lost.
    fn is_foreign(&mut self) -> bool {
        [TABLE, CALIBRATION, SYMBOL_TIMING, INTENSITY_LIMIT]
            .into_iter()
            .all(|key| matches!(self.load(key), Ok(None) | Err(StoreError::Damaged)))
    }
}

impl<F: NorFlash> Memory for Store<F> {
    fn save_table(&mut self, table: &L2aTable) -> Result<(), StoreError> {
        self.save(TABLE, table.image())
    }

    fn save_calibration(&mut self, calibration: &Calibration) -> Result<(), StoreError> {
        let mut bytes = [0; 64];
        let bytes = postcard::to_slice(calibration.measured(), &mut bytes).map_err(|_| StoreError::Full)?;
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
}

/// What was found; nothing, and a fault, where it cannot be read.
fn readable<T>(found: Result<Option<T>, StoreError>, faults: &mut Faults) -> Option<T> {
    found.unwrap_or_else(|_| {
        faults.insert(Faults::STORE);
        None
    })
}

fn store_error<E>(error: &Error<E>) -> StoreError {
    match error {
        Error::Storage { .. } => StoreError::Flash,
        Error::FullStorage | Error::ItemTooBig => StoreError::Full,
        _ => StoreError::Damaged,
    }
}

/// A blocking flash where an asynchronous one is asked for: whatever is awaited is there at once.
struct Awaited<F>(F);

impl<F: ErrorType> ErrorType for Awaited<F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> embedded_storage_async::nor_flash::ReadNorFlash for Awaited<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> embedded_storage_async::nor_flash::NorFlash for Awaited<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write(offset, bytes)
    }
}
