//! Signs and verifies with Ed25519, a program for each crate. They have no output: `tests/boards/emulator/signatures.mjs` runs them on an
//! emulated Cortex-M0+ and measures the functions `timed_sign` and `timed_verify`.
#![no_std]

use cortex_m_rt as _;
use panic_halt as _;

/// A public key and its signature of [`MESSAGE`].
pub struct Signed {
    pub public: [u8; 32],
    pub signature: [u8; 64],
}

/// As many bytes as are signed for a message of 48 bytes.
pub const MESSAGE: [u8; 68] = *b"vocc message 1 and what follows it, in as many bytes as are signed. ";

/// The first bytes of the first key's signature, which is the same for all crates.
const FIRST: [u8; 8] = 0x0f07_80c0_ad6c_08d3_u64.to_be_bytes();

/// Signs with several keys, verifies the signatures, and sleeps. A wrong result ends in a panic, which never sleeps.
pub fn run(keys: u8, sign: fn(&[u8; 32]) -> Signed, verify: fn(&Signed) -> bool) -> ! {
    for key in 1..=keys {
        let mut signed = sign(&[key; 32]);
        assert!(key > 1 || signed.signature.starts_with(&FIRST));
        assert!(verify(&signed));
        signed.signature[40] ^= 1;
        assert!(!verify(&signed));
    }
    loop {
        cortex_m::asm::wfi();
    }
}
