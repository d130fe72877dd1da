//! The common part of the programs, without signatures: its size is subtracted from theirs.
#![no_std]
#![no_main]

use vocc_signatures::{MESSAGE, Signed, run};

#[inline(never)]
fn timed_sign(seed: &[u8; 32]) -> Signed {
    let mut signature = [0; 64];
    signature.iter_mut().zip(MESSAGE).for_each(|(to, from)| *to = from);
    Signed { public: *seed, signature }
}

#[inline(never)]
fn timed_verify(signed: &Signed) -> bool {
    signed.signature.iter().zip(MESSAGE).all(|(&one, other)| one == other)
}

#[cortex_m_rt::entry]
fn main() -> ! {
    run(1, timed_sign, timed_verify)
}
