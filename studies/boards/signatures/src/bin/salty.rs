//! The crate salty.
#![no_std]
#![no_main]

use salty::{Keypair, PublicKey, Signature};
use vocc_signatures::{MESSAGE, Signed, run};

#[inline(never)]
fn timed_sign(seed: &[u8; 32]) -> Signed {
    let pair = Keypair::from(seed);
    Signed {
        public: pair.public.to_bytes(),
        signature: pair.sign(&MESSAGE).to_bytes(),
    }
}

#[inline(never)]
fn timed_verify(signed: &Signed) -> bool {
    let key = PublicKey::try_from(&signed.public);
    key.is_ok_and(|key| key.verify(&MESSAGE, &Signature::from(&signed.signature)).is_ok())
}

/// Few keys, because each takes five seconds of the processor.
#[cortex_m_rt::entry]
fn main() -> ! {
    run(3, timed_sign, timed_verify)
}
