//! Where the program is in the flash.

#[allow(unsafe_code)]
// SAFETY: `memory*.x` defines this symbol. Only its address is used.
unsafe extern "C" {
    safe static __program_end: u8;
}

/// The address after the program's last byte.
pub fn end() -> u32 {
    (&raw const __program_end).addr() as u32
}
