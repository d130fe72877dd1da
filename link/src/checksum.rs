//! The 32-bit checksum of all transmitted and stored data: CRC-32C.

use crc::{CRC_32_ISCSI, Crc, Digest, NoTable};

/// Without a table, which would take 1 KiB of a board's flash.
static CRC_32C: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// CRC-32C (CRC-32/ISCSI) of the concatenated parts.
///
/// ```
/// use link::checksum::crc32c;
/// assert_eq!(crc32c(&[b"12345", b"6789"]), 0xe306_9283);
/// ```
pub fn crc32c(parts: &[&[u8]]) -> u32 {
    let mut digest = digest();
    parts.iter().for_each(|part| digest.update(part));
    digest.finalize()
}

/// A CRC-32C of bytes that arrive one by one.
pub(crate) fn digest() -> Digest<'static, u32, NoTable> {
    CRC_32C.digest()
}
