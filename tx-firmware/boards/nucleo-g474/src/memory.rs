//! The last 32 KiB of the flash, which keep the table and the calibration.
//!
//! They are in the second bank, and the program is in the first. So the program and its interrupts continue while a page is erased (22 ms)
//! or written, and a save needs no preparation.

use core::ops::Range;

use cortex_m_rt::exception;
use embassy_stm32::{
    Peri,
    flash::{Blocking, FLASH_BASE, FLASH_SIZE, Flash},
    pac,
    peripherals::FLASH,
};
use on_embassy::program;
use tx_firmware::store::{Store, StoreError};

/// 16 pages.
const STORE: Range<u32> = FLASH_SIZE as u32 - 32 * 1024..FLASH_SIZE as u32;

/// The store's memory.
pub type StoreFlash = Flash<'static, Blocking>;

/// The store in the board's flash.
///
/// # Errors
/// Never [`StoreError::Addresses`], because the range is 16 whole pages.
pub fn store(flash: Peri<'static, FLASH>) -> Result<Store<StoreFlash>, StoreError> {
    let store = Store::new(Flash::new_blocking(flash), STORE)?;
    Ok(store.beside_program(0..program::end() - FLASH_BASE as u32))
}

/// A power cut during a write leaves a word whose error correction fails. Reading it raises this exception, and then returns the word as
/// it is, which the store's checksum rejects. All other causes are fatal.
#[exception]
#[allow(unsafe_code)]
unsafe fn NonMaskableInt() {
    let status = pac::FLASH.eccr().read();
    let is_of_store = status.bk_ecc() && (status.eccd() || status.eccd2());
    assert!(is_of_store, "the fault is not in the store");
    // Each flag is cleared by a 1.
    pac::FLASH.eccr().write_value(status);
}
