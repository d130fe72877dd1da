//! The crate ed25519-dalek.
#![no_std]
#![no_main]

use ed25519_dalek::{Signature, Signer, SigningKey, Verifier, VerifyingKey};
use vocc_signatures::{MESSAGE, Signed, run};

#[inline(never)]
fn timed_sign(seed: &[u8; 32]) -> Signed {
    let key = SigningKey::from_bytes(seed);
    Signed {
        public: key.verifying_key().to_bytes(),
        signature: key.sign(&MESSAGE).to_bytes(),
    }
}

#[inline(never)]
fn timed_verify(signed: &Signed) -> bool {
    let key = VerifyingKey::from_bytes(&signed.public);
    key.is_ok_and(|key| key.verify(&MESSAGE, &Signature::from_bytes(&signed.signature)).is_ok())
}

#[cortex_m_rt::entry]
fn main() -> ! {
    run(16, timed_sign, timed_verify)
}
