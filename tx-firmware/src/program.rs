//! The hash of the program that runs, by which it is compared with a released file.

use core::ops::Range;

use embedded_storage::nor_flash::ReadNorFlash;
use sha2::{Digest, Sha256};

/// Bytes that are read at once: a multiple of any flash's words.
const BLOCK: usize = 64;

/// Length and SHA-256 of a program, as it is in the flash memory.
///
/// ```
/// use tx_firmware::program::ProgramHash;
/// let hash = ProgramHash::of(b"abc");
/// assert_eq!((hash.length, &hash.sha256[..4]), (3, &[0xba, 0x78, 0x16, 0xbf][..]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramHash {
    /// Its bytes.
    pub length: u32,
    /// The SHA-256 of them.
    pub sha256: [u8; 32],
}

impl ProgramHash {
    /// The hash of a program's bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self {
            length: bytes.len() as u32,
            sha256: Sha256::digest(bytes).into(),
        }
    }

    /// The hash of the program at `addresses` of a flash memory. It is read by blocks of 64 bytes, the last one past the end.
    ///
    /// # Errors
    /// The flash's, if it cannot be read.
    // Not inlined: a test of the boards measures it.
    #[inline(never)]
    pub fn read<F: ReadNorFlash>(flash: &mut F, addresses: Range<u32>) -> Result<Self, F::Error> {
        const { assert!(BLOCK.is_multiple_of(F::READ_SIZE)) };
        let mut sha256 = Sha256::new();
        let mut block = [0; BLOCK];
        for address in addresses.clone().step_by(BLOCK) {
            flash.read(address, &mut block)?;
            let rest = (addresses.end - address) as usize;
            sha256.update(&block[..rest.min(BLOCK)]);
        }
        Ok(Self {
            length: addresses.len() as u32,
            sha256: sha256.finalize().into(),
        })
    }
}
