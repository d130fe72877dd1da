//! The crate ed25519-compact.
#![no_std]
#![no_main]

use ed25519_compact::{KeyPair, PublicKey, Seed, Signature};
use vocc_signatures::{MESSAGE, Signed, run};

#[inline(never)]
fn timed_sign(seed: &[u8; 32]) -> Signed {
    let pair = KeyPair::from_seed(Seed::new(*seed));
    Signed {
        public: *pair.pk,
        signature: *pair.sk.sign(MESSAGE, None),
    }
}

#[inline(never)]
fn timed_verify(signed: &Signed) -> bool {
    PublicKey::new(signed.public)
        .verify(MESSAGE, &Signature::new(signed.signature))
        .is_ok()
}

#[cortex_m_rt::entry]
fn main() -> ! {
    run(16, timed_sign, timed_verify)
}
