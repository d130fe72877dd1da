//! The flash memory of the simulated board, in a file or only in RAM: the last 64 KiB of a Pico's.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use tx_firmware::store::{Store, StoreError};

use crate::files;
use crate::output;
use crate::outputs;

/// The size of a Pico's store.
pub const FLASH_BYTES: usize = 64 * 1024;
const ERASE_BYTES: usize = 4096;
const ERASED: u8 = 0xff;

/// A memory whose words are bytes.
#[derive(Debug)]
pub struct Flash {
    bytes: Vec<u8>,
    file: Option<LockedFile>,
}

/// The file of the contents.
#[derive(Debug)]
struct LockedFile {
    path: PathBuf,
    /// The lock that keeps other boards out.
    _lock: Option<File>,
}

impl Flash {
    /// An erased memory in RAM.
    pub fn forgetful() -> Self {
        Self {
            bytes: vec![ERASED; FLASH_BYTES],
            file: None,
        }
    }

    /// The memory in a file, which is created if it does not exist.
    ///
    /// # Errors
    /// If the file does not hold such a memory, cannot be read and written, or is used by another board.
    pub fn in_file(path: &Path) -> anyhow::Result<Self> {
        let is_file = files::check(path)?;
        ensure!(
            is_file,
            "{} is a device or a pipe: give a file for the flash memory",
            path.display()
        );
        let mut flash = Self::forgetful();
        if path.exists() {
            flash.bytes = read(path)?;
        } else {
            // The file may later contain a private key.
            files::write_secret(path, &flash.bytes).with_context(|| format!("cannot write {}", path.display()))?;
        }
        flash.file = Some(LockedFile::open(path)?);
        Ok(flash)
    }

    /// Changes the bytes from `offset` on, both here and in the file, or in neither.
    fn change(&mut self, offset: usize, to: &[u8]) -> Result<(), Failure> {
        let place = offset..offset + to.len();
        let before = self.bytes[place.clone()].to_vec();
        self.bytes[place.clone()].copy_from_slice(to);
        let replaced = match &mut self.file {
            Some(file) => file.replace(&self.bytes),
            None => Ok(()),
        };
        replaced.map_err(|error| {
            self.bytes[place].copy_from_slice(&before);
            output::tell(format_args!("vocc: {}", output::explain(&error)));
            Failure(NorFlashErrorKind::Other)
        })
    }
}

/// The bytes in a board's file.
fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    file.take(FLASH_BYTES as u64 + 1)
        .read_to_end(&mut bytes)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let refused = || {
        format!(
            "{} is not a board's flash memory ({FLASH_BYTES} bytes that contain a store): give another file, or one that does not exist",
            path.display()
        )
    };
    ensure!(bytes.len() == FLASH_BYTES, refused());
    let flash = Flash {
        bytes: bytes.clone(),
        file: None,
    };
    let mut store = Store::new(flash, 0..FLASH_BYTES as u32)?;
    let is_foreign = |found: Option<StoreError>| found == Some(StoreError::Damaged);
    let nothing_is_found = is_foreign(store.table().err()) && is_foreign(store.calibration().err());
    ensure!(!nothing_is_found, refused());
    Ok(bytes)
}

impl LockedFile {
    fn open(path: &Path) -> anyhow::Result<Self> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let lock = outputs::lock(file, || {
            format!(
                "{} is in use by another simulated board: end that board, or give another file",
                path.display()
            )
        })?;
        Ok(Self {
            path: path.into(),
            _lock: lock,
        })
    }

    /// Replaces the file, and locks the new one.
    fn replace(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        files::write(&self.path, bytes)?;
        *self = Self::open(&self.path)?;
        Ok(())
    }
}

/// The memory was accessed incorrectly, or its file cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure(NorFlashErrorKind);

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

/// The range from `from` to `to`, which must consist of whole units.
fn place(from: u32, to: u32, unit: usize) -> Result<std::ops::Range<usize>, Failure> {
    let (from, to) = (from as usize, to as usize);
    if from > to || to > FLASH_BYTES {
        Err(Failure(NorFlashErrorKind::OutOfBounds))
    } else if !from.is_multiple_of(unit) || !to.is_multiple_of(unit) {
        Err(Failure(NorFlashErrorKind::NotAligned))
    } else {
        Ok(from..to)
    }
}

/// The address after `length` bytes.
fn end(offset: u32, length: usize) -> u32 {
    offset.saturating_add(length.try_into().unwrap_or(u32::MAX))
}

impl ErrorType for Flash {
    type Error = Failure;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        let place = place(offset, end(offset, bytes.len()), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.bytes[place]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = ERASE_BYTES;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        let place = place(from, to, Self::ERASE_SIZE)?;
        self.change(place.start, &vec![ERASED; place.len()])
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let place = place(offset, end(offset, bytes.len()), Self::WRITE_SIZE)?;
        // Programming clears bits but sets none.
        let old = &self.bytes[place.clone()];
        let cleared: Vec<u8> = old.iter().zip(bytes).map(|(old, new)| old & new).collect();
        self.change(place.start, &cleared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::l2a_table::L2aTable;
    use tx_firmware::store::Memory;

    fn store(flash: Flash) -> Store<Flash> {
        Store::new(flash, 0..FLASH_BYTES as u32).expect("a place")
    }

    #[test]
    fn what_is_saved_is_in_the_file_and_there_after_a_restart() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("flash");
        let mut first = store(Flash::in_file(&path).expect("made"));
        assert_eq!(first.table(), Ok(None));
        let second = Flash::in_file(&path).expect_err("held").to_string();
        assert!(second.contains("another simulated board"), "{second}");
        first.save_table(&L2aTable::shipped()).expect("saved");
        // The file was replaced, and is still locked.
        assert!(Flash::in_file(&path).is_err());
        drop(first);
        let mut again = store(Flash::in_file(&path).expect("there"));
        assert_eq!(again.table(), Ok(Some(L2aTable::shipped())));
    }

    #[test]
    fn other_files_are_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        for bytes in [vec![7; FLASH_BYTES], vec![ERASED; 10], b"text".to_vec()] {
            let path = folder.path().join("mine");
            std::fs::write(&path, &bytes).expect("written");
            let refusal = Flash::in_file(&path).expect_err("refused").to_string();
            assert!(refusal.contains("not a board's flash memory"), "{refusal}");
            assert_eq!(std::fs::read(&path).expect("there"), bytes);
        }
    }

    #[test]
    fn a_file_that_cannot_be_written_keeps_the_old_value() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("flash");
        let mut store = store(Flash::in_file(&path).expect("made"));
        store.save_table(&L2aTable::shipped()).expect("saved");
        std::fs::remove_file(&path).expect("there");
        std::fs::create_dir(&path).expect("in its place");
        let other = L2aTable::new(&[1.0], &[1.0], &[2.0]).expect("a table");
        assert_eq!(store.save_table(&other), Err(StoreError::Flash));
        assert_eq!(store.table(), Ok(Some(L2aTable::shipped())));
    }
}
