//! A film that was put into memory before the program started.

use crate::capture::MODE;

/// The board's PSRAM, 16 MB: the number of frames, in four bytes, and their grey levels one behind another.
const START: usize = 0x8000_0000;
const BYTES: usize = 16 << 20;
const FRAME: usize = MODE.width() * MODE.height();

/// A film.
pub struct Film(&'static [u8]);

impl Film {
    /// What is in memory.
    pub fn in_memory() -> Self {
        // SAFETY: the memory is there as long as the program runs, nobody writes to it, and any bytes are grey levels.
        #[allow(unsafe_code)]
        Self(unsafe { core::slice::from_raw_parts(START as *const u8, BYTES) })
    }

    /// Its frames; no more than there is memory.
    pub fn frames(&self) -> impl Iterator<Item = &'static [u8]> {
        let (count, pixels) = self.0.split_first_chunk().unwrap_or((&[0; 4], &[]));
        pixels.chunks_exact(FRAME).take(u32::from_le_bytes(*count) as usize)
    }
}
