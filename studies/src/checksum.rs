//! The checksum of results and other saved work.

use crc::{CRC_64_XZ, Crc};

static CRC_64: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// The CRC-64 (XZ) of some text, in 16 hexadecimal digits.
///
/// ```
/// assert_eq!(studies::checksum::of(b"123456789"), "995dc9bbdf1939fa");
/// ```
pub fn of(text: &[u8]) -> String {
    format!("{:016x}", CRC_64.checksum(text))
}
