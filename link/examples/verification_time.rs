//! The time in which this computer verifies the signature of a message: the median of many verifications. The arithmetic is optimised even
//! without `--release`.
//!
//! `cargo run -p vocc-link --features signing --example verification_time`

use std::hint::black_box;
use std::time::Instant;

use link::signing::{KeyError, SecretKey};

const VERIFICATIONS: usize = 2001;
const MESSAGE: &[u8] = b"ice on the bridge";

fn main() -> Result<(), KeyError> {
    let key = SecretKey::from_seed([1; 32])?;
    let (public, signature) = (key.public(), key.sign(MESSAGE, 7));
    let mut times_us: Vec<f64> = (0..VERIFICATIONS)
        .map(|_| {
            let began = Instant::now();
            assert!(black_box(public).has_signed(black_box(MESSAGE), black_box(&signature)));
            began.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    times_us.sort_by(f64::total_cmp);
    println!("{} bytes: {:.0} µs", MESSAGE.len(), times_us[VERIFICATIONS / 2]);
    Ok(())
}
