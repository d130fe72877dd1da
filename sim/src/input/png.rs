//! PNG files (ISO/IEC 15948) without descriptive chunks, because a colour profile of some kilobytes may unpack to half a gigabyte.

use std::borrow::Cow;

/// Bytes before the first chunk.
const SIGNATURE: usize = 8;
/// A chunk's length, kind and checksum.
const AROUND: usize = 12;
/// Ancillary chunks that change the picture: transparency, and the camera's orientation.
const KEPT: [&[u8]; 2] = [b"tRNS", b"eXIf"];

/// The file without the ancillary chunks that change no pixel. Invalid chunks stay, so that the decoder reports them.
pub fn without_ancillary(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut kept = Vec::new();
    let mut from = 0;
    let mut at = SIGNATURE;
    while let Some(chunk) = bytes.get(at..).and_then(chunk) {
        let kind = &chunk[4..8];
        // Ancillary chunks start with a small letter.
        if kind[0].is_ascii_lowercase() && !KEPT.contains(&kind) {
            kept.extend_from_slice(&bytes[from..at]);
            from = at + chunk.len();
        }
        at += chunk.len();
    }
    if from == 0 {
        return bytes.into();
    }
    kept.extend_from_slice(&bytes[from..]);
    kept.into()
}

/// The chunk at the start of bytes.
fn chunk(bytes: &[u8]) -> Option<&[u8]> {
    let length = bytes.first_chunk::<4>()?;
    let length = usize::try_from(u32::from_be_bytes(*length)).ok()?;
    bytes.get(..length.checked_add(AROUND)?)
}
