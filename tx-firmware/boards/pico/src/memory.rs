//! The last 64 KiB of the flash, where the table and the calibration are kept.

use embassy_rp::{
    Peri,
    flash::{self, Blocking, FLASH_BASE, Flash},
    pac,
    peripherals::FLASH,
};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use on_embassy::{light::WATCHDOG, program};
use tx_firmware::store::{Store, StoreError};

use crate::{shared, symbols::STOP_MS};

const FLASH_BYTES: usize = 2 * 1024 * 1024;
/// The range that `memory-*.x` leaves free.
const STORE_BYTES: u32 = 64 * 1024;

/// A flash that prepares the panels of the next half second before it stops the processor, and feeds the watchdog before each erase.
pub struct SteadyFlash(Flash<'static, FLASH, Blocking, FLASH_BYTES>);

/// The store in the board's flash.
///
/// # Errors
/// Never [`StoreError::Addresses`], because the range is 16 whole sectors.
pub fn store(flash: Peri<'static, FLASH>) -> Result<Store<SteadyFlash>, StoreError> {
    let end = FLASH_BYTES as u32;
    let store = Store::new(SteadyFlash(Flash::new_blocking(flash)), end - STORE_BYTES..end)?;
    Ok(store.beside_program(0..program::end() - FLASH_BASE as u32))
}

impl ErrorType for SteadyFlash {
    type Error = flash::Error;
}

impl ReadNorFlash for SteadyFlash {
    const READ_SIZE: usize = <Flash<'static, FLASH, Blocking, FLASH_BYTES> as ReadNorFlash>::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), flash::Error> {
        self.0.blocking_read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl NorFlash for SteadyFlash {
    const WRITE_SIZE: usize = <Flash<'static, FLASH, Blocking, FLASH_BYTES> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Flash<'static, FLASH, Blocking, FLASH_BYTES> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), flash::Error> {
        prepare();
        // A change of the key erases many sectors. The RP2040's watchdog counts down by two per microsecond, the RP2350's by one.
        pac::WATCHDOG
            .load()
            .write_value(pac::watchdog::regs::Load(2 * WATCHDOG.as_micros() as u32));
        self.0.blocking_erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), flash::Error> {
        prepare();
        self.0.blocking_write(offset, bytes)
    }
}

fn prepare() {
    if let Some(shared) = shared::get() {
        shared.prepare_for_stop(STOP_MS);
    }
}
