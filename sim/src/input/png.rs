//! PNG files (ISO/IEC 15948) without what only describes them: a colour profile of some kilobytes unpacks to half a gigabyte.

use std::borrow::Cow;

/// What a file begins with.
const SIGNATURE: usize = 8;
/// A chunk's length, kind and checksum.
const AROUND: usize = 12;
/// Chunks that a picture may be shown without, and that change what it shows: transparency, and how the camera was held.
const KEPT: [&[u8]; 2] = [b"tRNS", b"eXIf"];

/// The file without the ancillary chunks that change no pixel. What is no chunk stays, for the decoder to say so.
pub fn without_ancillary(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut kept = Vec::new();
    let mut from = 0;
    let mut at = SIGNATURE;
    while let Some(chunk) = bytes.get(at..).and_then(chunk) {
        let kind = &chunk[4..8];
        // Ancillary ones have a small first letter.
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

/// The chunk that bytes begin with.
fn chunk(bytes: &[u8]) -> Option<&[u8]> {
    let length = bytes.first_chunk::<4>()?;
    let length = usize::try_from(u32::from_be_bytes(*length)).ok()?;
    bytes.get(..length.checked_add(AROUND)?)
}
